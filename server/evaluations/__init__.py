"""Evaluations that people ask for: any policy or baseline on any suite, family or imported arena."""
