"""The paper reproduced: its tables launched as one campaign of experiments, and what comes of its claims."""
