"""Robots' recordings: read whoever wrote them, refused with a reason, and fits hold what the simulator was told."""

import contextlib
import io
import math
import tarfile
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType

from sim.config import TaskConfig
from tests.workers.robot_bags import Drive, as_db3, as_mcap, header, messages, simulated
from workers.bags.beside import _apart, beside, robots_policy
from workers.bags.motion import fit_motion
from workers.bags.read import read_bag
from workers.bags.reading import tell
from workers.bags.results import BagReading, Fitted, TopicChoice
from workers.bags.sensing import fit_sensing
from workers.errors import BagError
from workers.job_protocol import ShippedPolicyName
from workers.shipped.library import shipped_policy

PERIOD = 0.05
DELAY_STEPS = 3
TRUTH = {
    "lidar.noise": 0.01,
    "lidar.dropout": 0.03,
    "lidar.rate": 10.0,
    "command_delay": DELAY_STEPS * PERIOD,
    "robot.max_linear_acceleration": 0.5,
    "robot.max_angular_acceleration": 2.0,
}


def task(**more: Any) -> dict[str, Any]:
    """A robot and a LiDAR with `TRUTH`, or with what is told."""
    truth = {**TRUTH, **more}
    robot = {
        "name": "round",
        "radius": 0.1,
        "max_linear_speed": 0.5,
        "max_angular_speed": 1.5,
        "max_linear_acceleration": truth["robot.max_linear_acceleration"],
        "max_angular_acceleration": truth["robot.max_angular_acceleration"],
    }
    lidar = {"rays": 180, "field_of_view": 360.0, "range": 6.0, "rate": truth["lidar.rate"]}
    lidar |= {"noise": truth["lidar.noise"], "dropout": truth["lidar.dropout"]}
    return {
        "robot": robot,
        "lidar": lidar,
        "control_period": PERIOD,
        "command_delay": round(truth["command_delay"] / PERIOD),
        "collision_distance": 0.1,
    }


@pytest.fixture(scope="module")
def drive() -> Drive:
    return simulated(seed=3, jitter=0.002, speed_noise=0.01, **task())


def told(content: bytes, folder: Path, choice: TopicChoice | None = None) -> BagReading:
    path = folder / "upload"
    path.write_bytes(content)
    return tell(path, choice or TopicChoice(), folder)


def refused(content: bytes, folder: Path, choice: TopicChoice | None = None) -> str:
    with pytest.raises(BagError) as caught:
        told(content, folder, choice)
    return str(caught.value)


def holds(fitted: Fitted, truth: float) -> bool:
    return fitted.low is not None and fitted.low <= truth and (fitted.high is None or truth <= fitted.high)


# -- files ----------------------------------------------------------------------------------------------------------------


