"""The errors of this package, one tree; every message says what to do next.

WorkerError (a sim.errors.MaplessError)
├── TrainingError          a training cannot go on
│   ├── NonFiniteError     its weights are no longer numbers
│   ├── MemoryTooLargeError    its checkpoints would be larger than anybody takes
│   └── NetworkError       its network's module is not one that can be trained
├── CampaignError          the paper's reproduction does not go on here and now
│   ├── InterruptedCampaignError  it was asked to stop, or a process was killed: it can be continued
│   └── OtherTrainingError        its directory is that of another campaign
├── FrameError             bytes are no frame of the live view
├── ExportError            a policy cannot be taken to another format
├── UnknownPolicyError     there is no such shipped policy
├── BagError               a robot's recording can't be read, or lacks what is needed
├── EpisodesTooLongError   episodes do not fit into memory to be replayed
├── LocalError             something is wrong with this worker or its machine, not with the run
│   ├── NoDeviceError          it does not have the device that the training asks for
│   ├── UnfitError             it cannot take up a run now: no space, or no trainer starts
│   └── SpoolDamagedError      what a training reported is no longer what was written to disk
├── ArchiveError           a checkpoint archive is refused
│   ├── ArchiveFormatError       not an archive of this project, or of a newer version
│   ├── ArchiveIntegrityError    its content is not what its manifest says
│   ├── ArchiveExtensionError    it needs an extension that is not installed
│   └── ArchiveMismatchError     it belongs to another training
└── ServerError            the server does not do what a worker asks of it
    ├── ServerUnavailableError   not reached, or not able to answer: ask again later
    ├── RunRefusedError          the run is not this worker's (any more)
    ├── CheckpointGoneError      it no longer has a checkpoint's archive
    └── RequestRefusedError      it would refuse the same request again
"""

from sim.errors import MaplessError


class WorkerError(MaplessError):
    """Base of every error that this package raises on purpose."""


class TrainingError(WorkerError):
    """A training cannot go on."""


class NonFiniteError(TrainingError):
    """The weights of a training are no longer finite numbers."""


class MemoryTooLargeError(TrainingError):
    """The replay memory of a training makes checkpoints that nobody could take or read."""


class NetworkError(TrainingError):
    """The module of a network is not one that can be trained, saved and resumed."""


class CampaignError(WorkerError):
    """The paper's reproduction does not go on here and now."""


class InterruptedCampaignError(CampaignError):
    """A campaign was asked to stop, or one of its processes was killed; it can be continued."""


class OtherTrainingError(CampaignError):
    """A folder of a campaign holds a training with other settings."""


class FrameError(WorkerError):
    """The bytes are not a frame of this version."""


class ExportError(WorkerError):
    """A policy cannot be taken to another format without changing it."""


class UnknownPolicyError(WorkerError):
    """There is no shipped policy of that name, or none that was measured on that suite."""


class BagError(WorkerError):
    """A robot's recording can't be read, or lacks what is asked of it."""


class ForeignPolicyError(WorkerError):
    """A policy that somebody has uploaded can't be run, or is for another robot."""


class EpisodesTooLongError(WorkerError):
    """The moments of an evaluation do not fit into memory."""


class LocalError(WorkerError):
    """Something is wrong with this worker or its machine: another one may do better."""


class UnfitError(LocalError):
    """This worker cannot take up a run now."""


class NoDeviceError(LocalError):
    """This machine does not have the device that a training asks for."""


class SpoolDamagedError(LocalError):
    """What a training reported is no longer what was written to disk."""


class ArchiveError(WorkerError):
    """A checkpoint archive is refused."""


class ArchiveFormatError(ArchiveError):
    """Not a checkpoint archive, or one of a version that this release does not know."""


class ArchiveIntegrityError(ArchiveError):
    """The content of an archive is not what its manifest promises."""


class ArchiveExtensionError(ArchiveError):
    """An archive was made with an extension that is not installed here; the message says which, and how to get it."""


class ArchiveMismatchError(ArchiveError):
    """An archive belongs to another training than the one that it should resume."""


class ServerError(WorkerError):
    """The server does not do what a worker asks of it."""


class ServerUnavailableError(ServerError):
    """The server is not reached, or cannot answer now; the same request may succeed later."""


class RunRefusedError(ServerError):
    """The run is not this worker's: somebody else has it, or it has ended."""


class CheckpointGoneError(ServerError):
    """The server no longer has a checkpoint's archive; an older one may be there."""


class RequestRefusedError(ServerError):
    """The server would refuse the same request again; the message says why."""
