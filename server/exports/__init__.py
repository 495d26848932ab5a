"""Policies on their way out: the deployment bundle of a checkpoint."""
