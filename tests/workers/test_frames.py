"""A frame and its bytes: what goes in comes out, and nothing else is believed."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from workers.errors import FrameError
from workers.frames import Frame

HEADER_BYTES = 1 + 1 + 1 + 2 + 2 + 2 + 8 + 8 + 4


def floats(*shape: int) -> st.SearchStrategy[NDArray[np.float32]]:
    return hnp.arrays(np.float32, shape, elements=st.floats(-1e6, 1e6, width=32))


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    robots, rays = draw(st.integers(0, 5)), draw(st.integers(0, 7))
    return Frame(
        mode=draw(st.sampled_from(("training", "policy"))),
        step=draw(st.integers(0, 2**63)),
        sim_time=draw(st.floats(0, 1e9)),
        speed=draw(st.floats(0.125, 64.0, width=32)),
        poses=draw(floats(robots, 3)),
        targets=draw(floats(robots, 2)),
        ranges=draw(floats(robots, rays)),
        fields_of_view=draw(floats(robots)),
        rewards=draw(floats(robots)),
        outcomes=draw(hnp.arrays(np.uint8, (robots,), elements=st.integers(0, 3))),
        arena=draw(st.integers(0, 65_535)),
        movers=np.abs(draw(floats(draw(st.integers(0, 4)), 3))) + np.float32(0.1),
    )


def one_robot() -> Frame:
    return Frame(
        mode="policy",
        step=4096,
        sim_time=1.5,
        speed=2.0,
        poses=np.array([[1.0, 2.0, 0.5]], np.float32),
        targets=np.array([[3.0, 4.0]], np.float32),
        ranges=np.array([[0.5, 3.5]], np.float32),
        fields_of_view=np.array([180.0], np.float32),
        rewards=np.array([-7.0], np.float32),
        outcomes=np.array([2], np.uint8),
    )


@given(frames())
def test_what_is_encoded_is_decoded(frame: Frame) -> None:
    decoded = Frame.decode(frame.encode())
    for field in dataclasses.fields(Frame):
        np.testing.assert_array_equal(getattr(decoded, field.name), getattr(frame, field.name))


def test_a_frame_of_64_robots_takes_ten_kilobytes() -> None:
    robots, rays = 64, 30
    frame = dataclasses.replace(
        one_robot(),
        poses=np.zeros((robots, 3), np.float32),
        targets=np.zeros((robots, 2), np.float32),
        ranges=np.zeros((robots, rays), np.float32),
        fields_of_view=np.zeros(robots, np.float32),
        rewards=np.zeros(robots, np.float32),
        outcomes=np.zeros(robots, np.uint8),
    )
    assert len(frame.encode()) == HEADER_BYTES + 64 * (4 * (3 + 2 + 30 + 1 + 1) + 1) == 9565


@given(frames(), st.data())
def test_a_frame_cut_short_or_padded_is_refused(frame: Frame, data: st.DataObject) -> None:
    encoded = frame.encode()
    shorter = data.draw(st.integers(0, len(encoded) - 1))
    with pytest.raises(FrameError):
        Frame.decode(encoded[:shorter])
    with pytest.raises(FrameError):
        Frame.decode(encoded + b"\0")


@given(st.binary(max_size=200))
def test_any_bytes_are_a_frame_or_an_error(data: bytes) -> None:
    try:
        frame = Frame.decode(data)
    except FrameError:
        return
    assert frame.encode() == data


def test_a_header_that_promises_more_robots_than_come_is_refused() -> None:
    encoded = bytearray(one_robot().encode())
    encoded[3:5] = (65_535).to_bytes(2, "little")
    with pytest.raises(FrameError, match="length"):
        Frame.decode(bytes(encoded))


def test_a_frame_of_another_version_is_refused() -> None:
    encoded = bytearray(one_robot().encode())
    encoded[0] = 9
    with pytest.raises(FrameError, match="version 9"):
        Frame.decode(bytes(encoded))


def test_a_mover_without_a_size_is_refused() -> None:
    movers = np.array([[1.0, 2.0, 0.0]], np.float32)
    with pytest.raises(FrameError, match="mover"):
        Frame.decode(dataclasses.replace(one_robot(), movers=movers).encode())


@pytest.mark.parametrize("poison", [np.nan, np.inf, -np.inf])
def test_a_pose_that_is_no_number_is_refused(poison: float) -> None:
    frame = one_robot()
    with pytest.raises(FrameError, match="finite"):
        Frame.decode(dataclasses.replace(frame, poses=np.array([[poison, 0.0, 0.0]], np.float32)).encode())
    with pytest.raises(FrameError, match="finite"):
        Frame.decode(dataclasses.replace(frame, sim_time=poison).encode())
