"""What every configuration model is built on (pydantic only); extensions build on the same."""

from sim.extending.base import ADVANCED as ADVANCED
from sim.extending.base import HIDDEN as HIDDEN
from sim.extending.base import Frozen as Frozen
from sim.extending.base import needs as needs
