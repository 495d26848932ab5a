"""Is it learning? What a run's own curves say about it, each finding with its evidence and what to try (NumPy only)."""

from workers.diagnoses.behavior import BEHAVIOR_RULES
from workers.diagnoses.history import History, Series
from workers.diagnoses.learning import LEARNING_RULES
from workers.diagnoses.model import Diagnosis, Evidence

__all__ = ["Diagnosis", "Evidence", "History", "Series", "diagnose"]


def diagnose(history: History) -> tuple[Diagnosis, ...]:
    """All that is wrong with a run as far as its curves tell, causes before symptoms; empty for a healthy one."""
    found = (rule(history) for rule in (*LEARNING_RULES, *BEHAVIOR_RULES))
    return tuple(diagnosis for diagnosis in found if diagnosis is not None)
