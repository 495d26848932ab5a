"""Files that are broken or meant to harm: each is refused with its reason, quickly, and nothing else happens."""

import json
import os
import time
import zlib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.arenas.files import load_arena, read_arena
from sim.arenas.files.limits import MAX_SDF_BYTES, MAX_TEXT_BYTES
from sim.config import MAX_OBSTACLES
from sim.errors import ArenaFileError, ArenaFormatError, ArenaLimitError, NoFreeSpaceError

# What "quickly" is, with room for a machine that does much else, seconds.
PATIENCE = 5.0

OWN = {"format": "mapless-arena/1", "name": "Lab", "width": 8.0, "height": 6.0}
MAP = {"image": "m.pgm", "resolution": 0.1, "origin": [0, 0, 0], "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.2}
HALL = b"P5 30 30 255\n" + b"\xff" * 900


def own(**changes: object) -> dict[str, bytes]:
    return {"a.yaml": json.dumps(OWN | changes).encode()}


def ros(content: bytes = HALL, **changes: object) -> dict[str, bytes]:
    return {"m.yaml": json.dumps(MAP | changes).encode(), "m.pgm": content}


def sdf(body: str) -> dict[str, bytes]:
    return {"w.world": f"<sdf version='1.6'><world name='w'>{body}</world></sdf>".encode()}


def model(geometry: str, pose: str = "0 0 0 0 0 0") -> str:
    return (
        f"<model name='m'><pose>{pose}</pose><link name='l'><collision name='c'><geometry>{geometry}</geometry>"
        "</collision></link></model>"
    )


def pillar(pose: str = "0 0 0 0 0 0", radius: str = "0.5") -> str:
    return model(f"<cylinder><radius>{radius}</radius><length>1</length></cylinder>", pose)


def png_header(width: int, height: int) -> bytes:
    """A PNG of a few bytes that claims to be huge."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return len(data).to_bytes(4) + kind + data + zlib.crc32(kind + data).to_bytes(4)

    header = width.to_bytes(4) + height.to_bytes(4) + bytes([8, 0, 0, 0, 0])
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 100)) + chunk(b"IEND", b"")


ENTITIES = b"<!DOCTYPE s [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;&a;&a;&a;'>]><sdf><world>&b;</world></sdf>"
EXTERNAL = b"<!DOCTYPE s [<!ENTITY a SYSTEM 'file:///etc/passwd'>]><sdf><world>&a;</world></sdf>"
ALIASES = b"a: &a [x, x, x]\nb: &b [*a, *a, *a]\nc: &c [*b, *b, *b]\n"

REFUSED = {
    "entity bomb": ({"w.world": ENTITIES}, ArenaFormatError, "entities"),
    "external entity": ({"w.world": EXTERNAL}, ArenaFormatError, "entities"),
    "not XML": ({"w.world": b"these are not the droids"}, ArenaFormatError, "XML"),
    "an empty file": ({"w.sdf": b""}, ArenaFormatError, "XML"),
    "XML in an unknown encoding": ({"w.sdf": b"<?xml version='1.0' encoding='klingon'?><sdf/>"}, ArenaFormatError, "XML"),
    "other XML": ({"w.sdf": b"<html/>"}, ArenaFormatError, "<world>"),
    "deep XML": ({"w.sdf": b"<a>" * 100_000}, ArenaLimitError, "deep"),
    "large XML": ({"w.sdf": b" " * (MAX_SDF_BYTES + 1)}, ArenaLimitError, "MiB"),
    "many obstacles in XML": (
        sdf("".join(pillar(f"{i % 50} {i // 50} 0 0 0 0") for i in range(MAX_OBSTACLES + 1))),
        ArenaLimitError,
        "obstacles",
    ),
    "a pose that is no number": (sdf(pillar("0 nan 0 0 0 0")), ArenaFormatError, "finite"),
    "a pose that is too short": (sdf(pillar("0 1")), ArenaFormatError, "6 finite numbers"),
    "a radius that is infinite": (sdf(pillar(radius="inf")), ArenaFormatError, "finite"),
    "a radius below zero": (sdf(pillar(radius="-1")), ArenaFormatError, "radius"),
    "a cylinder that leans": (sdf(pillar("0 0 0 0.5 0 0")), ArenaFormatError, "leans"),
    "a mesh": (sdf(model("<mesh><uri>a.dae</uri></mesh>")), ArenaFormatError, "mesh is not read"),
    "another file": (sdf("<include><uri>file:///etc/passwd</uri></include>"), ArenaFormatError, "another file"),
    "a world without obstacles": (sdf(""), ArenaFormatError, "no obstacle"),
    "obstacles too far apart": (sdf(pillar("-90 0 0 0 0 0") + pillar("90 0 0 0 0 0")), ArenaLimitError, "100 m"),
    "not YAML": ({"a.yaml": b"a: [1, 2"}, ArenaFormatError, "YAML"),
    "not text": ({"a.yaml": bytes(range(256))}, ArenaFormatError, "UTF-8"),
    "a list": ({"a.yaml": b"[1, 2]"}, ArenaFormatError, "key: value"),
    "YAML aliases": ({"a.yaml": ALIASES}, ArenaFormatError, "aliases"),
    "a YAML object": ({"a.yaml": b"a: !!python/object/apply:os.system [id]"}, ArenaFormatError, "YAML"),
    "deep YAML": ({"a.yaml": b"[" * 200_000}, ArenaLimitError, "deep"),
    "large YAML": ({"a.yaml": b"#" * (MAX_TEXT_BYTES + 1)}, ArenaLimitError, "MiB"),
    "many values": ({"a.yaml": b"a: [" + b"1," * 300_000 + b"]"}, ArenaLimitError, "values"),
    "another version": (own(format="mapless-arena/9"), ArenaFormatError, "mapless-arena/1"),
    "an unknown key": (own(gravity=9.81), ArenaFormatError, "gravity"),
    "a missing name": ({"a.yaml": b"format: mapless-arena/1"}, ArenaFormatError, "name"),
    "a number in quotes": (own(width="8"), ArenaFormatError, "width"),
    "a size that is no number": (
        {"a.yaml": b"{format: mapless-arena/1, name: a, width: .nan, height: 3.0}"},
        ArenaFormatError,
        "width",
    ),
    "a size that is infinite": (
        {"a.yaml": b"{format: mapless-arena/1, name: a, width: .inf, height: 3.0}"},
        ArenaFormatError,
        "width",
    ),
    "a huge number": (own(width=10**400), ArenaFormatError, "width"),
    "no size": (own(width=0.0), ArenaFormatError, "width"),
    "a circle without a size": (own(circles=[{"x": 0.0, "y": 0.0, "radius": 0.0}]), ArenaFormatError, "circles.0.radius"),
    "too many obstacles": (
        own(circles=[{"x": 0.0, "y": 0.0, "radius": 0.1}] * (MAX_OBSTACLES + 1)),
        ArenaFormatError,
        "circles",
    ),
    "a start outside": (own(start={"x": 5.0, "y": 0.0}), ArenaFormatError, "outside the walls"),
    "no free space": (own(boxes=[{"x": 0.0, "y": 0.0, "length": 8.0, "width": 6.0}]), NoFreeSpaceError, "square metres"),
    "a map without its image": ({"m.yaml": json.dumps(MAP).encode()}, ArenaFormatError, "m.pgm together"),
    "an image above its folder": (ros(image="../m.pgm"), ArenaFormatError, "leads elsewhere"),
    "an image anywhere": (ros(image="/etc/passwd"), ArenaFormatError, "leads elsewhere"),
    "an image with backslashes": (ros(image="..\\m.pgm"), ArenaFormatError, "leads elsewhere"),
    "zero resolution": (ros(resolution=0), ArenaFormatError, "resolution"),
    "a resolution that is no number": (
        {"m.yaml": json.dumps(MAP).replace("0.1", ".nan").encode(), "m.pgm": HALL},
        ArenaFormatError,
        "resolution",
    ),
    "an origin that is too short": (ros(origin=[0, 0]), ArenaFormatError, "origin"),
    "thresholds the wrong way round": (ros(free_thresh=0.7), ArenaFormatError, "below"),
    "an unknown mode": (ros(mode="raw"), ArenaFormatError, "mode"),
    "an image that is none": (ros(b"GIF89a"), ArenaFormatError, "PGM or PNG"),
    "an image cut short": (ros(HALL[:100]), ArenaFormatError, "PGM or PNG"),
    "an image that claims to be huge": (ros(b"P5 100000 100000 255\n"), ArenaLimitError, "pixels"),
    "a PNG that claims to be huge": (
        {"m.yaml": json.dumps(MAP | {"image": "m.png"}).encode(), "m.png": png_header(60_000, 60_000)},
        ArenaLimitError,
        "pixels",
    ),
    "a map without a free pixel": (ros(b"P5 30 30 255\n" + bytes(900)), ArenaFormatError, "free"),
    "a map of a cupboard": (ros(resolution=0.01), ArenaFormatError, "0.3 x 0.3 m"),
    "noise": (
        ros(b"P5 400 400 255\n" + b"".join(b"\xff\x00" * 200 + b"\xff" * 400 for _ in range(200))),
        ArenaLimitError,
        "ragged",
    ),
    "a zip": ({"a.yaml": b"PK\x03\x04" + bytes(100)}, ArenaFormatError, "unpack"),
    "a zip by name": ({"a.zip": b"PK\x03\x04"}, ArenaFormatError, "kind of file"),
    "nothing": ({}, ArenaFormatError, "0 files"),
    "two worlds": ({"a.world": b"", "b.world": b""}, ArenaFormatError, "2 files"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_it_is_refused_with_its_reason_in_no_time(case: str) -> None:
    files, error, reason = REFUSED[case]
    begin = time.process_time()
    with pytest.raises(error, match=reason) as caught:
        read_arena(files)
    assert time.process_time() - begin < PATIENCE
    assert len(str(caught.value)) < 1000


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=300), st.sampled_from(["a.yaml", "a.world", "a.json", "m.pgm", "m.png"]))
def test_random_bytes_are_refused_and_nothing_else(content: bytes, name: str) -> None:
    files = (
        {name: content}
        if not name.startswith("m.")
        else {"m.yaml": json.dumps(MAP | {"image": name}).encode(), name: content}
    )
    with pytest.raises(ArenaFileError):
        read_arena(files)


values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(["width", "name", "circles", "boxes", "start", "image", "resolution", "origin"]), values)
def test_a_field_that_holds_anything_is_an_arena_or_refused(field: str, value: object) -> None:
    for files in (own(**{field: value}), ros(HALL, **{field: value})):
        try:
            read_arena(files)
        except ArenaFileError as error:
            assert str(error)  # noqa: PT017


def test_a_gigabyte_on_disk_is_not_even_opened(tmp_path: Path) -> None:
    for name in ("a.yaml", "a.world", "a.png"):
        path = tmp_path / name
        with path.open("wb") as file:
            file.truncate(2**30)  # sparse: takes no room
        with pytest.raises(ArenaLimitError, match="1024 MiB"):
            load_arena(path)


@pytest.mark.parametrize("name", ["a.yaml", "a.world"])
def test_a_folder_and_a_pipe_are_no_files(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    with pytest.raises(ArenaFileError, match="no such file"):
        load_arena(tmp_path / name)
    os.mkfifo(tmp_path / f"pipe-{name}")
    with pytest.raises(ArenaFileError, match="no such file"):
        load_arena(tmp_path / f"pipe-{name}")
