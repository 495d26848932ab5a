"""Controllers that need no training: what a policy has to beat."""
