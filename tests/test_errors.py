"""One tree of errors: whatever Mapless raises on purpose is a MaplessError, and says so in its module's drawing."""

import importlib
import inspect
import pkgutil

import server
import sim
import workers
from sim.errors import MaplessError

# What a robot runs by itself: it has none of our packages.
_ALONE = "workers.export.ros2"


def test_every_error_of_ours_descends_from_one() -> None:
    modules = [
        importlib.import_module(found.name)
        for package in (sim, workers, server)
        for found in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
        if not found.name.startswith(_ALONE) and not found.name.endswith("__main__") and ".migrations" not in found.name
    ]
    errors = {
        error
        for module in modules
        for _, error in inspect.getmembers(module, inspect.isclass)
        if issubclass(error, Exception) and error.__module__ == module.__name__
    }
    assert len(errors) > 50
    assert [error.__qualname__ for error in errors if not issubclass(error, MaplessError)] == []
