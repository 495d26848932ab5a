"""Everything that can go wrong in the simulator.

SimError
├── ArenaError       an arena cannot be built or driven in
│   └── ArenaFileError       a file is not taken as an arena
│       ├── ArenaFormatError     it is not what it should be, or holds what cannot be represented
│       ├── ArenaLimitError      it is larger than we accept
│       └── NoFreeSpaceError     a robot has no room in it
├── DisplayError     there is no window to show pictures in
├── PlacementError   a requested pose or target is not in the arena's free space
└── SuiteError       a suite is unknown, or its content is not what its hash says
"""


class SimError(Exception):
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


class DisplayError(SimError):
    """There is no window to show pictures in."""


class PlacementError(SimError):
    """A requested pose or target does not fit into the arena."""


class FormulaError(SimError):
    """A formula of the reward is not a finite number for what a robot met."""


class SuiteError(SimError):
    """A suite is unknown, does not fit the task, or has changed since its hash was taken."""
