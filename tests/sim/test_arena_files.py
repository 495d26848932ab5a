"""Arena files: our own format, ROS maps and Gazebo worlds, read as they are meant."""

import json
import math
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from sim.arenas import Arena, Mover, build_arenas, free_distance
from sim.arenas.families import FAMILIES, generate_arena
from sim.arenas.files import load_arena, read_arena, to_arena, to_document, write_own
from sim.arenas.planner import shortest_path
from sim.config import ArenaFile, ImportedArenaConfig, TaskConfig
from sim.errors import ArenaError, ArenaFileError

OWN = """
format: mapless-arena/1
name: Lab
width: 8
height: 6.0
circles:
  - {x: 1.0, y: 0.5, radius: 0.3}
boxes:
  - {x: -2.0, y: 0.0, length: 2.0, width: 0.5, angle: 90.0}
start: {x: -3.5, y: -2.5, heading: 45.0}
target: {x: 3.5, y: 2.5}
"""


def png(pixels: np.ndarray) -> bytes:
    buffer = BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def pgm(pixels: np.ndarray) -> bytes:
    rows, columns = pixels.shape
    return f"P5\n# made by hand\n{columns} {rows}\n255\n".encode() + pixels.astype(np.uint8).tobytes()


def map_yaml(image: str, **changes: object) -> bytes:
    fields = {"image": image, "resolution": 0.2, "origin": [-1.0, -1.0, 0.0], "negate": 0}
    fields |= {"occupied_thresh": 0.65, "free_thresh": 0.196}
    return json.dumps(fields | changes).encode()


def cylinder(name: str, x: float, y: float, radius: float = 0.075) -> str:
    return f"""
    <model name='{name}'><static>1</static><pose frame=''>{x} {y} 0 0 0 0</pose>
      <link name='link'><collision name='c'><geometry><cylinder><radius>{radius}</radius><length>1</length></cylinder>
      </geometry></collision></link></model>"""


def world(*models: str) -> bytes:
    return f"<sdf version='1.6'><world name='default'>{''.join(models)}</world></sdf>".encode()


def test_our_own_format_says_where_everything_is() -> None:
    arena = to_arena(read_arena({"lab.yaml": OWN.encode()}))
    assert (arena.half_width, arena.half_height) == (4.0, 3.0)
    assert arena.circles.tolist() == [[1.0, 0.5, 0.3]]
    assert arena.boxes.tolist() == [[-2.0, 0.0, 1.0, 0.25, math.pi / 2.0]]
    # The box stands upright: half a metre to its long side's left lies free, half a metre above its middle does not.
    assert free_distance(arena, [[-2.5, 0.0], [-2.0, 0.5]]).round(6).tolist() == [0.25, -0.25]


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(sorted(FAMILIES)), st.floats(0.0, 1.0), st.integers(0, 1000))
def test_what_is_written_is_read_back(family: str, difficulty: float, seed: int) -> None:
    arena = generate_arena(family, difficulty, seed)  # type: ignore[arg-type]
    document = to_document(arena)
    again = read_arena({"arena.yaml": write_own(document).encode()})
    assert again == document
    assert again.sha256 == document.sha256
    np.testing.assert_allclose(to_arena(again).circles, arena.circles, atol=1e-4)
    points = np.random.default_rng(seed).uniform(-5.0, 5.0, (200, 2))
    np.testing.assert_allclose(free_distance(to_arena(again), points), free_distance(arena, points), atol=1e-3)


def test_the_name_may_start_with_anything_and_does_not_change_the_hash() -> None:
    document = read_arena({"lab.yaml": OWN.encode()})
    for name in ("- yes", "null", "Café: 'A & B' #1", "1.5", "机器人"):
        renamed = document.model_copy(update={"name": name})
        assert read_arena({"x.yaml": write_own(renamed).encode()}).name == name
        assert renamed.sha256 == document.sha256
    assert document.model_copy(update={"width": 8.1}).sha256 != document.sha256


MOVERS = """
movers:
  - {kind: patrol, radius: 0.2, speed: 0.8, waypoints: [{x: 3.0, y: -2.0}, {x: 3.0, y: 2.0}]}
  - {kind: walker}
  - {kind: pedestrian, radius: 0.3, speed: 1.5}
"""


def test_what_moves_is_read_written_and_part_of_the_hash() -> None:
    document = read_arena({"lab.yaml": (OWN + MOVERS).encode()})
    assert to_arena(document).movers == (
        Mover("patrol", 0.2, 0.8, ((3.0, -2.0), (3.0, 2.0))),
        Mover("walker", 0.25, 1.0),
        Mover("pedestrian", 0.3, 1.5),
    )
    assert read_arena({"again.yaml": write_own(document).encode()}) == document
    assert to_document(to_arena(document)).movers == document.movers
    still = read_arena({"lab.yaml": OWN.encode()})
    assert document.sha256 != still.sha256
    assert "movers" not in write_own(still)


