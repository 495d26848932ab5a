"""Trained policies that ship with the project, and the table that they are made from."""
