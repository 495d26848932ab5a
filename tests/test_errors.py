"""One tree of errors: whatever Mapless raises on purpose is a MaplessError, and says so in its module's drawing."""

import importlib
import inspect
import pkgutil

import server
import sim
import workers
from server.errors import DatabaseBusyError, ServiceError
from server.http.problems import retry_after
from sim.errors import MaplessError

# What a robot runs by itself: it has none of our packages.
_ALONE = "workers.export.ros2"


def raised_on_purpose() -> set[type[Exception]]:
    modules = [
        importlib.import_module(found.name)
        for package in (sim, workers, server)
        for found in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
        if not found.name.startswith(_ALONE) and not found.name.endswith("__main__") and ".migrations" not in found.name
    ]
    return {
        error
        for module in modules
        for _, error in inspect.getmembers(module, inspect.isclass)
        if issubclass(error, Exception) and error.__module__ == module.__name__
    }


def test_every_error_of_ours_descends_from_one() -> None:
    errors = raised_on_purpose()
    assert len(errors) > 50
    assert [error.__qualname__ for error in errors if not issubclass(error, MaplessError)] == []


def test_whatever_is_refused_for_now_says_when_to_come_again() -> None:
    refused = [error for error in raised_on_purpose() if issubclass(error, ServiceError) and error.status == 503]
    assert len(refused) > 5
    assert [error.__qualname__ for error in refused if not error.come_again] == []
    assert retry_after(DatabaseBusyError("The database is busy.")) == {"Retry-After": "1"}
