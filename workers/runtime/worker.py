"""`mapless worker`: a Celery worker for a server, here or on another machine."""

import functools
import logging
import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError

from sim.parts import require
from workers.errors import UnfitError
from workers.logs import LogFormat, configure
from workers.processes import python_path, usable_cores
from workers.protocol import Queue
from workers.runtime.companion import Companion
from workers.runtime.fitness import make_private
from workers.runtime.nursery_keeper import DOOR, NurseryKeeper
from workers.runtime.settings import WorkerSettings
from workers.runtime.supervised import SUPERVISED, end_with_supervisor


def worker(
    server: Annotated[
        str | None, typer.Option(help="URL of the server [MAPLESS_SERVER_URL, http://127.0.0.1:8400].")
    ] = None,
    broker: Annotated[str | None, typer.Option(help="URL of the Celery broker [MAPLESS_BROKER_URL].")] = None,
    token: Annotated[
        str | None, typer.Option(help="The workers' token; better given as MAPLESS_WORKER_TOKEN, which nobody can list.")
    ] = None,
    queue: Annotated[Queue | None, typer.Option(help="Trainings to take [MAPLESS_WORKER_QUEUE, cpu].")] = None,
    concurrency: Annotated[
        int | None,
        typer.Option(
            "--concurrency", "-c", min=0, help="Trainings side by side; one a core if not given, 0 for jobs alone."
        ),
    ] = None,
    jobs: Annotated[
        int,
        typer.Option(
            min=0,
            max=64,
            help="Replays, exports and evaluations side by side, beside trainings; 0 leaves them and views to others.",
        ),
    ] = 2,
    name: Annotated[str | None, typer.Option(help="Tells workers of one machine apart.")] = None,
    until_idle: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", help="End after so long without work, as a batch job should [MAPLESS_UNTIL_IDLE_SECONDS]."
        ),
    ] = None,
    work_dir: Annotated[
        Path | None, typer.Option(help="Where runs keep their files until the server has them [MAPLESS_WORK_DIR].")
    ] = None,
) -> None:
    """Start a worker for a server, here or on another machine."""
    require("worker")
    given = {
        "server_url": server,
        # Jobs need none.
        "broker_url": broker or ("memory://" if concurrency == 0 else None),
        "worker_token": token,
        "worker_queue": queue,
        "work_dir": work_dir,
        "until_idle_seconds": until_idle,
        "worker_name": name or os.environ.get("MAPLESS_WORKER_NAME") or f"worker{os.getpid()}",
    }
    try:
        settings = WorkerSettings.model_validate({key: value for key, value in given.items() if value is not None})
    except ValidationError as error:
        for problem in error.errors():
            variable = f"MAPLESS_{problem['loc'][0]}".upper()
            reason = "is needed (mapless worker --help)" if problem["type"] == "missing" else problem["msg"]
            sys.stderr.write(f"mapless: {variable} {reason}\n")
        raise typer.Exit(1) from None
    try:
        make_private(settings.work_dir)
    except UnfitError as error:
        sys.stderr.write(f"mapless: {error}\n")
        raise typer.Exit(1) from None
    run_worker(settings, usable_cores() if concurrency is None else concurrency, jobs)


def run_worker(settings: WorkerSettings, concurrency: int, jobs: int) -> None:
    """Work until SIGTERM or SIGINT; trainings under way are then handed back, with a checkpoint.

    Jobs are done by a process of their own, which needs no broker.

    At SIGUSR1, or the server's word, they are finished first, and no more are taken up.
    """
    # What runs keep here is their owner's alone.
    os.umask(0o077)
    # The processes that Celery forks read the settings anew.
    os.environ.update(_environment(settings))
    os.environ.pop(DOOR, None)
    if not concurrency:
        if jobs:
            os.execv(sys.executable, [sys.executable, *_jobs_command(jobs)])  # noqa: S606 (a fixed list)
        sys.exit("mapless: a worker without trainings (--concurrency 0) and without jobs (--jobs 0) has nothing to do")
    end_with_supervisor()
    nursery = NurseryKeeper()
    os.environ[DOOR] = str(nursery.door)
    companions: list[NurseryKeeper | Companion] = [
        nursery,
        *([Companion("jobs", functools.partial(_start_jobs, jobs, nursery.door))] if jobs else []),
    ]

    # Late, so that `mapless worker --help` does not wait for Celery.
    from celery.signals import setup_logging, worker_ready

    import workers.runtime.tasks  # noqa: F401 - its signal handlers must be there when the worker starts
    from workers.runtime.app import create_app

    for companion in companions:
        worker_ready.connect(functools.partial(_keep_running, companion), weak=False)
    # In Celery's place: a line for each message that comes and goes says nothing that ours do not.
    log = functools.partial(_log, settings.log_format)
    setup_logging.connect(log, weak=False)
    log()
    app = create_app(settings.broker_url)
    app.worker_main(
        [
            "--quiet",
            "worker",
            f"--queues={settings.queue_prefix}{settings.worker_queue}",
            f"--concurrency={concurrency}",
            f"--hostname={settings.worker_name}@%h",
            "--pool=prefork",
            "--loglevel=INFO",
            # Workers need not know of one another.
            "--without-gossip",
            "--without-mingle",
            "--without-heartbeat",
        ]
    )


def _jobs_command(count: int) -> list[str]:
    return ["-m", "workers.runtime.jobs", str(count)]


def _start_jobs(count: int, door: int) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, *_jobs_command(count)],
        # It hears of this process's end by the end of its input.
        stdin=subprocess.PIPE,
        pass_fds=(door,),
        env={**os.environ, "PYTHONPATH": python_path(), SUPERVISED: "1"},
    )


def _keep_running(companion: Companion | NurseryKeeper, **_: Any) -> None:
    companion.keep_running()


def _log(log_format: LogFormat, **_: Any) -> None:
    configure(log_format)
    # When the broker is lost and found.
    logging.getLogger("celery.worker.consumer.connection").setLevel(logging.INFO)


def _environment(settings: WorkerSettings) -> dict[str, str]:
    values = {
        "SERVER_URL": settings.server_url.rstrip("/"),
        "BROKER_URL": settings.broker_url,
        "QUEUE_PREFIX": settings.queue_prefix,
        "WORKER_TOKEN": settings.worker_token.get_secret_value(),
        "WORKER_QUEUE": settings.worker_queue,
        "WORKER_NAME": settings.worker_name,
        "WORK_DIR": str(Path(settings.work_dir).resolve()),
        "LOG_FORMAT": settings.log_format,
        "MIN_FREE_BYTES": str(settings.min_free_bytes),
    }
    if settings.until_idle_seconds is not None:
        values["UNTIL_IDLE_SECONDS"] = str(settings.until_idle_seconds)
    return {f"MAPLESS_{name}": value for name, value in values.items()}
