"""Worlds in which something moves: read as they are meant, or refused by name."""

import math
from pathlib import Path

import numpy as np
import pytest

from sim.arenas import Arena, Mover, build_arenas
from sim.arenas.drawing import draw
from sim.arenas.files import load_arena, read_arena, to_arena, to_document, write_own
from sim.config import ArenaConfig, ArenaFile, TaskConfig, Timed
from sim.engine.world import World
from sim.errors import ArenaFileError

WALL = """<model name="back_wall"><static>1</static>\\   <pose frame=>-10 0 .5 0 0 0</pose>
  <link name="box_link"><collision name='c'><geometry><box><size>.5 20 1</size></box></geometry>
  </collision></link></model>"""


def cylinder(name: str, plugin: str = "", radius: float = 0.5, pose: str = "-0.225 0.075 0 0 0 0") -> str:
    return f"""<model name='{name}'><static>1</static><pose frame=''>{pose}</pose><link name='link'><collision name='c'>
      <geometry><cylinder><radius>{radius}</radius><length> 1 </length></cylinder></geometry></collision></link>
      {plugin}</model>"""


def plugin(name: str) -> str:
    return f"<plugin name='{name}' filename='{name}.so'/>"


def world(*parts: str) -> bytes:
    return f"<?xml version='1.0'?><sdf version='1.6'><world name='default'>{''.join(parts)}</world></sdf>".encode()


def keyframes(models: str, more: str = "") -> bytes:
    return f"format: mapless-keyframes/1\n{more}\nmodels: {models}\n".encode()


LINE = "{keyframes: [{t: 0, x: 0, y: 0}, {t: 1, x: 1, y: 0}]}"

# A plugin as the generator of DynaBARN's worlds writes them: over 4 s from (-6, 0) by (0, 4) to (6, 0), again and again.
SOURCE = b"""
#include <gazebo/gazebo.hh>
namespace gazebo { class obs_7 : public ModelPlugin { public: void Load(physics::ModelPtr _parent, sdf::ElementPtr) {
  gazebo::common::PoseAnimationPtr anim(new gazebo::common::PoseAnimation("obs_7", 4.00, true));
  gazebo::common::PoseKeyFrame *key;
  key = anim->CreateKeyFrame(0.00);
  key->Translation(ignition::math::Vector3d(-6.00, 0.00, 0));
  key->Rotation(ignition::math::Quaterniond(0, 0, 0));
  key = anim->CreateKeyFrame(2.00);
  key->Translation(ignition::math::Vector3d(0.00, 4.00, 0));
  key->Rotation(ignition::math::Quaterniond(0, 0, 0));
  key = anim->CreateKeyFrame(4.00);
  key->Translation(ignition::math::Vector3d(6.00, 0.00, 0));
  key->Rotation(ignition::math::Quaterniond(0, 0, 0));
  _parent->SetAnimation(anim);
} }; GZ_REGISTER_MODEL_PLUGIN(obs_7) }
"""


def ways(document: ArenaFile) -> list[list[tuple[float, float, float]]]:
    """The keyframes of timed movers, in the arena's frame."""
    return [[(f.t, f.x, f.y) for f in mover.keyframes] for mover in document.movers if isinstance(mover, Timed)]


def test_a_dynabarn_world_is_read_with_its_plugins_sources() -> None:
    files = {"world_3.world": world(WALL, cylinder("obs_7", plugin("obs_7"))), "obs_7.cc": SOURCE}
    document = read_arena(files)
    assert document.circles == ()  # it is nowhere else than where it goes
    (wall,) = document.boxes
    # From the wall's back at -10.25 to 6.5, from -10 to 10, and a metre around: the middle is (-1.875, 0).
    assert (document.width, document.height) == (18.75, 22.0)
    assert (wall.x, wall.y) == (-8.125, 0.0)
    assert ways(document) == [[(0.0, -4.125, 0.0), (2.0, 1.875, 4.0), (4.0, 7.875, 0.0)]]
    (mover,) = document.movers
    assert (mover.kind, mover.radius) == ("timed", 0.5)


