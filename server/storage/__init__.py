"""How much of the disk each experiment takes, and rules for which checkpoints stay."""
