"""The paper's tables, row by row: which trainings they mean, running them as one campaign, and what comes of its claims."""
