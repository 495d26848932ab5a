"""Families by policies: what ships, baselines of equal sight, and what people had measured themselves."""
