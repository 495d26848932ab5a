"""docs/slurm/workers.sbatch on a real Slurm of one node: workers take what waits, hand runs back, and leave."""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.conftest import require_program
from tests.services.stack import ROLLOUT, WORKER_TOKEN, Service, assert_one_unbroken_curve, free_port, until

SCRIPT = Path(__file__).parents[2] / "docs" / "slurm" / "workers.sbatch"
Slurm = Callable[..., str]

CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmdPort={daemon}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge/socket
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
NodeName={host} NodeAddr=127.0.0.1 CPUs=8 RealMemory=1000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


@pytest.fixture
def slurm(tmp_path: Path) -> Iterator[Slurm]:
    """Runs one of Slurm's commands against a cluster of this machine alone, and returns what it prints."""
    for program in ("slurmctld", "slurmd", "sbatch", "munged"):
        require_program(program)
    if os.geteuid() != 0:
        message = "slurmd starts jobs as root only"
        if os.environ.get("REQUIRE_SERVICES") == "1":
            pytest.fail(message)
        pytest.skip(message)
    folder = tmp_path / "slurm"
    for name in ("munge", "state", "spool"):
        (folder / name).mkdir(parents=True)
    munge = folder / "munge"
    (munge / "key").write_bytes(os.urandom(128))
    (munge / "key").chmod(0o400)
    # Another program must be able to reach the socket, and nobody to write beside it.
    munge.chmod(0o711)
    places = {"key-file": "key", "socket": "socket", "pid-file": "pid", "log-file": "log", "seed-file": "seed"}
    host = socket.gethostname().partition(".")[0]
    (folder / "slurm.conf").write_text(
        CONFIGURATION.format(host=host, controller=free_port(), daemon=free_port(), folder=folder)
    )
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    commands = (
        ["munged", "--foreground", "--force", *(f"--{option}={munge / name}" for option, name in places.items())],
        ["slurmctld", "-D"],
        ["slurmd", "-D"],
    )
    processes = []

    def call(*command: str) -> str:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        return done.stdout if done.returncode == 0 else ""

    try:
        for command in commands:
            with (folder / f"{command[0]}.log").open("wb") as log:
                program = shutil.which(command[0]) or command[0]
                processes.append(subprocess.Popen([program, *command[1:]], env=environment, stdout=log, stderr=log))
            if command[0] == "munged":
                until((munge / "socket").exists, seconds=20)
        until(lambda: "idle" in call("sinfo", "--noheader", "--format=%t"), seconds=30)
        yield call
    finally:
        call("scancel", "--user=root", "--signal=KILL", "--full")
        for process in reversed(processes):
            process.terminate()
            process.wait(timeout=20)


@pytest.mark.services
def test_an_array_of_workers_trains_what_waits_and_leaves(service: Service, slurm: Slurm, tmp_path: Path) -> None:
    service.start_server()
    names = ("MAPLESS_SERVER_URL", "MAPLESS_BROKER_URL")
    environment = {name: service.environment[name] for name in names} | {"MAPLESS_WORKER_TOKEN": WORKER_TOKEN}
    (tmp_path / "worker.env").write_text("".join(f"{name}={value}\n" for name, value in environment.items()))
    script = SCRIPT.read_text()
    for before, after in (
        ("/etc/mapless/worker.env", str(tmp_path / "worker.env")),
        ("/opt/mapless/.venv/bin/mapless worker", f"{sys.executable} -m workers worker"),
        ("--array=1-16 --cpus-per-task=4", "--array=1-2 --cpus-per-task=1"),
        ("--concurrency 4 --until-idle 60", "--concurrency 1 --until-idle 5"),
    ):
        assert before in script
        script = script.replace(before, after)
    runs = service.launch(40 * ROLLOUT, save_every=4 * ROLLOUT, seeds=(0, 1))
    (tmp_path / "workers.sbatch").write_text(script)
    (job,) = slurm(
        "sbatch",
        "--parsable",
        f"--chdir={SCRIPT.parents[2]}",
        f"--output={tmp_path}/job-%a.log",
        str(tmp_path / "workers.sbatch"),
    ).split()

    for run_id in runs:
        service.until_state(run_id, "running")
        until(lambda run_id=run_id: service.checkpoints(run_id))  # type: ignore[misc]
    slurm("scancel", f"{job}_1")
    for run_id in runs:
        service.until_state(run_id, "completed")
        assert_one_unbroken_curve(service, run_id)
    # Whose worker was cancelled went on elsewhere, from the checkpoint that was written then; the other was not disturbed.
    assert sorted(service.run(run_id)["attempt"] for run_id in runs) == [1, 2]
    until(lambda: not slurm("squeue", "--noheader").strip())
