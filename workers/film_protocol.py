"""What a film shows, as its maker must know it (pydantic only): an episode by one policy or several, or a run's learning."""

from typing import Annotated, Literal, Self

from pydantic import Field

from sim.config import AnyRobotConfig, Frozen, LidarConfig, TaskConfig
from workers.scene.themes import Theme

FilmForm = Literal["scene", "mcap", "mp4", "gif"]
"""A recording in 3D for viser's player, ROS 2 messages, or pictures from above."""

MAX_TOGETHER = 6
"""Policies in one film of an episode: as many as have colours that are told apart at a glance."""
MAX_CHAPTERS = 8
"""Checkpoints in a film of a run's learning."""
MAX_ROBOTS = 8
"""In one picture of a run's learning."""

RecordingName = Annotated[str, Field(pattern=r"^[0-9A-Za-z_-]{1,120}$")]


class Drawn(Frozen):
    """What is drawn of a task: nothing that an extension adds, so that any worker can do it."""

    robot: AnyRobotConfig
    lidar: LidarConfig
    control_period: float
    arrival_distance: float
    collision_distance: float

    @classmethod
    def of(cls, task: TaskConfig) -> Self:
        """That of a task."""
        return cls(**{name: getattr(task, name) for name in cls.model_fields})

    def task(self) -> TaskConfig:
        """A task that is drawn like it."""
        return TaskConfig().model_copy(update={name: getattr(self, name) for name in type(self).model_fields})


class FilmedPolicy(Frozen):
    """One of those that drove.

    Attributes:
        title: for people.
        recording: the name by which the recording of its evaluation is kept.
        suite_hash: of the suite that it was measured on.
        drawn: its robot.
    """

    title: str
    recording: RecordingName
    suite_hash: str
    drawn: Drawn


class EpisodeFilm(Frozen):
    """One scenario, by all who drove it.

    Attributes:
        form: of the file.
        theme: in which it is drawn.
        suite: its name.
        episode: its place in the suite, from 0.
        policies: in the order of their colours.
    """

    shows: Literal["episode"] = "episode"
    form: FilmForm
    theme: Theme = "light"
    suite: str
    episode: int = Field(ge=0)
    policies: tuple[FilmedPolicy, ...] = Field(min_length=1, max_length=MAX_TOGETHER)


class FilmedChapter(Frozen):
    """One checkpoint of a run's learning.

    Attributes:
        policy: that drove.
        begins: in the film, seconds.
        lasts: in the film, seconds, beside the picture at its end.
    """

    policy: FilmedPolicy
    begins: float = Field(ge=0.0)
    lasts: float = Field(gt=0.0)


class LapseFilm(Frozen):
    """A run's learning in 3D: the same scenarios by one checkpoint after another.

    Attributes:
        theme: in which it is drawn.
        scenarios: places in the suite, all in one arena.
        chapters: the oldest first.
    """

    shows: Literal["lapse"] = "lapse"
    theme: Theme
    scenarios: tuple[int, ...] = Field(min_length=1, max_length=MAX_ROBOTS)
    chapters: tuple[FilmedChapter, ...] = Field(min_length=1, max_length=MAX_CHAPTERS)

    @property
    def policies(self) -> tuple[FilmedPolicy, ...]:
        """Those of all chapters."""
        return tuple(chapter.policy for chapter in self.chapters)


Film = Annotated[EpisodeFilm | LapseFilm, Field(discriminator="shows")]
