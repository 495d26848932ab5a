"""Playgrounds: a policy drives in an arena that a person changes meanwhile; each belongs to who opened it."""
