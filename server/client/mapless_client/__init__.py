"""Speaks to any Mapless server with a token: launch trainings, watch, compare, take policies home.

    import mapless_client

    with mapless_client.connect("http://127.0.0.1:8400", token="...") as mapless:
        for training in mapless.experiments("algorithm = ppo success > 90%"):
            print(training.name, training.success)

It imports nothing of the server, the workers or the simulator.
"""

from mapless_client.client import Client, connect
from mapless_client.curves import Curve
from mapless_client.downloads import Form, Pulled
from mapless_client.errors import (
    ClientError,
    ConflictError,
    DamagedDownloadError,
    ForbiddenError,
    InvalidRequestError,
    NotFoundError,
    RefusedError,
    UnauthorizedError,
    UnreachableError,
)
from mapless_client.models import (
    Bag,
    BagReading,
    Checkpoint,
    ComparedExperiment,
    Comparison,
    ComparisonVerdict,
    Diagnoses,
    Diagnosis,
    Difference,
    Estimate,
    Evaluation,
    Evidence,
    Experiment,
    Fitted,
    ImportedRun,
    ImportedThing,
    Improvement,
    Judgement,
    ListedExperiment,
    PairedTest,
    Project,
    ProjectImport,
    Run,
    RunEvent,
    RunState,
    SeedMean,
    Setting,
    Study,
    Thinned,
    Trial,
)

__all__ = [
    "Bag",
    "BagReading",
    "Checkpoint",
    "Client",
    "ClientError",
    "ComparedExperiment",
    "Comparison",
    "ComparisonVerdict",
    "ConflictError",
    "Curve",
    "DamagedDownloadError",
    "Diagnoses",
    "Diagnosis",
    "Difference",
    "Estimate",
    "Evaluation",
    "Evidence",
    "Experiment",
    "Fitted",
    "ForbiddenError",
    "Form",
    "ImportedRun",
    "ImportedThing",
    "Improvement",
    "InvalidRequestError",
    "Judgement",
    "ListedExperiment",
    "NotFoundError",
    "PairedTest",
    "Project",
    "ProjectImport",
    "Pulled",
    "RefusedError",
    "Run",
    "RunEvent",
    "RunState",
    "SeedMean",
    "Setting",
    "Study",
    "Thinned",
    "Trial",
    "UnauthorizedError",
    "UnreachableError",
    "connect",
]
