"""The files of frozen suites: which there are (nothing that computes: the server lists them)."""

from importlib import resources

_FOLDER = resources.files("sim") / "suites" / "data"


def suite_names() -> tuple[str, ...]:
    """All frozen suites, by name."""
    return tuple(sorted(file.name.removesuffix(".json") for file in _FOLDER.iterdir() if file.name.endswith(".json")))


def suite_text(name: str) -> str:
    """The file of a suite, as JSON.

    Raises:
        OSError: there is none.
    """
    return (_FOLDER / f"{name}.json").read_text("utf-8")
