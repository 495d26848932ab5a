"""A machine whose first process is systemd: the files of this one, with this project in /opt/mapless, in namespaces.

What is written there is written in memory, and gone with it. Ports are shared with this machine.
"""

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil

from tests.services.stack import ROOT, until

HOME = "/opt/mapless"
# Python itself may lie where the units' protection hides it, as below somebody's home.
PYTHON = "/opt/python"

_BOOT = f"""set -e
umask 022
mount --make-rprivate /
mount -t tmpfs tmpfs "$FOLDER"
cd "$FOLDER"
mkdir files files.work root project project.work venv venv.work
mount -t overlay overlay -o lowerdir=/,upperdir=files,workdir=files.work root
root=$PWD/root
mkdir -p "$root{HOME}" "$root{PYTHON}"
mount -t overlay overlay -o "lowerdir=$PROJECT,upperdir=project,workdir=project.work" "$root{HOME}"
# A link would lead to this machine's own.
if [ -L "$root{HOME}/.venv" ]; then
  rm "$root{HOME}/.venv"
  mkdir "$root{HOME}/.venv"
  mount -t overlay overlay -o "lowerdir=$VENV,upperdir=venv,workdir=venv.work" "$root{HOME}/.venv"
fi
mount --bind "$BASE" "$root{PYTHON}"
ln -sfn "{PYTHON}/bin/$INTERPRETER" "$root{HOME}/.venv/bin/python3"
sed -i 's|^home = .*|home = {PYTHON}/bin|' "$root{HOME}/.venv/pyvenv.cfg"
sed -i -e "s|$PROJECT|{HOME}|g" -e "s|${{VENV%/*}}|{HOME}|g" \
  "$root{HOME}/.venv/bin/mapless" "$root{HOME}"/.venv/lib/python*/site-packages/*.pth
# Nothing of this machine starts but what systemd itself needs; of its kernel nothing is changed.
rm -rf "$root"/etc/systemd/system "$root"/etc/rc?.d "$root"/etc/init.d
mkdir "$root/etc/systemd/system"
mount -t proc proc "$root/proc"
mount --bind "$root/proc/sys" "$root/proc/sys"
mount -o remount,ro,bind "$root/proc/sys"
mount -t sysfs -o ro sysfs "$root/sys"
mount -t tmpfs -o mode=755 tmpfs "$root/sys/fs/cgroup"
mkdir "$root/sys/fs/cgroup/systemd"
mount -t cgroup -o none,name=systemd cgroup "$root/sys/fs/cgroup/systemd"
mount -t tmpfs -o mode=755 tmpfs "$root/dev"
mkdir "$root/dev/shm" "$root/dev/pts"
mount -t tmpfs tmpfs "$root/dev/shm"
mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
ln -s pts/ptmx "$root/dev/ptmx"
ln -s /proc/self/fd "$root/dev/fd"
for node in null zero full random urandom tty; do touch "$root/dev/$node"; mount --bind "/dev/$node" "$root/dev/$node"; done
mount -t tmpfs -o mode=755 tmpfs "$root/run"
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
mkdir "$root/before"
cd "$root"
pivot_root . before
umount -l /before
export container=test
exec /lib/systemd/systemd --system --unit=multi-user.target --show-status=no
"""
_HIERARCHY = Path("/sys/fs/cgroup/systemd")


class Machine:
    """One that has started.

    Args:
        pid: of its systemd, as this machine counts.
    """

    def __init__(self, pid: int) -> None:
        self._pid = pid

    @property
    def root(self) -> Path:
        """Its files, from here."""
        return Path(f"/proc/{self._pid}/root")

    def run(self, script: str, *, check: bool = True) -> str:
        """What a shell there prints; it begins in root's home."""
        command = ["nsenter", f"--target={self._pid}", "--mount", "--pid", "--ipc", "--uts", "--root", "--wd"]
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root"}
        done = subprocess.run(
            [*command, "sh", "-ec", f"cd /root\n{script}"], env=environment, capture_output=True, text=True, check=False
        )
        assert not check or done.returncode == 0, f"{script}\n{done.stdout}{done.stderr}"
        return done.stdout

    def is_active(self, unit: str) -> str:
        """What systemd says of a unit: active, inactive, failed, ..."""
        return self.run(f"systemctl is-active {unit}", check=False).strip()

    def bring_compiled(self, cache: str) -> None:
        """Put what is compiled here where a unit looks for it: compiling it anew takes minutes."""
        for room in ("sim", "workers"):
            folder = f"{room}/kernels"
            named = {of: f"kernels_{hashlib.sha1(f'{of}/{folder}'.encode()).hexdigest()}" for of in (str(ROOT), HOME)}
            for there in (ROOT / folder / "__pycache__").glob(f"*/{named[str(ROOT)]}"):
                target = Path(f"{self.root}{cache}", there.parent.name, named[HOME])
                shutil.copytree(there, target)


@contextmanager
def machine(folder: Path) -> Iterator[Machine]:
    """Start one; at the end it is switched off, without a word to anybody.

    Args:
        folder: an empty one of this machine's.
    """
    group = _HIERARCHY / f"mapless-test-{os.getpid()}"
    interpreter = Path(sys.executable).resolve()
    environment = {
        "PATH": "/usr/sbin:/usr/bin:/sbin:/bin",
        "FOLDER": str(folder),
        "PROJECT": str(ROOT),
        "VENV": str((ROOT / ".venv").resolve()),
        "BASE": str(interpreter.parents[1]),
        "INTERPRETER": interpreter.name,
    }
    group.mkdir()
    try:
        with (folder.parent / "systemd.log").open("wb") as log:
            namespaces = "--mount --pid --ipc --uts --cgroup --fork --kill-child"
            begin = f'echo $$ > {group}/cgroup.procs; exec unshare {namespaces} sh -c "$0"'
            process = subprocess.Popen(["sh", "-c", begin, _BOOT], env=environment, stdout=log, stderr=log)
        try:

            def first() -> int | None:
                assert process.poll() is None, (folder.parent / "systemd.log").read_text()
                children = psutil.Process(process.pid).children()
                return children[0].pid if children and children[0].name() == "systemd" else None

            pid = until(first, seconds=30)
            assert pid is not None
            started = Machine(pid)
            until(lambda: started.is_active("multi-user.target") == "active", seconds=180)
            yield started
        finally:
            process.kill()
            process.wait()
    finally:
        until(lambda: not any(each.read_text() for each in group.rglob("cgroup.procs")), seconds=20)
        for each in sorted(group.rglob("*/"), reverse=True):
            each.rmdir()
        group.rmdir()
