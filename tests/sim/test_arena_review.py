"""What is said about an arena while it is drawn."""

import time
from typing import Any

import pytest

from sim.arenas.review import MAX_REMARKS, review
from sim.config import ArenaFile


def drawn(**parts: Any) -> ArenaFile:
    return ArenaFile.model_validate({"name": "Drawn", "width": 6.0, "height": 6.0, **parts})


def said(**parts: Any) -> list[str]:
    return [remark.text for remark in review(drawn(**parts)).remarks]


# From wall to wall along the y axis, but for a door of that width in the middle.
def wall(door: float) -> list[dict[str, float]]:
    length = 0.5 * (6.0 - door)
    return [{"x": 0.0, "y": side * (3.0 - 0.5 * length), "length": 0.2, "width": length} for side in (-1, 1)]


ENDS = {"start": {"x": -2.0, "y": 0.0}, "target": {"x": 2.0, "y": 0.0}}


def test_an_arena_in_which_all_is_well_has_no_remarks() -> None:
    found = review(drawn(boxes=wall(1.0), **ENDS))
    assert found.remarks == ()
    # Of 36 square metres less the wall, what is left of a border of 0.2 m.
    assert 25.0 < found.free_area < 32.0


def test_a_door_that_is_too_narrow_closes_off_a_room_and_leaves_the_target_out_of_reach() -> None:
    found = review(drawn(boxes=wall(0.35), **ENDS)).remarks
    assert [remark.text.split(":")[0] for remark in found] == [
        "13.7 m² are closed off",
        "There is no way from the start to the target that keeps 0.2 m clear",
    ]
    assert not any(remark.refused for remark in found)
    assert abs(found[0].x) > 0.2, "the mark stands in the part that is closed off"
    # A smaller robot passes, a larger one does not pass the wider door either.
    assert review(drawn(boxes=wall(0.35), **ENDS), clearance=0.1).remarks == ()
    assert len(review(drawn(boxes=wall(1.0), **ENDS), clearance=0.6).remarks) == 2


def test_a_start_and_a_target_need_room_and_one_another() -> None:
    assert said(start={"x": 2.9, "y": 0.0}, target={"x": 0.0, "y": 0.0}) == [
        "The start is 0.10 m from an obstacle or a wall, and a robot needs 0.2 m: this scenario is left out."
    ]
    assert said(circles=[{"x": 1.0, "y": 1.0, "radius": 0.5}], **ENDS | {"target": {"x": 1.0, "y": 1.0}}) == [
        "The target is in an obstacle or a wall, and a robot needs 0.2 m: this scenario is left out."
    ]
    assert said(target={"x": 1.0, "y": 1.0}) == ["The target is not used without a start: place both, or neither."]


def test_what_the_gallery_would_refuse_comes_first_and_is_marked() -> None:
    (full,) = review(drawn(boxes=[{"x": 0.0, "y": 0.0, "length": 5.6, "width": 5.6}])).remarks
    assert full.refused
    assert full.text.endswith("0.0 m² in one piece and needs 1: make room for it.")
    round_ = [{"x": -2.0, "y": 0.0}, {"x": 2.0, "y": 0.0}]
    blocked, unused = review(
        drawn(
            boxes=[{"x": 0.0, "y": 0.0, "length": 0.5, "width": 0.5}],
            movers=[{"kind": "patrol", "waypoints": round_}],
            start={"x": -2.0, "y": 2.0},
        )
    ).remarks
    assert (blocked.refused, unused.refused) == (True, False)
    assert blocked.text == f"Mover 1 does not get past ({blocked.x:.2f}, 0.00) on its round: move its corners."
    assert blocked.x == pytest.approx(-0.5, abs=0.03)


def test_people_need_room_where_they_begin_and_where_they_turn() -> None:
    disc = {"x": 0.0, "y": 0.0, "radius": 0.5}
    way = [{"x": 0.0, "y": 0.0}, {"x": 2.0, "y": 0.0}]
    person = {"kind": "pedestrian", "waypoints": way}
    assert said(circles=[disc], movers=[person]) == ["Mover 1 has no room where it begins: it is left out."]
    assert said(circles=[disc], movers=[person | {"waypoints": way[::-1]}]) == [
        "Mover 1 never reaches corner 2 of its way: no room."
    ]
    assert said(movers=[person, person]) == ["Mover 1 and Mover 2 begin in the same place: one of them may be left out."]
    leaf = {"kind": "timed", "keyframes": [{"t": 0.0, "x": 0.0, "y": 0.0}, {"t": 1.0, "x": 1.0, "y": 0.0}]}
    assert said(movers=[leaf, leaf]) == []


def test_what_does_nothing_is_named() -> None:
    assert said(
        circles=[{"x": 0.0, "y": 0.0, "radius": 1.0}, {"x": 9.0, "y": 0.0, "radius": 0.5}],
        boxes=[{"x": 0.2, "y": 0.0, "length": 0.5, "width": 0.5, "angle": 30.0}],
    ) == ["Disc 2 stands outside the walls: it does nothing.", "Box 1 stands within disc 1: it does nothing."]
    # Of two alike, one is of use.
    assert len(said(circles=[{"x": 0.0, "y": 0.0, "radius": 1.0}] * 2)) == 1
    # What joins at a corner is no mistake.
    assert said(boxes=[*wall(1.0), {"x": 1.0, "y": 2.0, "length": 2.1, "width": 0.2}]) == []


def test_the_largest_arena_takes_a_moment_and_few_remarks() -> None:
    beyond = [{"x": 99.0, "y": 99.0, "radius": 0.3}] * 1000
    pillars = [{"x": -45.0 + 3 * (n % 30), "y": -45.0 + 3 * (n // 30), "radius": 0.5} for n in range(1000)]
    began = time.perf_counter()
    found = review(drawn(width=100.0, height=100.0, circles=pillars + beyond))
    assert len(found.remarks) == MAX_REMARKS
    assert time.perf_counter() - began < 10.0