def test_keyframes_beside_a_world_may_bring_its_start_and_target() -> None:
    way = "{obs_7: {keyframes: [{t: 0, x: -6, y: 0}, {t: 2, x: 0, y: 4}, {t: 4, x: 6, y: 0}], loops: true}}"
    scenario = "start: {x: -8.0, y: -8.0, heading: 45.0}\ntarget: {x: 4.0, y: 8.0}"
    for name in ("model", "obs_7"):
        body = world(WALL, cylinder(name, plugin("obs_7") if name == "model" else ""))
        document = read_arena({"w.world": body, "w.keyframes.yaml": keyframes(way, scenario)})
        by_source = read_arena({"w.world": world(WALL, cylinder("obs_7", plugin("obs_7"))), "obs_7.cc": SOURCE})
        assert ways(document) == ways(by_source)
        assert document.start is not None
        assert document.target is not None
        assert (document.start.x, document.start.y, document.start.heading) == (-6.125, -8.0, 45.0)
        assert (document.target.x, document.target.y) == (5.875, 8.0)


def actor(script: str, pose: str = "0 0 1 0 0 0", more: str = "") -> str:
    return f"<actor name='ann'><pose>{pose}</pose><skin/>{more}<script>{script}</script></actor>"


WALK = """<trajectory id='0' type='walking'>
  <waypoint><time>0</time><pose>0 2 0 0 0 0</pose></waypoint>
  <waypoint><time>2.5</time><pose>0 -2 0 0 0 -1.57</pose></waypoint>
  <waypoint><time>6</time><pose>3 -2 0 0 0 0</pose></waypoint></trajectory>"""


def test_an_actor_is_a_person_on_its_trajectory() -> None:
    document = read_arena({"w.sdf": world(WALL, actor(f"<loop>false</loop><delay_start>1.5</delay_start>{WALK}"))})
    (mover,) = document.movers
    assert isinstance(mover, Timed)
    assert (mover.radius, mover.loops) == (0.25, False)
    # The origin is the middle of x from -11.25 to 4.25.
    assert ways(document) == [[(0.0, 3.5, 2.0), (1.5, 3.5, 2.0), (4.0, 3.5, -2.0), (7.5, 6.5, -2.0)]]


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        (cylinder("obs_3", plugin("obs_3")), r"model 'obs_3': the plugin 'obs_3' \(obs_3.so\) moves it"),
        (cylinder("nested", f"<model name='inner'>{plugin('x')}</model>"), "the plugin 'x'"),
        ("<plugin name='mover' filename='libmove_everything.so'/>", "the world's plugin 'mover'"),
        (actor(WALK, more=plugin("crowd")), "actor 'ann': a plugin moves it"),
        (actor("<loop>true</loop>"), "actor 'ann': expected one <trajectory>, and found 0"),
        (actor(WALK + WALK), "found 2"),
        (actor(WALK, pose="1 0 1 0 0 0"), "a place of its own"),
        (actor(f"<auto_start>false</auto_start>{WALK}"), "does not start by itself"),
        (actor(WALK.replace("2.5", "0.5")), "8.0 m/s after 0 s"),
        (actor(WALK.replace("<time>6", "<time>1")), "in order of time"),
        (actor(WALK.replace("2.5", "soon")), "a number of seconds"),
        ("<population name='p'/>", "<population> is not read"),
    ],
)
def test_what_cannot_be_read_is_refused_by_name(parts: str, reason: str) -> None:
    with pytest.raises(ArenaFileError, match=reason):
        read_arena({"w.world": world(WALL, parts)})