def test_every_kind_of_file_tells_the_same(drive: Drive, tmp_path: Path) -> None:
    plain = as_mcap(messages(drive), compression=CompressionType.NONE)
    expected = told(plain, tmp_path)
    assert expected.notes == ()
    assert [(topic.role, topic.name, topic.messages) for topic in expected.topics] == [
        ("scan", "/scan", 601),
        ("odometry", "/odom", 1201),
        ("commands", "/cmd_vel", 1200),
        ("goal", "/goal_pose", len(drive.goals)),
    ]
    as_db3(plain, tmp_path / "bag.db3")
    database = (tmp_path / "bag.db3").read_bytes()
    zipped, tarred = io.BytesIO(), io.BytesIO()
    with zipfile.ZipFile(zipped, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("drive/metadata.yaml", "rosbag2_bagfile_information: {}")
        archive.writestr("drive/drive_0.db3", database)
    with tarfile.open(fileobj=tarred, mode="w:gz") as tape:
        info = tarfile.TarInfo("drive/drive_0.mcap")
        info.size = len(plain)
        tape.addfile(info, io.BytesIO(plain))
    others = [
        as_mcap(messages(drive), compression=CompressionType.ZSTD),
        as_mcap(messages(drive), compression=CompressionType.LZ4),
        as_mcap(messages(drive, stamped=True)),
        database,
        zipped.getvalue(),
        tarred.getvalue(),
    ]
    for content in others:
        found = told(content, tmp_path)
        assert found.model_copy(update={"topics": expected.topics}) == expected


def test_what_rosbags_wrote_is_read(tmp_path: Path) -> None:
    # Six seconds of a robot that turns on the spot, by rosbags 0.11.9 (Ternaris), storage sqlite3 and mcap.
    for name in ("rosbags.db3", "rosbags.mcap"):
        content = (Path(__file__).parent / "bags" / name).read_bytes()
        found = told(content, tmp_path)
        assert [topic.messages for topic in found.topics] == [31, 31, 31, 1]
        assert found.lidar.beams == 8
        assert found.path[-1] == pytest.approx((1.0, 2.0, 3.0))
        assert found.goals == ((0.0, 4.0, 5.0),)
        assert set(found.turning) == {0.5}


def test_a_lidar_may_look_anywhere_and_hang_upside_down(drive: Drive, tmp_path: Path) -> None:
    straight = told(as_mcap(messages(drive)), tmp_path)
    for yaw, upside_down in ((math.pi, False), (1.0, False), (0.0, True), (-2.0, True)):
        turned = told(as_mcap(messages(drive, yaw=yaw, upside_down=upside_down)), tmp_path)
        # Points on the edge of a square of 5 cm may be drawn in the next.
        moved = len(set(turned.points) ^ set(straight.points))
        assert moved < 0.02 * len(straight.points)


def test_a_robot_that_is_switched_off_leaves_what_came_before(drive: Drive, tmp_path: Path) -> None:
    whole = as_mcap(messages(drive))
    found = told(whole[: len(whole) // 2], tmp_path)
    assert 20.0 < found.seconds < 40.0
    assert found.notes == ("The recording ends in the middle of a message: what came before is read.",)


def test_what_is_no_recording_is_refused_with_what_to_do(drive: Drive, tmp_path: Path) -> None:
    assert "choose an .mcap file" in refused(b"not at all", tmp_path)
    assert "ROS 1 bag: convert it" in refused(b"#ROSBAG V2.0\n", tmp_path)
    assert "decompress it first" in refused(b"\x28\xb5\x2f\xfd....", tmp_path)
    empty = io.BytesIO()
    with zipfile.ZipFile(empty, "w") as archive:
        archive.writestr("photo.jpg", b"")
    assert "no .mcap or .db3 file is in the archive" in refused(empty.getvalue(), tmp_path)
    assert "can't be unpacked" in refused(empty.getvalue()[:20], tmp_path)
    whole = as_mcap(messages(drive))
    damaged = bytearray(whole)
    damaged[2_000:2_400] = bytes(range(200)) * 2
    assert refused(bytes(damaged), tmp_path).startswith("the recording is damaged")
    without = [sent for sent in messages(drive) if sent[0] != "/odom"]
    assert refused(as_mcap(without), tmp_path).startswith(
        "no odometry with messages are in the recording (nav_msgs/msg/Odometry); there are /chatter (std_msgs/msg/String), "
    )
    assert refused(whole, tmp_path, TopicChoice(scan="/front")) == "no scans are on /front: choose another topic"


def test_an_archive_that_unpacks_to_more_than_may_be_is_refused(tmp_path: Path) -> None:
    large = io.BytesIO()
    with zipfile.ZipFile(large, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("bag/x.db3", "w") as file:
        for _ in range(257):
            file.write(bytes(2**20))
    assert "larger than 256 MiB once unpacked" in refused(large.getvalue(), tmp_path)


def packed(packing: int) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", packing) as archive:
        archive.writestr("bag/x.db3", b"SQLite format 3\0" * 20)
    return file.getvalue()


def taped() -> bytes:
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w:gz") as tape:
        info = tarfile.TarInfo("bag/x.db3")
        info.size = 320
        tape.addfile(info, io.BytesIO(b"SQLite format 3\0" * 20))
    return file.getvalue()


ARCHIVES = {
    "deflate": packed(zipfile.ZIP_DEFLATED),
    "bzip2": packed(zipfile.ZIP_BZIP2),
    "LZMA": packed(zipfile.ZIP_LZMA),
    "tape": taped(),
}


@pytest.mark.parametrize("kind", ARCHIVES)
def test_a_folder_that_was_damaged_in_the_middle_is_refused(tmp_path: Path, kind: str) -> None:
    damaged = bytearray(ARCHIVES[kind])
    # Behind the names and sizes; of a tape, behind the first bytes of its compression.
    damaged[50:54] = b"\xff\x00\xff\x00"
    assert "can't be unpacked" in refused(bytes(damaged), tmp_path)


@pytest.mark.parametrize("kind", ARCHIVES)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_folder_with_any_damage_is_refused(tmp_path: Path, kind: str, data: st.DataObject) -> None:
    whole = ARCHIVES[kind]
    damaged = bytearray(whole)
    for _ in range(data.draw(st.integers(0, 3))):
        start = data.draw(st.integers(4, len(whole) - 1))
        new = data.draw(st.binary(min_size=1, max_size=8))
        damaged[start : start + len(new)] = new
    # Even the whole one is no recording.
    refused(bytes(damaged[: data.draw(st.integers(len(whole) - 40, len(whole)))]), tmp_path)


@pytest.mark.parametrize("seed", range(6))
def test_damaged_bytes_are_read_or_refused_but_never_break(drive: Drive, tmp_path: Path, seed: int) -> None:
    generator = np.random.default_rng(seed)
    short = [sent for sent in messages(drive) if sent[2] < 12.0]
    content = bytearray(as_mcap(short, compression=CompressionType.NONE))
    if seed % 2:
        as_db3(bytes(content), tmp_path / "bag.db3")
        content = bytearray((tmp_path / "bag.db3").read_bytes())
    for place in generator.integers(0, len(content), 40):
        content[place] = generator.integers(0, 256)
    with contextlib.suppress(BagError):
        assert told(bytes(content), tmp_path).seconds > 0.0


def test_where_several_topics_fit_one_is_chosen(drive: Drive, tmp_path: Path) -> None:
    second = [("/back/scan", *sent[1:]) for sent in messages(drive) if sent[0] == "/scan" and sent[2] < 10.0]
    content = as_mcap([*messages(drive), *second])
    scans = [topic for topic in told(content, tmp_path).topics if topic.role == "scan"]
    assert [(topic.name, topic.chosen) for topic in scans] == [("/scan", True), ("/back/scan", False)]
    scans = [topic for topic in told(content, tmp_path, TopicChoice(scan="/back/scan")).topics if topic.role == "scan"]
    assert [(topic.name, topic.chosen) for topic in scans] == [("/scan", False), ("/back/scan", True)]


def test_a_goal_in_the_maps_frame_is_brought_into_the_odometrys(drive: Drive, tmp_path: Path) -> None:
    sent = [message for message in messages(drive) if message[0] != "/goal_pose"]
    pose = {"position": {"x": 1.0, "y": 0.0, "z": 0.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}
    goal = ("/goal", "geometry_msgs/msg/PoseStamped", 5.0, {"header": header(5.0, "map"), "pose": pose})
    lost = told(as_mcap([*sent, goal]), tmp_path)
    x, y, _ = lost.path[-1]
    assert lost.goals[0] == pytest.approx((0.0, x, y), abs=2e-3)
    assert lost.notes[0].startswith("Goals in the frame map are left out")
    # The odometry's frame stands at (3, 1) in the map, turned by a quarter to the left.
    rotation = {"x": 0.0, "y": 0.0, "z": math.sin(math.pi / 4), "w": math.cos(math.pi / 4)}
    transform = {"translation": {"x": 3.0, "y": 1.0, "z": 0.0}, "rotation": rotation}
    edge = {"header": header(0.0, "map"), "child_frame_id": "odom", "transform": transform}
    found = told(as_mcap([*sent, goal, ("/tf", "tf2_msgs/msg/TFMessage", 0.0, {"transforms": [edge]})]), tmp_path)
    assert found.notes == ()
    assert found.goals[0] == pytest.approx((5.0, -1.0, 2.0))


# -- fits -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", [3, 5])
def test_what_the_simulator_was_told_is_found_again(tmp_path: Path, seed: int) -> None:
    drive = simulated(seed=seed, jitter=0.002, speed_noise=0.01, **task())
    reading = told(as_mcap(messages(drive)), tmp_path)
    fitted = {each.key: each for each in reading.fitted}
    for key, truth in TRUTH.items():
        assert holds(fitted[key], truth), fitted[key]
        value, low, high = fitted[key].value, fitted[key].low, fitted[key].high
        assert value is not None
        assert low is not None
        assert high is not None
        assert value == pytest.approx(truth, rel=0.1, abs=0.011)
        assert high - low < 0.3 * truth
    assert holds(fitted["robot.max_linear_speed"], 0.5)
    # What a training begins with is a task, with these values.
    made = TaskConfig().model_dump()
    for setting in reading.settings:
        where = made
        for name in setting.path[:-1]:
            where = where[name]
        assert setting.path[-1] in where
        where[setting.path[-1]] = setting.value
    settled = TaskConfig.model_validate(made)
    assert settled.lidar.noise == pytest.approx(0.01, rel=0.1)
    assert settled.randomisation.command_delay == (0, 1)  # 0.15 s is between none and one of the steps of 0.2 s


def test_intervals_hold_the_truth_in_about_95_of_100_recordings() -> None:
    held: dict[str, list[bool]] = {}
    for seed in range(30):
        generator = np.random.default_rng((seed, 7))
        truth = {
            "lidar.noise": float(generator.uniform(0.002, 0.03)),
            "lidar.dropout": float(generator.uniform(0.0, 0.1)),
            "lidar.rate": 10.0,
            "command_delay": PERIOD * int(generator.integers(0, 6)),
            "robot.max_linear_acceleration": float(np.exp(generator.uniform(np.log(0.2), np.log(2.0)))),
            "robot.max_angular_acceleration": float(np.exp(generator.uniform(np.log(0.5), np.log(5.0)))),
        }
        bag = simulated(seed=seed, seconds=45.0, jitter=0.002, speed_noise=0.01, **task(**truth)).bag()
        for each in (*fit_sensing(bag), *fit_motion(bag)):
            if each.key in truth and each.low is not None:
                held.setdefault(each.key, []).append(holds(each, truth[each.key]))
    assert held.keys() == TRUTH.keys()
    for key, found in held.items():
        # Of 30 that hold with probability 0.95, 25 or fewer do once in 200 times.
        assert len(found) >= 25, key
        assert sum(found) >= len(found) - 4, (key, sum(found), len(found))
    everything = [one for found in held.values() for one in found]
    assert np.mean(everything) >= 0.92


def test_what_a_recording_does_not_show_is_not_told() -> None:
    restless = simulated(seed=1, seconds=30.0, rests=False, **task()).bag()
    noise = fit_sensing(restless)[0]
    assert (noise.value, noise.low, noise.high) == (None, None, None)
    assert "Let it stand for a few seconds" in noise.note
    drive = simulated(seed=1, seconds=30.0, **task())
    alone = type(restless)(**{**vars(drive.bag()), "commands": None})
    unknown = {each.key: each for each in fit_motion(alone)}
    assert unknown["command_delay"].value is None
    assert "there are no commands" in unknown["command_delay"].note
    assert unknown["robot.max_linear_speed"].value is not None
    still = simulated(seed=1, seconds=6.0, **task()).bag()
    assert {each.value for each in fit_motion(still)} == {None}


def test_a_robot_without_a_limit_of_acceleration_has_none() -> None:
    free = {"robot.max_linear_acceleration": 0.0, "robot.max_angular_acceleration": 0.0}
    bag = simulated(seed=2, speed_noise=0.01, **task(**free)).bag()
    fitted = {each.key: each for each in fit_motion(bag)}
    linear = fitted["robot.max_linear_acceleration"]
    assert (linear.value, linear.high) == (None, None)
    assert linear.low is not None
    assert "No limit can be told" in linear.note
    assert holds(fitted["command_delay"], TRUTH["command_delay"])


# -- a policy beside --------------------------------------------------------------------------------------------------------


def test_a_policy_beside_itself_does_what_it_did() -> None:
    """Its own drive in the simulator, recorded, and the robot's program on that: one and the same."""
    from sim.envs.vector import NavigationVectorEnv
    from tests.workers.robot_bags import recorded

    policy = shipped_policy("simple")
    robots = robots_policy(policy.archive, ShippedPolicyName(name="simple"))
    env = NavigationVectorEnv(policy.card.training.task, 1, seed=4)
    observations, _ = env.reset()
    memory = robots.memory(1)

    def act() -> np.ndarray[Any, np.dtype[np.float32]]:
        nonlocal memory, observations
        actions, memory = robots.step(observations, memory)
        return actions

    def stepped(actions: np.ndarray[Any, np.dtype[np.float32]]) -> None:
        nonlocal observations
        observations = env.step(actions)[0]

    drive = recorded(env, act, stepped, steps=60)
    found = beside(drive.bag(), robots, "simple", lambda _: None)
    driving = np.array(found.driving)[:60]
    assert driving.mean() > 0.8
    asked = drive.commands[:60]
    assert np.abs(np.array(found.forwards)[:60] - asked[:, 0])[driving].max() < 0.01
    assert np.abs(np.array(found.turning)[:60] - asked[:, 2])[driving].max() < 0.03


def test_where_policy_and_robot_part_is_found() -> None:
    drive = simulated(seed=3, **task())
    found = beside(
        drive.bag(), robots_policy(shipped_policy("simple").archive, ShippedPolicyName(name="simple")), "s", print
    )
    assert len(found.times) == len(found.forwards) == len(found.states) == 301
    assert found.partings
    furthest = found.partings[0]
    at = found.times.index(furthest.at)
    second = slice(at, at + 5)
    apart = np.abs(np.subtract(found.forwards, found.did_forwards)[second]).mean()
    turned = np.abs(np.subtract(found.turning, found.did_turning)[second]).mean()
    # No further than both together can come.
    assert 0.1 < furthest.metres <= apart + (0.3 + 1.0) * turned + 0.01
    metres = [parting.metres for parting in found.partings]
    assert metres == sorted(metres, reverse=True)
    assert 0.0 < found.partings[-1].share <= furthest.share < 1.0
    # They tell more from less: few are equal.
    assert len(set(metres)) > len(metres) / 2
    moments = sorted(parting.at for parting in found.partings)
    assert min(np.diff(moments)) > 1.5
    assert "this policy goes 0.25 m/s at most" in found.notes[0]


def test_how_far_they_part_is_metres_between_their_noses_a_second_later() -> None:
    stands = np.zeros((20, 2))
    straight, turns, circles = (np.full((20, 2), each) for each in ((0.5, 0.0), (0.0, math.pi / 2), (math.pi / 2, math.pi)))
    # Half a metre a second, for one second; at the end of the recording for as long as it goes on.
    np.testing.assert_allclose(_apart(straight, stands, 0.2)[:16], 0.5, atol=1e-12)
    np.testing.assert_allclose(_apart(straight, stands, 0.2)[16:], [0.4, 0.3, 0.2, 0.1], atol=1e-12)
    # A quarter turn on the spot: the nose, 0.3 m before the middle, is a chord away.
    np.testing.assert_allclose(_apart(turns, stands, 0.1)[:10], 0.3 * math.sqrt(2.0), atol=1e-12)
    # Half a circle of half a metre's radius: its middle is a metre to the left, its nose looks back.
    np.testing.assert_allclose(_apart(circles, stands, 0.05)[0], math.hypot(0.6, 1.0), atol=0.01)
    # A period that is no part of a second is cut short; one that is longer, too.
    np.testing.assert_allclose(_apart(straight, stands, 0.3)[:16], 0.5, atol=1e-12)
    np.testing.assert_allclose(_apart(straight, stands, 2.0), 0.5, atol=1e-12)
    assert not _apart(circles, circles, 0.2).any()


def test_a_lidar_that_sees_too_little_for_a_policy_says_so() -> None:
    narrow = task()
    narrow["lidar"] |= {"field_of_view": 90.0, "rays": 60}
    bag = simulated(seed=3, seconds=20.0, **narrow).bag()
    robots = robots_policy(shipped_policy("simple").archive, ShippedPolicyName(name="simple"))
    found = beside(bag, robots, "simple", lambda _: None)
    assert "have no beam of this LiDAR, which covers 90°" in found.notes[0]
    assert not any(found.driving)
    assert "stopped: scan does not cover the policy's field of view" in {found.reasons[state] for state in found.states}


def test_goals_frames_and_stamps_of_another_clock_are_noted(drive: Drive, tmp_path: Path) -> None:
    simulated_time = []
    for topic, kind, at, fields in messages(drive):
        if "header" in fields:
            head = {**fields["header"], "stamp": {"sec": int(at), "nanosec": round((at - int(at)) * 1e9)}}
            fields = {**fields, "header": head}
        simulated_time.append((topic, kind, at, fields))
    (tmp_path / "bag").write_bytes(as_mcap(simulated_time))
    bag = read_bag(tmp_path / "bag", TopicChoice(), tmp_path)
    assert bag.notes[0].startswith("Its stamps are of another clock than the recorder's")
    assert bag.seconds == pytest.approx(60.0, abs=0.1)
