"""Ports, and processes with all that they have started."""

import contextlib
import socket

import psutil


def free_port() -> int:
    """A port of 127.0.0.1 that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port


def tree(pid: int) -> list[psutil.Process]:
    """A process and all that it has started; nothing where it has ended."""
    try:
        process = psutil.Process(pid)
        return [process, *process.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []


def trainer_of(pid: int) -> psutil.Process | None:
    """The trainer process under a worker, forked from the nursery; None where none trains."""
    return _named("mapless-trainer", pid)


def nursery_of(pid: int) -> psutil.Process | None:
    """The process under a worker that its trainers are forked from; None where it is not there now."""
    return _named("mapless-nursery", pid)


def _named(name: str, pid: int) -> psutil.Process | None:
    for process in tree(pid):
        with contextlib.suppress(psutil.NoSuchProcess):
            if process.status() != psutil.STATUS_ZOMBIE and process.name() == name:
                return process
    return None


def suspend(processes: list[psutil.Process]) -> None:
    """SIGSTOP, to those that are still there."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.suspend()


def resume(processes: list[psutil.Process]) -> None:
    """SIGCONT, to those that are still there."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.resume()


def kill(processes: list[psutil.Process]) -> None:
    """SIGKILL, to those that are still there, and wait until they are gone."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()
    psutil.wait_procs(processes, timeout=10)
