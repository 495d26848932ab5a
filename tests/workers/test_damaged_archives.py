"""Policy files that are damaged, or that somebody made up: each is read as it was written, or refused as an archive."""

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workers.checkpoints import check_archive, read_checkpoint, read_manifest, read_policy
from workers.errors import ArchiveError, ArchiveFormatError
from workers.manifest import MANIFEST

few = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@pytest.fixture
def whole(make_checkpoint: Callable[..., Path]) -> bytes:
    return make_checkpoint().read_bytes()


def read_all(path: Path) -> None:
    """Whatever reads an archive: nothing but the one kind of error may come out of it."""
    for read in (read_manifest, read_policy, read_checkpoint):
        try:
            read(path)
        except ArchiveError:
            continue
    with path.open("rb") as file:
        try:
            check_archive(file, path.name)
        except ArchiveError:
            return


@pytest.mark.parametrize(
    ("place", "new"),
    [(8, b"\x01"), (8, b"\x20"), (6, b"\x40"), (10, b"\x09"), (42, b"\xff\xff\xff\x7f"), (30, b"\xff\xff")],
    ids=["encrypted", "patched", "newer", "unknown compression", "far away", "endless extra field"],
)
def test_a_directory_that_says_what_is_not_is_refused(whole: bytes, tmp_path: Path, place: int, new: bytes) -> None:
    entry = whole.index(b"PK\x01\x02")
    path = tmp_path / "damaged.zip"
    path.write_bytes(whole[: entry + place] + new + whole[entry + place + len(new) :])
    with pytest.raises(ArchiveFormatError):
        read_policy(path)


@few
@given(data=st.data())
def test_an_archive_with_other_bytes_in_it_is_read_or_refused(whole: bytes, tmp_path: Path, data: st.DataObject) -> None:
    damaged = bytearray(whole)
    for _ in range(data.draw(st.integers(1, 4))):
        # The directory at the end says where everything is: it is hit as often as all the rest.
        start = data.draw(st.integers(0, len(whole) - 1) | st.integers(len(whole) - 400, len(whole) - 1))
        new = data.draw(st.binary(min_size=1, max_size=8))
        damaged[start : start + len(new)] = new
    path = tmp_path / "damaged.zip"
    path.write_bytes(damaged)
    read_all(path)


@few
@given(data=st.data())
def test_an_archive_that_ends_early_or_goes_on_is_read_or_refused(whole: bytes, tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "cut.zip"
    cut = data.draw(st.integers(0, len(whole)))
    path.write_bytes(whole[:cut] + data.draw(st.binary(max_size=64)))
    read_all(path)


@few
@given(data=st.data())
def test_a_manifest_that_says_anything_else_is_read_or_refused(whole: bytes, tmp_path: Path, data: st.DataObject) -> None:
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    place = manifest = json.loads(members[MANIFEST])
    key = data.draw(st.sampled_from(sorted(manifest)))
    while isinstance(place[key], dict) and place[key] and data.draw(st.booleans()):
        place = place[key]
        key = data.draw(st.sampled_from(sorted(place)))
    place[key] = data.draw(json_values)
    path = tmp_path / "made-up.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, content in (members | {MANIFEST: json.dumps(manifest).encode()}).items():
            archive.writestr(name, content)
    read_all(path)
