"""A finished policy drives in a process of its own for as long as somebody watches."""

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from workers.frames import Frame
from workers.live.drive import LENGTH_BYTES
from workers.reporting import WatchRequest
from workers.shipped.library import shipped_policy

ROOT = Path(__file__).parents[2]
POLICY = shipped_policy("complex")


class Driver:
    """The process, seen from the server."""

    def __init__(self, archive: Path) -> None:
        command = [sys.executable, "-m", "workers.live.drive", str(archive)]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=pipe, stdout=pipe, stderr=pipe)

    def wish(self, request: WatchRequest | None) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write((b"null" if request is None else request.model_dump_json().encode()) + b"\n")
        self.process.stdin.flush()

    def frame(self) -> Frame | None:
        """The next frame; None at the end."""
        assert self.process.stdout is not None
        length = self.process.stdout.read(LENGTH_BYTES)
        return Frame.decode(self.process.stdout.read(int.from_bytes(length, "little"))) if length else None


@pytest.fixture
def driver() -> Iterator[Driver]:
    driver = Driver(POLICY.archive)
    with driver.process:
        yield driver
        driver.process.kill()


def test_it_drives_while_somebody_watches_and_ends_with_its_input(driver: Driver) -> None:
    driver.wish(None)
    driver.wish(WatchRequest(robots=3, speed=10.0))
    frames = [driver.frame() for _ in range(60)]
    seen = [frame for frame in frames if frame is not None]
    assert len(seen) == 60
    assert {(frame.mode, frame.step, len(frame.poses)) for frame in seen} == {("policy", POLICY.card.step, 3)}
    assert seen[-1].sim_time > seen[0].sim_time
    assert (seen[-1].poses != seen[0].poses).any()
    # There are no training robots any more: the policy drives whatever is wished for.
    driver.wish(WatchRequest(mode="training", robots=5))
    deadline = time.monotonic() + 20
    while (frame := driver.frame()) is not None and len(frame.poses) != 5:
        assert time.monotonic() < deadline
    assert frame is not None
    assert frame.mode == "policy"
    assert driver.process.stdin is not None
    driver.process.stdin.close()
    while driver.frame() is not None:
        pass
    assert driver.process.wait(10) == 0


def test_nobody_watches_nothing_is_sent(driver: Driver) -> None:
    driver.wish(WatchRequest(robots=1))
    assert driver.frame() is not None
    driver.wish(None)
    assert driver.process.stdin is not None
    time.sleep(1.0)
    driver.process.stdin.close()
    left = 0
    while driver.frame() is not None:
        left += 1
    # What was on its way when nobody watched any more.
    assert left < 15


def test_what_is_no_policy_says_so(tmp_path: Path) -> None:
    (tmp_path / "policy.zip").write_bytes(b"not an archive")
    driver = Driver(tmp_path / "policy.zip")
    _, errors = driver.process.communicate(timeout=60)
    assert driver.process.returncode != 0
    assert b"is not a readable archive" in errors
