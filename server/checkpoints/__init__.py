"""Policies that were kept, and how they did."""
