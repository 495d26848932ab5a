"""A policy of somebody else's: an ONNX file, run by onnxruntime on one thread, checked against the task that it is for."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import onnx
from google.protobuf.message import DecodeError, Message
from onnx import TensorProto

from sim.actions import action_layout
from sim.arrays import Floats
from sim.config import TaskConfig
from sim.observations import observation_layout
from workers.errors import ForeignPolicyError
from workers.export.names import ACTION, MEMORY, NEXT_MEMORY, OBSERVATION
from workers.onnx_runtime import session

MAX_MEMORY = 65_536
"""Numbers that such a policy may remember of a robot."""


class OnnxPolicy:
    """A policy from an ONNX graph with the input `observation` (n, numbers) and the output `action` (n, A).

    Actions are fractions of the robot's limits, as `sim.actions.action_layout` has them; what lies beyond is cut. One that
    remembers has the input `memory` (n, m) and the output `next_memory`, as those that this project exports.

    Args:
        graph: the file's bytes; one that keeps tensors in other files is refused, as those could be any of this machine's.
        task: robot, LiDAR and observation that it is for.

    Raises:
        ForeignPolicyError: it is no ONNX file that onnxruntime runs, or its shapes are not the task's.
    """

    def __init__(self, graph: bytes, task: TaskConfig) -> None:
        _refuse_other_files(graph)
        try:
            self._session = session(graph)
        except Exception as error:  # onnxruntime's errors share no base but this
            raise ForeignPolicyError(f"onnxruntime does not run this file: {_first_line(error)}") from error
        actions = action_layout(task.robot)
        self._lows = actions.lows
        inputs = {each.name: each.shape for each in self._session.get_inputs()}
        outputs = {each.name: each.shape for each in self._session.get_outputs()}
        if unknown := inputs.keys() - {OBSERVATION, MEMORY}:
            raise ForeignPolicyError(
                f"the file asks for {', '.join(sorted(unknown))}: it may have the inputs {OBSERVATION!r} and {MEMORY!r} only"
            )
        _check(inputs, OBSERVATION, observation_layout(task).size, "the input")
        _check(outputs, ACTION, actions.size, "the output")
        self.memory_size = 0
        if MEMORY in inputs:
            self.memory_size = _columns(inputs[MEMORY])
            if not 0 < self.memory_size <= MAX_MEMORY:
                raise ForeignPolicyError(f"the input {MEMORY!r} must say how many numbers it has, at most {MAX_MEMORY}")
            _check(outputs, NEXT_MEMORY, self.memory_size, "the output")

    def __call__(self, observations: Floats) -> Floats:
        """Observations (n, numbers) to actions (n, A), of robots that begin where it remembers."""
        return self.step(observations, np.zeros((len(observations), self.memory_size), np.float32))[0]

    def step(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """See `sim.drivers.RecurrentPolicy`.

        Raises:
            ForeignPolicyError: it does not run, or its actions are not finite numbers of the right shape.
        """
        given = {OBSERVATION: observations} | ({MEMORY: memory} if self.memory_size else {})
        names = [ACTION, NEXT_MEMORY] if self.memory_size else [ACTION]
        try:
            found = self._session.run(names, given)
        except Exception as error:  # as above
            raise ForeignPolicyError(f"it does not run: {_first_line(error)}") from error
        actions = np.asarray(found[0], np.float32)
        if actions.shape != (len(observations), len(self._lows)) or not np.isfinite(actions).all():
            raise ForeignPolicyError(
                f"its actions for {len(observations)} robots are not {len(self._lows)} finite numbers each"
            )
        following: Floats = np.asarray(found[1], np.float32) if self.memory_size else memory
        return np.clip(actions, self._lows, 1.0), following


def _refuse_other_files(graph: bytes) -> None:
    try:
        model = onnx.load_from_string(graph)
    except DecodeError as error:
        raise ForeignPolicyError("this is no ONNX file") from error
    if any(tensor.data_location == TensorProto.EXTERNAL for tensor in _tensors(model)):
        raise ForeignPolicyError("the file keeps its weights in another one: save them inside (save_as_external_data=False)")


def _tensors(message: Message) -> Iterator[TensorProto]:
    """Every tensor of a model: in its graph, the graphs inside that, attributes, functions."""
    for field, value in message.ListFields():
        if field.message_type is None:
            continue
        # A field that repeats is a sequence; a single one is a message.
        for each in (value,) if isinstance(value, Message) else value:
            if isinstance(each, TensorProto):
                yield each
            else:
                yield from _tensors(each)


def _check(shapes: dict[str, Any], name: str, size: int, what: str) -> None:
    if name not in shapes:
        raise ForeignPolicyError(f"{what} {name!r} is missing; there are {', '.join(sorted(shapes)) or 'none'}")
    shape = shapes[name]
    if len(shape) != 2 or (isinstance(shape[1], int) and shape[1] != size):
        raise ForeignPolicyError(
            f"{what} {name!r} is {_in_words(shape)}, and this robot, LiDAR and observation make it (n, {size}): "
            "choose the ones that the policy was trained with"
        )
    if isinstance(shape[0], int):
        raise ForeignPolicyError(
            f"{what} {name!r} is for {shape[0]} robots at a time: export it with a free first dimension"
        )


def _columns(shape: list[Any]) -> int:
    return shape[1] if len(shape) == 2 and isinstance(shape[1], int) else 0


def _in_words(shape: list[Any]) -> str:
    return f"({', '.join(str(each) for each in shape)})"


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:300]
