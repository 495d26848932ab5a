"""Everything that can go wrong in the simulator, and the root of all errors that Mapless raises on purpose.

MaplessError          (also the base of WorkerError in workers/errors.py and of ServiceError in server/errors.py)
└── SimError
    ├── ArenaError       an arena cannot be built or driven in
    │   └── ArenaFileError       a file is not taken as an arena
    │       ├── ArenaFormatError     it is not what it should be, or holds what cannot be represented
    │       ├── ArenaLimitError      it is larger than we accept
    │       └── NoFreeSpaceError     a robot has no room in it
    ├── DisplayError     there is no window to show pictures in
    ├── FormulaError     a formula of the reward is not a finite number
    ├── ObservationError an observation does not tell what it should
    ├── PlacementError   a requested pose or target is not in the arena's free space
    └── SuiteError       a suite is unknown, or its content is not what its hash says
"""


class MaplessError(Exception):
    """Base of every error that Mapless raises on purpose; the message says what to do next."""


class SimError(MaplessError):
    """Base of the simulator's errors; the message says what to do."""


class ArenaError(SimError):
    """An arena cannot be built, read or driven in."""


class ArenaFileError(ArenaError):
    """A file is not taken as an arena."""


class ArenaFormatError(ArenaFileError):
    """A file is not what it should be, or holds what cannot be represented."""


class ArenaLimitError(ArenaFileError):
    """A file, or the arena in it, is larger than we accept."""


class NoFreeSpaceError(ArenaFileError):
    """There is no room for a robot in an arena."""


class BaselineError(SimError):
    """A planner cannot drive this robot."""


class DisplayError(SimError):
    """There is no window to show pictures in."""


class ObservationError(SimError):
    """An observation does not have the part that a controller drives by, or an extension's part is not made of numbers."""


class PlacementError(SimError):
    """A requested pose or target does not fit into the arena."""


class FormulaError(SimError):
    """A formula of the reward is not a finite number for what a robot met."""


class SuiteError(SimError):
    """A suite is unknown, does not fit the task, or has changed since its hash was taken."""
