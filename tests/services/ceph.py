"""A Ceph of this machine alone: a monitor, a store in memory, and the gateway that speaks S3."""

import os
import secrets
import shutil
import subprocess
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from tests.conftest import require_program
from tests.services.stack import free_port, until

PROGRAMS = ("ceph", "ceph-mon", "ceph-osd", "ceph-authtool", "monmaptool", "radosgw", "radosgw-admin")

# One copy of everything, in one placement group each: enough to keep what is given, and up within seconds.
_CONFIGURATION = """
[global]
fsid = {fsid}
mon host = [v2:127.0.0.1:{monitor}]
auth cluster required = cephx
auth service required = cephx
auth client required = cephx
public addr = 127.0.0.1
cluster addr = 127.0.0.1
run dir = {folder}
admin socket = {folder}/$name.asok
log file = {folder}/$name.log
pid file = {folder}/$name.pid
keyring = {folder}/keyring
mon data = {folder}/mon
mon data avail crit = 1
mon allow pool size one = true
paxos propose interval = 0.05
osd data = {folder}/osd
osd objectstore = memstore
memstore device bytes = 1073741824
osd crush chooseleaf type = 0
osd pool default size = 1
osd pool default min size = 1
osd pool default pg num = 1
osd pool default pg autoscale mode = off
rgw data = {folder}/rgw
rgw md log max shards = 1
rgw data log num shards = 1
rgw lc max objs = 1
rgw gc max objs = 1
"""


@dataclass(frozen=True)
class ObjectStore:
    """Where it answers, and who may write; `environment` is what tells a process both."""

    url: str
    key: str
    secret: str

    @property
    def environment(self) -> dict[str, str]:
        """As any S3 client reads it."""
        return {
            "AWS_ENDPOINT_URL": self.url,
            "AWS_ACCESS_KEY_ID": self.key,
            "AWS_SECRET_ACCESS_KEY": self.secret,
            "AWS_DEFAULT_REGION": "us-east-1",
        }


@contextmanager
def object_store(folder: Path) -> Iterator[ObjectStore]:
    """One that lasts as long as the block, its files in `folder`; the test skips where Ceph is not installed."""
    for program in PROGRAMS:
        require_program(program)
    for name in ("mon", "osd", "rgw"):
        (folder / name).mkdir(parents=True)
    fsid, monitor, gateway = str(uuid.uuid4()), free_port(), free_port()
    configuration = folder / "ceph.conf"
    configuration.write_text(_CONFIGURATION.format(fsid=fsid, monitor=monitor, folder=folder))
    processes: list[subprocess.Popen[bytes]] = []

    def call(program: str, *arguments: str) -> None:
        command = [program, *arguments]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, f"{' '.join(command)}: {done.stderr}"

    def start(program: str, *arguments: str) -> None:
        with (folder / f"{program}.out").open("wb") as log:
            command = [shutil.which(program) or program, *arguments, "--foreground"]
            processes.append(subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log))

    environment = {**os.environ, "CEPH_CONF": str(configuration)}
    address = f"[v2:127.0.0.1:{monitor}]"
    store = ObjectStore(f"http://127.0.0.1:{gateway}", secrets.token_hex(8), secrets.token_hex(16))
    try:
        call("ceph-authtool", "--create-keyring", "keyring")
        for name in ("mon.", "osd.0", "client.admin", "client.gateway"):
            call("ceph-authtool", "keyring", "-n", name, "--gen-key", "--cap", "mon", "allow *", "--cap", "osd", "allow *")
        call("monmaptool", "--create", "--fsid", fsid, "--addv", "a", address, "monmap")
        call("ceph-mon", "-i", "a", "--mkfs", "--monmap", "monmap", "--keyring", "keyring", "--no-mon-config")
        start("ceph-mon", "-i", "a", "--no-mon-config")
        osd = str(uuid.uuid4())
        call("ceph", "--connect-timeout", "30", "osd", "new", osd)
        call("ceph-osd", "-i", "0", "--mkfs", "--osd-uuid", osd, "--no-mon-config")
        start("ceph-osd", "-i", "0")
        start("radosgw", "-n", "client.gateway", "--no-mon-config", "--rgw-frontends", f"beast endpoint=127.0.0.1:{gateway}")
        until(lambda: httpx.get(store.url).status_code < 500, seconds=90)
        who = ("--uid", "mapless", "--display-name", "Mapless", "--access-key", store.key, "--secret", store.secret)
        call("radosgw-admin", "user", "create", *who)
        yield store
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait(timeout=20)