@pytest.mark.parametrize(
    ("file", "content", "reason"),
    [
        ("w.keyframes.yaml", keyframes(f"{{obs_7: {LINE}, nobody: {LINE}}}"), "'nobody'"),
        ("w.keyframes.yaml", keyframes("{obs_7: {keyframes: [{t: 0, x: 0, y: 0}]}}"), "at least 2"),
        ("w.keyframes.yaml", b"obs_7: []", "only keyframes are read"),
        ("obs_7.cc", b"int main() {}", "only sets keyframes"),
        ("obs_7.cc", SOURCE.replace(b"Vector3d(0.00, 4.00, 0)", b"Vector3d(f(t), 4.00, 0)"), "only sets keyframes"),
        ("obs_7.cc", SOURCE.replace(b"4.00, true", b"3.00, true"), "lasts 3 s"),
    ],
)
def test_files_beside_a_world_that_say_something_else_are_refused(file: str, content: bytes, reason: str) -> None:
    with pytest.raises(ArenaFileError, match=reason):
        read_arena({"w.world": world(WALL, cylinder("obs_7", plugin("obs_7"))), file: content})


def test_a_moving_box_is_refused() -> None:
    body = world(WALL.replace("back_wall", "obs_7"))
    with pytest.raises(ArenaFileError, match="only cylinders and spheres"):
        read_arena({"w.world": body, "obs_7.cc": SOURCE})


def test_a_worlds_harmless_plugins_and_a_robots_sensors_are_left_out() -> None:
    sensor = f"<model name='s'><link name='l'><sensor name='c' type='ray'>{plugin('camera')}</sensor></link></model>"
    still = "<plugin name='p' filename='gz-sim-physics-system'/><plugin name='r' filename='libgazebo_ros_init.so'/>"
    assert len(read_arena({"w.world": world(WALL, sensor, still, f"<gui>{plugin('g')}</gui>")}).boxes) == 1


def test_on_disk_a_world_finds_what_moves_in_it_beside_it(tmp_path: Path) -> None:
    (tmp_path / "w.world").write_bytes(world(WALL, cylinder("obs_7", plugin("obs_7"))))
    with pytest.raises(ArenaFileError, match="obs_7"):
        load_arena(tmp_path / "w.world")
    (tmp_path / "obs_7.cc").write_bytes(SOURCE)
    assert len(load_arena(tmp_path / "w.world").movers) == 1
    (tmp_path / "obs_7.cc").unlink()
    (tmp_path / "w.keyframes.yaml").write_bytes(keyframes(f"{{obs_7: {LINE}}}"))
    assert len(load_arena(tmp_path / "w.world").movers) == 1


def test_what_is_timed_is_written_and_read_back() -> None:
    document = read_arena({"w.world": world(WALL, cylinder("obs_7", plugin("obs_7"))), "obs_7.cc": SOURCE})
    assert read_arena({"again.yaml": write_own(document).encode()}) == document
    assert to_document(to_arena(document)).movers == document.movers


def driven(mover: Mover, steps: int, period: float = 0.2) -> np.ndarray:
    """x, y, and the way of each step, (steps, 4), of one mover in an empty hall."""
    arena = Arena("hall", 8.0, 8.0, movers=(mover,))
    world = World(TaskConfig(control_period=period), (arena,), 1, seed=0)
    world.reset(poses=(-7.0, -7.0, 0.0), targets=(7.0, 7.0))
    found = []
    for _ in range(steps):
        world.step(np.zeros((1, 2), dtype=np.float32))
        found.append(world.movers.discs[0, 0, [0, 1, 3, 4]].astype(float))
        body = list(world._space.space.bodies)[1].position
        assert tuple(body) == pytest.approx((found[-1][0], found[-1][1]), abs=1e-5)
    return np.array(found)


