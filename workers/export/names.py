"""What a policy's graph calls its inputs and outputs (nothing that computes: who only looks at a file asks)."""

OBSERVATION, ACTION = "observation", "action"
MEMORY, NEXT_MEMORY = "memory", "next_memory"
