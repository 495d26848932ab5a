"""What a study searches: settings with the values that they may take, and the training that a choice of them makes."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from server.schemas import Schema
from sim.config.refusals import to_tell
from sim.errors import MaplessError
from workers.config import TrainingConfig

Value = bool | int | float | str | list[int | float]
Values = dict[str, Value]
"""Of every searched setting, by its path."""

MAX_SETTINGS = 20
MAX_VALUES = 50

# Where trials drive, what counts as an arrival, when they are looked at, and what on: the same for all of them.
_MEASURE = ("task.arena", "task.arrival_distance", "task.collision_distance", "task.step_limit", "evaluation", "device")

_Path = Annotated[
    str,
    Field(
        min_length=1,
        max_length=160,
        description='Of the setting in the training, dotted: "algorithm.learning_rate", "task.reward.terms.0.weight".',
    ),
]


class RangedSetting(Schema):
    """A number that may be anything between two others; whole where the setting is."""

    kind: Literal["range"]
    path: _Path
    low: float = Field(allow_inf_nan=False)
    high: float = Field(allow_inf_nan=False)
    log: bool = Field(
        False,
        description="Whether what counts is how many times as large, as with step sizes; below 0, by the amount.",
    )
    points: int = Field(5, ge=2, le=MAX_VALUES, description="Values of it in a grid.")

    @property
    def mirrored(self) -> bool:
        """Whether it is what is below 0 that counts by ratio: then searched by its amount."""
        return self.log and self.high < 0

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.low >= self.high:
            raise ValueError(f"the range of {self.path} has to begin below its end")
        if self.log and self.low <= 0 <= self.high:
            raise ValueError(f"for a logarithmic scale the range of {self.path} has to keep to one side of 0")
        return self


class ListedSetting(Schema):
    """A setting that takes one of a few values."""

    kind: Literal["list"]
    path: _Path
    values: list[Value] = Field(
        min_length=2,
        max_length=MAX_VALUES,
        description="Lists of numbers where the setting is one, as the sizes of hidden layers are: [[64, 64], [256]].",
    )

    @model_validator(mode="after")
    def _differ(self) -> Self:
        if len({(type(value), str(value)) for value in self.values}) < len(self.values):
            raise ValueError(f"the values of {self.path} have to differ")
        return self


SearchedSetting = Annotated[RangedSetting | ListedSetting, Field(discriminator="kind")]


class UnusableSettingError(MaplessError, ValueError):
    """A setting can't be searched.

    Args:
        path: of the setting.
        message: why, and what would do.
    """

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.message = message


@dataclass(frozen=True)
class Space:
    """The settings of a study over a training.

    Attributes:
        base: the training, in JSON, whose other settings all trials share.
        settings: that are searched.
    """

    base: Mapping[str, Any]
    settings: Sequence[RangedSetting | ListedSetting]

    def is_whole(self, setting: RangedSetting) -> bool:
        """Whether the setting takes whole numbers only."""
        return isinstance(_value_at(self.base, setting.path), int)

    def training(self, values: Values) -> TrainingConfig:
        """The training with these values.

        Raises:
            ValidationError: they don't go together.
        """
        document = deepcopy(dict(self.base))
        for path, value in values.items():
            *outer, last = path.split(".")
            place: Any = document
            for key in outer:
                place = _inside(place, key)
            place[int(last) if isinstance(place, list) else last] = value
        return TrainingConfig.model_validate(document)

    def check(self) -> None:
        """That every setting is there, and takes the values that it is to take.

        Raises:
            UnusableSettingError: one does not.
        """
        seen: set[str] = set()
        for setting in self.settings:
            if setting.path in seen:
                raise UnusableSettingError(setting.path, "it can be searched only once")
            seen.add(setting.path)
            self._check_kind(setting)
            for value in setting.values if isinstance(setting, ListedSetting) else self._ends(setting):
                self._check_value(setting.path, value)

    def _ends(self, setting: RangedSetting) -> list[Value]:
        return [int(end) if self.is_whole(setting) else end for end in (setting.low, setting.high)]

    def _check_kind(self, setting: RangedSetting | ListedSetting) -> None:
        path = setting.path
        if any(path == fixed or path.startswith(f"{fixed}.") for fixed in _MEASURE):
            raise UnusableSettingError(path, "it changes what trials are measured by: they could not be compared")
        try:
            value = _value_at(self.base, path)
        except (KeyError, IndexError, TypeError, ValueError):
            raise UnusableSettingError(path, "this training has no such setting") from None
        listed = _is_list_of_numbers(value)
        if (isinstance(value, dict | list) and not listed) or path.rpartition(".")[2] == "name":
            raise UnusableSettingError(path, "only numbers, choices and lists of numbers can be searched")
        if isinstance(setting, ListedSetting):
            for one in setting.values:
                if isinstance(one, list) != listed:
                    wanted = "is a list of numbers, as 64, 64 is" if listed else "takes single values, no lists of them"
                    raise UnusableSettingError(path, f"it {wanted}: {_text(one)} does not do")
            return
        # One that is not set has no kind yet: whether it takes numbers is seen as the ends are tried.
        if isinstance(value, bool) or not isinstance(value, int | float | None):
            raise UnusableSettingError(path, "a range is for numbers: list its values instead")
        if isinstance(value, int) and not (setting.low.is_integer() and setting.high.is_integer()):
            raise UnusableSettingError(path, "its range has to begin and end at whole numbers")

    def _check_value(self, path: str, value: Value) -> None:
        try:
            self.training({path: value})
        except ValidationError as error:
            own = [problem for problem in error.errors() if _setting_of(problem["loc"]) == _setting_of(path.split("."))]
            # What others do not go with may go with others: such a trial fails, and says so.
            if own:
                raise UnusableSettingError(path, f"{_text(value)} is refused: {wording(error)}") from error


def wording(error: ValidationError) -> str:
    """What a training is refused for, in a line."""
    return "; ".join(problem["msg"].removeprefix("Value error, ") for problem in to_tell(error.errors()))[:500]


def _text(value: Value) -> str:
    return ", ".join(map(str, value)) or "none" if isinstance(value, list) else repr(value)


def _is_list_of_numbers(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, int | float) for one in value)


def _setting_of(place: Sequence[int | str]) -> str:
    """The last name on the way to a value: of a list's item, the list's."""
    return next((part for part in reversed(place) if isinstance(part, str) and not part.isdigit()), "")


def _value_at(document: Any, path: str) -> Any:
    for key in path.split("."):
        document = _inside(document, key)
    return document


def _inside(document: Any, key: str) -> Any:
    return document[int(key) if isinstance(document, list) else key]
