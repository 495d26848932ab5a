"""The trained policies that ship with the project."""
