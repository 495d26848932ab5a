"""Backups, and moves from one database to another."""
