"""Policies on their way home: gone on with where they broke off, and kept only if their SHA-256 is right."""

import hashlib
import re
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import httpx

from mapless_client.errors import DamagedDownloadError, UnreachableError
from mapless_client.transport import Transport

Form = Literal["archive", "bundle", "onnx"]
"""The checkpoint as it is; all that it takes to drive a robot; that bundle's `policy.onnx` alone."""

FORMS: tuple[Form, ...] = ("archive", "bundle", "onnx")
_ROUTES: dict[Form, str] = {"archive": "download", "bundle": "bundle", "onnx": "bundle"}
_ONNX_MEMBER = re.compile(r"(^|/)policy\.onnx$")
_NAME = re.compile(r"[\w.-]+")
# So often in a row without a byte more, then the server counts as unreachable.
_VAIN_TRIES = 4


@dataclass(frozen=True)
class Pulled:
    """A file that has arrived whole; `size` in bytes, `sha256` in lower-case hexadecimal."""

    path: Path
    size: int
    sha256: str


def pull(transport: Transport, checkpoint_id: str, directory: Path, form: Form) -> Pulled:
    """A checkpoint in one of its forms, as a file in a directory, which is made.

    What has arrived of a download that broke off lies there as a hidden `.part`, and the next one goes on from it.

    Raises:
        RefusedError: there is no such checkpoint, or it can't be exported.
        UnreachableError: the server was away for too long.
        DamagedDownloadError: what arrived is not what the server has.
    """
    directory.mkdir(parents=True, exist_ok=True)
    path = f"/api/checkpoints/{checkpoint_id}/{_ROUTES[form]}"
    if form != "onnx":
        return _download(transport, path, directory, f"{checkpoint_id}-{form}")
    with tempfile.TemporaryDirectory(dir=directory, prefix=".bundle-") as temporary:
        bundle = _download(transport, path, Path(temporary), checkpoint_id)
        return _take_out(bundle.path, directory / bundle.path.name.replace("-bundle.zip", ".onnx"))


def keep(transport: Transport, path: str, directory: Path) -> Path:
    """What the server makes while it sends it, as a file in a directory, which is made; begun anew each time.

    Raises:
        RefusedError: there is no such thing.
        UnreachableError: the server was away for too long, or broke off.
    """
    directory.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=directory, prefix=".", suffix=".part", delete=False) as file:
        part = Path(file.name)
        try:
            with transport.stream(path) as response:
                target = directory / _file_name(response)
                for block in response.iter_bytes():
                    file.write(block)
        except BaseException:
            part.unlink()
            raise
    return part.replace(target)


def _download(transport: Transport, path: str, directory: Path, key: str) -> Pulled:
    part, vain = _part_of(directory, key), 0
    while True:
        before = _size(part)
        try:
            part, name, sha256 = _go_on(transport, path, directory, key, part)
            break
        except UnreachableError:
            part = _part_of(directory, key)
            vain = 0 if _size(part) > before else vain + 1
            if vain >= _VAIN_TRIES:
                raise
    with part.open("rb") as file:
        arrived = hashlib.file_digest(file, "sha256").hexdigest()
    if arrived != sha256:
        part.unlink()
        raise DamagedDownloadError(f"{name} has the SHA-256 {arrived}, but the server has {sha256}. Pull it again.")
    return Pulled(part.replace(directory / name), _size(directory / name), sha256)


def _go_on(transport: Transport, path: str, directory: Path, key: str, part: Path | None) -> tuple[Path, str, str]:
    """Fetch what is missing; the part, now whole, the file's name, and its SHA-256 as the server says."""
    headers = {}
    # One byte anew: nothing can be asked for beyond the end of a part that is whole.
    start = max(_size(part) - 1, 0)
    if part is not None and start:
        headers = {"Range": f"bytes={start}-", "If-Range": f'"{_hash_in(part)}"'}
    with transport.stream(path, headers=headers) as response:
        sha256 = response.headers.get("ETag", "").strip('"')
        if not re.fullmatch("[0-9a-f]{64}", sha256):
            raise DamagedDownloadError("The server does not say which SHA-256 the file has: it is too old for this client.")
        if part is None or _hash_in(part) != sha256:
            if part is not None:
                part.unlink()
            part, start = directory / f".{key}-{sha256}.part", 0
        if response.status_code != httpx.codes.PARTIAL_CONTENT:
            start = 0
        with part.open("r+b" if part.exists() else "wb") as file:
            file.truncate(start)
            file.seek(start)
            for block in response.iter_bytes():
                file.write(block)
        return part, _file_name(response), sha256


def _take_out(bundle: Path, target: Path) -> Pulled:
    with zipfile.ZipFile(bundle) as archive:
        member = next(name for name in archive.namelist() if _ONNX_MEMBER.search(name))
        content = archive.read(member)
    target.write_bytes(content)
    return Pulled(target, len(content), hashlib.sha256(content).hexdigest())


def _part_of(directory: Path, key: str) -> Path | None:
    return next(directory.glob(f".{key}-*.part"), None)


def _hash_in(part: Path) -> str:
    return part.stem.rsplit("-", 1)[1]


def _size(part: Path | None) -> int:
    return part.stat().st_size if part is not None else 0


def _file_name(response: httpx.Response) -> str:
    """As the server says, if that is a plain name."""
    match = re.search('filename="([^"]+)"', response.headers.get("Content-Disposition", ""))
    if match is None or not _NAME.fullmatch(match[1]) or match[1].startswith("."):
        raise DamagedDownloadError("The server names no file.")
    return match[1]