def test_an_arena_in_which_nothing_moves_keeps_its_hash() -> None:
    document = read_arena({"lab.yaml": OWN.encode()})
    assert document.sha256 == "4e0b08252f028fa4c3ac3ecb8722fa4246b565dfd374043ed0abc64b267475ae"


@pytest.mark.parametrize(
    ("mover", "reason"),
    [
        ("{kind: patrol, waypoints: [{x: -3.0, y: 0.0}, {x: 3.0, y: 0.0}]}", r"does not get past \(-2\."),
        ("{kind: patrol, waypoints: [{x: -3.0, y: 1.5}, {x: -3.0, y: 2.9}]}", "does not get past"),
        ("{kind: patrol, waypoints: [{x: 3.0, y: 0.0}]}", "two waypoints or more"),
        ("{kind: walker, speed: 1.6}", "less than or equal to 1.5"),
        ("{kind: ghost}", "patrol"),
    ],
)
def test_movers_that_cannot_be_are_refused(mover: str, reason: str) -> None:
    with pytest.raises(ArenaFileError, match=reason):
        read_arena({"lab.yaml": f"{OWN}movers: [{mover}]".encode()})


def test_the_documented_schema_is_that_of_the_model() -> None:
    documented = Path(__file__).parents[2] / "docs" / "arena.schema.json"
    assert json.loads(documented.read_text()) == ArenaFile.model_json_schema()


# A room of 3.2 x 2.4 m at 0.2 m a pixel: white is free, black a wall, grey unknown; a block of 3 x 2 pixels inside.
ROOM = np.full((16, 24), 205, dtype=np.uint8)
ROOM[1:15, 3:21] = 0
ROOM[2:14, 4:20] = 254
ROOM[4:7, 6:8] = 0
ROOM[15, 23] = 254  # a stray free pixel outside, as the laser leaves them


@pytest.mark.parametrize(("name", "encode"), [("room.pgm", pgm), ("room.png", png)])
def test_a_ros_map_is_its_free_room_with_every_edge_on_the_pixel(name: str, encode: object) -> None:
    document = read_arena({"room.yaml": map_yaml(name), name: encode(ROOM)})  # type: ignore[operator]
    assert (document.width, document.height) == (3.2, 2.4)
    # Image row 4 is the third from the top of the room, so y = 1.2 - 0.4 - 0.3; columns 6 and 7 are its third and fourth.
    (box,) = document.boxes
    assert (box.x, box.y, box.length, box.width, box.angle) == (-1.0, 0.5, 0.4, 0.6, 0.0)
    assert document.name == "room"


def test_a_negated_map_and_a_deep_image_are_the_same_room() -> None:
    expected = read_arena({"room.yaml": map_yaml("room.png"), "room.png": png(ROOM)})
    assert read_arena({"room.yaml": map_yaml("room.png", negate=1), "room.png": png(255 - ROOM)}) == expected
    deep = ROOM.astype(np.uint16) * 257
    assert read_arena({"room.yaml": map_yaml("room.png"), "room.png": png(deep)}) == expected
    colours = np.repeat(ROOM[:, :, None], 3, axis=2)
    assert read_arena({"room.yaml": map_yaml("room.png"), "room.png": png(colours)}) == expected


def test_thresholds_decide_what_is_free_and_scale_what_is_likely() -> None:
    hall = np.full((20, 20), 255, dtype=np.uint8)
    hall[8:12, 8:12] = 153  # occupancy 0.4
    boxes = {
        (mode, free): len(read_arena({"m.yaml": map_yaml("m.pgm", mode=mode, free_thresh=free), "m.pgm": pgm(hall)}).boxes)
        for mode in ("trinary", "scale")
        for free in (0.1, 0.45)
    }
    # Trinary: between the thresholds is unknown, an obstacle. Scale: (0.4 - 0.1) / 0.55 is over a half, below 0.45 is free.
    assert boxes == {("trinary", 0.1): 1, ("trinary", 0.45): 0, ("scale", 0.1): 1, ("scale", 0.45): 0}
    likely = np.where(hall == 153, 178, 255).astype(np.uint8)  # occupancy 0.3: less than half-way
    assert read_arena({"m.yaml": map_yaml("m.pgm", mode="scale", free_thresh=0.1), "m.pgm": pgm(likely)}).boxes == ()
    clear = np.dstack([hall, np.where(hall == 153, 0, 255).astype(np.uint8)])
    clear[:, :, 0] = 255
    assert len(read_arena({"m.yaml": map_yaml("m.png", mode="scale"), "m.png": png(clear)}).boxes) == 1


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32))
def test_a_map_keeps_every_pixel_of_its_free_room(seed: int) -> None:
    random = np.random.default_rng(seed)
    pixels = np.full((40, 50), 254, dtype=np.uint8)
    for row, column in random.integers(0, 35, (12, 2)):
        pixels[row : row + random.integers(1, 6), column : column + random.integers(1, 6)] = 0
    pixels[[0, -1]], pixels[:, [0, -1]] = 254, 254
    arena = to_arena(read_arena({"m.yaml": map_yaml("m.pgm"), "m.pgm": pgm(pixels)}))
    centres = np.stack(np.meshgrid((np.arange(50) - 24.5) * 0.2, (19.5 - np.arange(40)) * 0.2), axis=-1)
    inside = free_distance(arena, centres) > 0.0
    # Obstacle pixels that touch no free one may stay empty: nobody can see or reach them.
    padded = np.pad(pixels == 254, 1)
    reachable = np.any([padded[i : i + 40, j : j + 50] for i in range(3) for j in range(3)], axis=0)
    assert (inside == (pixels == 254))[reachable].all()