def test_a_timed_mover_is_where_its_keyframes_say() -> None:
    # 2 s to the right, 1 s of rest, 1 s up; then from the start again, which is elsewhere: it jumps there.
    mover = Mover("timed", 0.2, 2.0, ((0.0, 0.0), (2.0, 0.0), (2.0, 0.0), (2.0, 2.0)), (0.0, 2.0, 3.0, 4.0))
    found = driven(mover, 45)
    times = 0.2 * np.arange(1, 46) % 4.0
    x = np.interp(times, mover.times, [0.0, 2.0, 2.0, 2.0])
    y = np.interp(times, mover.times, [0.0, 0.0, 0.0, 2.0])
    # At the end of a round rounding decides whether it is there still, or back.
    clear = np.minimum(times, 4.0 - times) > 1e-6
    assert found[clear, 0] == pytest.approx(x[clear], abs=1e-5)
    assert found[clear, 1] == pytest.approx(y[clear], abs=1e-5)
    assert np.hypot(found[:, 2], found[:, 3]).max() <= 0.4 + 1e-5  # no way of a step is the jump's
    assert mover.fastest == 2.0


def test_a_timed_mover_that_does_not_loop_stays_at_its_end() -> None:
    mover = Mover("timed", 0.2, 1.0, ((0.0, 0.0), (1.0, 1.0)), (0.0, math.sqrt(2.0)), loops=False)
    found = driven(mover, 20)
    assert found[7:, :2] == pytest.approx(np.ones((13, 2)))
    assert not found[8:, 2:].any()


def test_a_robot_in_the_way_of_a_timed_mover_is_hit() -> None:
    mover = Mover("timed", 0.2, 4.0, ((-4.0, 0.0), (4.0, 0.0)), (0.0, 2.0))
    world = World(TaskConfig(collision_distance=0.0), (Arena("hall", movers=(mover,)),), 1, seed=0)
    world.reset(poses=(0.1, 0.0, 0.0), targets=(3.0, 3.0))
    outcomes = []
    for _ in range(6):
        world.step(np.zeros((1, 2), dtype=np.float32))
        outcomes.append(int(world.robots.outcomes[0]))
    # 0.8 m a step: from -0.8 to 0 in the fifth, and the robot's near side is at -0.005.
    assert outcomes[:5] == [0, 0, 0, 0, 2]


def test_a_drawing_shows_what_was_understood() -> None:
    scenario = "start: {x: -8.0, y: -8.0}\ntarget: {x: 4.0, y: 8.0}"
    way = "{obs_7: {keyframes: [{t: 0, x: -6, y: 0}, {t: 2, x: 0, y: 4}, {t: 4, x: 6, y: 0}]}}"
    files = {"w.world": world(WALL, cylinder("obs_7", plugin("obs_7"))), "w.keyframes.yaml": keyframes(way, scenario)}
    *picture, legend = draw(read_arena(files)).splitlines()
    assert legend == "# obstacle, o way of what moves, O where it starts, S start, T target"
    # 18.75 x 22 m in 36 rows, so 61 columns: a character is 0.31 x 0.61 m.
    assert len(picture) == 38
    assert {len(line) for line in picture} == {63}
    inside = [line[1:-1] for line in picture[1:-1]]
    (wall,) = {line.index("#") for line in inside if "#" in line}
    assert wall == round((0.5 - 8.125 / 18.75) * 61 - 1)
    assert abs(sum("#" in line for line in inside) - 20.0 / 22.0 * 36) < 1.5  # the ends stand within a row
    assert inside[18].index("O") == int((0.5 - 4.125 / 18.75) * 61)
    assert inside[int((0.5 - 4.0 / 22.0) * 36)][int((0.5 + 1.875 / 18.75) * 61)] == "o"
    assert inside[int((0.5 + 8.0 / 22.0) * 36)].index("S") == int((0.5 - 6.125 / 18.75) * 61)
    assert inside[int((0.5 - 8.0 / 22.0) * 36)].index("T") == int((0.5 + 5.875 / 18.75) * 61)


@pytest.mark.parametrize("name", ["simple", "complex"])
def test_any_arena_can_be_drawn(name: str) -> None:
    lines = draw(to_document(build_arenas(ArenaConfig.model_validate({"name": name}))[0])).splitlines()
    assert ("# obstacle" in lines[-1]) == (name == "complex")
