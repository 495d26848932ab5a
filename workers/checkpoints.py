"""Checkpoint archives: one .zip with the policy, its manifest, and the state that a training resumes from.

| file                | content |
|---------------------|---------|
| manifest.json       | `workers.manifest.Manifest` |
| policy.safetensors  | the deterministic policy's arrays |
| state.safetensors   | optimiser, random states, environment: what only a resume needs |
| state.json          | `workers.manifest.TrainingCounters` |

The last two are missing where a policy was copied without them.

Nothing is ever unpickled. Archives come over the network, so that reading one trusts nothing: members are stored, not
compressed (nothing can inflate), known by name, bounded in size, and compared with the SHA-256 in the manifest.
"""

import errno
import hashlib
import json
import os
import struct
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, TypeAdapter, ValidationError
from safetensors import SafetensorError
from safetensors.numpy import load as load_safetensors
from safetensors.numpy import save as save_safetensors

from sim.actions import action_layout
from sim.extending.discovery import UsedExtension, missing, versions, wording
from workers.errors import ArchiveExtensionError, ArchiveFormatError, ArchiveIntegrityError
from workers.manifest import MANIFEST, POLICY, STATE_ARRAYS, STATE_COUNTERS, FileEntry, Manifest, TrainingCounters
from workers.networks.inputs import inputs_of
from workers.networks.layout import policy_shapes
from workers.policy import Policy

Arrays = Mapping[str, NDArray[np.generic]]

# Far above what any configuration makes, far below what hurts.
MAX_STATE_BYTES = 2**31
"""What only a resume needs, a replay memory above all, at most."""
_SIZE_LIMITS = {MANIFEST: 2**20, POLICY: 2**26, STATE_ARRAYS: MAX_STATE_BYTES, STATE_COUNTERS: 2**16}

_EXTENSIONS = TypeAdapter(tuple[UsedExtension, ...])

_BLOCK = 256 * 1024

# The same content gives the same bytes, whenever it is written.
_TIMESTAMP = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """An archive's whole content."""

    manifest: Manifest
    weights: dict[str, NDArray[np.float32]]
    arrays: dict[str, NDArray[np.generic]]
    counters: TrainingCounters


def write_checkpoint(path: Path, checkpoint: Checkpoint) -> None:
    """Writes an archive; whoever finds `path` finds it complete.

    `checkpoint.manifest.files` is ignored and made anew.
    """
    members = {
        POLICY: save_safetensors(dict(checkpoint.weights)),
        STATE_ARRAYS: save_safetensors({name: np.asarray(array, order="C") for name, array in checkpoint.arrays.items()}),
        STATE_COUNTERS: _json(checkpoint.counters),
    }
    _write(path, checkpoint.manifest, members)


def copy_policy(archive: Path, target: Path) -> None:
    """Writes an archive with the policy of another one, without the state to resume its training.

    Raises:
        ArchiveError: `archive` is not one that this release reads, or it is damaged.
    """
    manifest, policy = read_policy(archive)
    _write(target, manifest, {POLICY: save_safetensors(policy.weights)})


def _write(path: Path, manifest: Manifest, members: Mapping[str, bytes]) -> None:
    files = {name: FileEntry(sha256=hashlib.sha256(data).hexdigest(), size=len(data)) for name, data in members.items()}
    manifest = manifest.model_copy(update={"files": files})
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
        try:
            with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
                for name, data in {MANIFEST: _json(manifest), **members}.items():
                    archive.writestr(zipfile.ZipInfo(name, _TIMESTAMP), data)
            file.flush()
            os.fsync(file.fileno())
            Path(file.name).replace(path)
            sync_directory(path.parent)
        except BaseException:
            Path(file.name).unlink(missing_ok=True)
            raise


