"""The files of frozen suites: which there are (nothing that computes: the server lists them)."""

from importlib import resources

_FOLDER = resources.files("sim") / "suites" / "data"

MEANINGS = {
    "barn-20": "20 worlds of the BARN benchmark, for any robot: 10 m straight on through a field of thin pillars.",
    "barn-jackal-300": "300 worlds drawn as BARN's are, by its challenge's rules: a Jackal, 2 m/s, against the clock.",
    "clutter-500": "50 maps of clutter, difficulty 0.5.",
    "complex-200": "The paper's complex arena.",
    "crowd-200": "A slow robot's luck: pedestrians four times as fast do not see it, so one that stands is hit too.",
    "heedless-500": "The scenes of people-500, among people who do not see the robot.",
    "people-500": "Scenes among people as fast as the robot, who give way to it as to one another.",
    "simple-200": "The paper's simple arena.",
}
"""What each frozen suite asks of a policy, in a sentence."""


def suite_names() -> tuple[str, ...]:
    """All frozen suites, by name."""
    return tuple(sorted(file.name.removesuffix(".json") for file in _FOLDER.iterdir() if file.name.endswith(".json")))


def suite_text(name: str) -> str:
    """The file of a suite, as JSON.

    Raises:
        OSError: there is none.
    """
    return (_FOLDER / f"{name}.json").read_text("utf-8")