def test_a_gazebo_world_is_its_collision_shapes_seen_from_above() -> None:
    box = """<model name='shelf'><pose>2 1 0 0 0 0</pose><link name='l'><pose>0 1 0.5 0 0 1.5707963267948966</pose>
      <collision name='c'><pose>1 0 0 0 0 0</pose><geometry><box><size>2 0.5 1</size></box></geometry></collision>
      <visual name='v'><geometry><mesh><uri>shelf.dae</uri></mesh></geometry></visual></link></model>"""
    floor = """<model name='floor'><link name='l'><collision name='c'><pose>0 0 -0.05 0 0 0</pose>
      <geometry><box><size>90 90 0.1</size></box></geometry></collision></link></model>"""
    sun = "<include><uri>model://sun</uri></include>"
    document = read_arena({"hall.world": world(sun, floor, cylinder("pillar", -2.0, 0.0, 0.5), box)})
    # The shelf's middle: the link's (2, 2) and a metre along its own x axis, which points up: (2, 3), turned by 90 degrees.
    # Around both: x from -2.5 to 2.25, y from -0.5 to 4, and a metre on every side.
    assert (document.width, document.height) == pytest.approx((6.75, 6.5))
    (circle,), (shelf,) = document.circles, document.boxes
    assert (circle.x, circle.y, circle.radius) == pytest.approx((-1.875, -1.75, 0.5))
    assert (shelf.x, shelf.y, shelf.length, shelf.width, shelf.angle) == pytest.approx((2.125, 1.25, 2.0, 0.5, 90.0))


def test_a_barn_world_comes_with_its_start_its_goal_and_no_way_round() -> None:
    sides = [cylinder(f"s{x}{i}", x, 0.075 + 0.15 * i) for i in range(64) for x in (-4.425, -0.075)]
    end = [cylinder(f"e{i}", -0.225 - 0.15 * i, 0.075) for i in range(28)]
    obstacle = [cylinder("one", -2.25, 7.0)]
    document = read_arena({"world_7.world": world(*sides, *end, *obstacle)})
    assert len(document.circles) == 64 * 2 + 28 + 1
    assert (document.width, document.height) == pytest.approx((4.5, 14.0))
    assert document.start is not None
    assert document.target is not None
    assert (document.start.x, document.start.y, document.start.heading) == pytest.approx((0.0, -4.0, 90.0))
    assert (document.target.x, document.target.y) == pytest.approx((0.0, 6.0))
    arena = to_arena(document)
    length = shortest_path(arena, (0.0, -4.0), (0.0, 6.0), 0.2).length
    assert 10.0 < length < 10.1


def test_a_task_carries_an_imported_arena_and_checks_that_it_is_the_one_it_names() -> None:
    document = read_arena({"lab.yaml": OWN.encode()})
    task = TaskConfig(arena=ImportedArenaConfig.of(document))
    again = TaskConfig.model_validate_json(task.model_dump_json())
    assert again == task
    (arena,) = build_arenas(again.arena)
    assert isinstance(arena, Arena)
    assert arena.name == "Lab"
    with pytest.raises(ValueError, match="hash"):
        ImportedArenaConfig(sha256="0" * 64, arena=document)
    with pytest.raises(ArenaError, match="load_arena"):
        build_arenas(ImportedArenaConfig(sha256=document.sha256))


def test_on_disk_a_map_finds_its_image_beside_it(tmp_path: Path) -> None:
    (tmp_path / "room.yaml").write_bytes(map_yaml("room.pgm"))
    (tmp_path / "room.pgm").write_bytes(pgm(ROOM))
    assert load_arena(tmp_path / "room.yaml").width == 3.2
    assert load_arena(tmp_path / "room.yaml", tmp_path / "room.pgm").width == 3.2
    with pytest.raises(ArenaFileError, match="no such file"):
        load_arena(tmp_path / "other.yaml")