def sync_directory(directory: Path) -> None:
    """Bring a folder's entries to disk: until then a crash may take back that a file was created or renamed."""
    descriptor = os.open(directory, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def read_manifest(path: Path) -> Manifest:
    """An archive's manifest.

    Raises:
        ArchiveError: it is not an archive that this release reads.
    """
    with _open(path, path.name) as archive:
        return _manifest(archive)


def read_policy(path: Path) -> tuple[Manifest, Policy]:
    """An archive's manifest and policy.

    Raises:
        ArchiveError: it is not an archive that this release reads, or it is damaged.
    """
    with _open(path, path.name) as archive:
        manifest = _manifest(archive)
        training, actions = manifest.training, action_layout(manifest.training.task.robot)
        weights = _weights(archive, manifest)
        return manifest, Policy(training.algorithm.network, weights, inputs_of(training.task), actions)


def read_checkpoint(path: Path) -> Checkpoint:
    """Everything in an archive, to resume its training.

    Raises:
        ArchiveError: it is not an archive that this release reads, or it is damaged.
    """
    with _open(path, path.name) as archive:
        manifest = _manifest(archive)
        try:
            counters = TrainingCounters.model_validate_json(_member(archive, manifest, STATE_COUNTERS))
        except ValidationError as error:
            raise ArchiveIntegrityError(f"{STATE_COUNTERS} is not as documented: {error}") from error
        arrays = _arrays(_member(archive, manifest, STATE_ARRAYS), STATE_ARRAYS)
        return Checkpoint(manifest, _weights(archive, manifest), arrays, counters)


def check_archive(file: IO[bytes], name: str) -> None:
    """Compares every file of an archive with what its manifest promises, a block at a time.

    Raises:
        ArchiveError: it is not an archive that this release reads, or it is damaged.
    """
    with _open(file, name) as archive:
        for member, entry in _manifest(archive).files.items():
            if member not in archive.namelist():
                raise ArchiveIntegrityError(f"{member} is missing in {name}")
            with archive.open(member) as data:
                if sha256_of(data) != entry.sha256:
                    raise ArchiveIntegrityError(f"{member} in {name} is not the file that the manifest describes")


def sha256_of(file: IO[bytes]) -> str:
    """The SHA-256 of what is left to read of a file, in lower-case hexadecimal."""
    digest = hashlib.sha256()
    while block := file.read(_BLOCK):
        digest.update(block)
    return digest.hexdigest()


@contextmanager
def _open(source: Path | IO[bytes], name: str) -> Iterator[zipfile.ZipFile]:
    try:
        with zipfile.ZipFile(source) as archive:
            names = archive.namelist()
            if len(set(names)) != len(names) or not {MANIFEST, POLICY} <= set(names) <= set(_SIZE_LIMITS):
                raise ArchiveFormatError(
                    f"{name} is not a checkpoint: it should hold {', '.join(_SIZE_LIMITS)}, each once, and nothing else"
                )
            for info in archive.infolist():
                if info.compress_type != zipfile.ZIP_STORED or info.file_size != info.compress_size:
                    raise ArchiveFormatError(f"{info.filename} is compressed, and a checkpoint's files never are")
                if info.file_size > _SIZE_LIMITS[info.filename]:
                    raise ArchiveFormatError(f"{info.filename} has {info.file_size} bytes, more than any checkpoint's")
            yield archive
    except (zipfile.BadZipFile, RuntimeError, ValueError, EOFError, struct.error) as error:
        # A damaged directory may say anything: that files are encrypted, begin before the archive or are of a newer zip.
        raise ArchiveFormatError(f"{name} is not a readable archive ({error}): download it again") from error
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
        raise ArchiveFormatError(
            f"{name} is not a readable archive (its directory is damaged): download it again"
        ) from error


def _manifest(archive: zipfile.ZipFile) -> Manifest:
    document = archive.read(MANIFEST)
    try:
        return Manifest.model_validate_json(document)
    except ValidationError as error:
        if lacking := missing(_extensions_in(document), versions()):
            sources = "".join(f" ({one.source})" for one in lacking if one.source)
            raise ArchiveExtensionError(
                f"this policy needs {wording(lacking)}, which is not installed here: install it{sources}, and try again"
            ) from None
        raise ArchiveFormatError(
            f"{MANIFEST} is not as this release knows it; a newer release may have written it: {error}"
        ) from error


def _extensions_in(document: bytes) -> tuple[UsedExtension, ...]:
    """The extensions that a manifest names, whatever else cannot be read of it."""
    try:
        return _EXTENSIONS.validate_python(json.loads(document)["training"]["extensions"])
    except (ValidationError, ValueError, LookupError, TypeError):
        return ()


def _member(archive: zipfile.ZipFile, manifest: Manifest, name: str) -> bytes:
    """A file of the archive, exactly as the manifest promises it."""
    entry = manifest.files.get(name)
    if entry is None or name not in archive.namelist():
        raise ArchiveIntegrityError(f"{name} is missing: this archive holds a policy only and cannot be resumed")
    data = archive.read(name)
    if len(data) != entry.size or hashlib.sha256(data).hexdigest() != entry.sha256:
        raise ArchiveIntegrityError(f"{name} is not the file that the manifest describes: download the checkpoint again")
    return data


def _arrays(data: bytes, name: str) -> dict[str, NDArray[np.generic]]:
    try:
        return dict(load_safetensors(data))
    except (SafetensorError, ValueError, KeyError) as error:
        raise ArchiveIntegrityError(f"{name} is not a safetensors file: {error}") from error


def _weights(archive: zipfile.ZipFile, manifest: Manifest) -> dict[str, NDArray[np.float32]]:
    weights = _arrays(_member(archive, manifest, POLICY), POLICY)
    training, actions = manifest.training, action_layout(manifest.training.task.robot)
    expected = policy_shapes(training.algorithm.network, inputs_of(training.task), actions)
    found = {name: array.shape for name, array in weights.items()}
    if found != expected or any(array.dtype != np.float32 for array in weights.values()):
        raise ArchiveIntegrityError(f"{POLICY} does not hold the float32 arrays of its network: {expected}")
    return {name: np.asarray(array, np.float32) for name, array in weights.items()}


def _json(model: BaseModel) -> bytes:
    return model.model_dump_json(indent=2).encode()
