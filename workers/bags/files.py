"""Opens the files that robots' recordings come in: MCAP, rosbag2's SQLite, or a folder of these packed up.

Nothing is unpacked beyond `MAX_UNPACKED_BYTES`, and of messages only those of `TYPES` are kept.
"""

import sqlite3
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import IO, BinaryIO

import lz4.frame
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from workers.errors import BagError
from workers.packed import UNPACKING_ERRORS, is_damage
from workers.wording import counted

MAX_UNPACKED_BYTES = 256 * 2**20
"""Of a recording, once it is unpacked."""

SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TWISTS = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
GOAL = "geometry_msgs/msg/PoseStamped"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
TYPES = (SCAN, ODOMETRY, *TWISTS, GOAL, TRANSFORMS)
"""Of the messages that are kept."""

_MCAP = b"\x89MCAP0\r\n"
_SQLITE = b"SQLite format 3\0"
_ZIP = b"PK\x03\x04"
_GZIP = b"\x1f\x8b"
_ZSTANDARD = b"\x28\xb5\x2f\xfd"
_ROS_1 = b"#ROSBAG"
_MOST_MEMBERS = 200
_MOST_MESSAGES = 2_000_000
_BLOCK = 2**20
_DAMAGED = "the recording is damaged: {}"
_FOREIGN = "{} is written in {!r}, and not in ROS 2's CDR: record it with ROS 2"
_FORMATS = "an .mcap file, a .db3 file, or the folder of a rosbag2 recording as .zip or .tar"


@dataclass(frozen=True)
class Raw:
    """A message as it was recorded.

    Attributes:
        at: when it was written down, seconds.
        data: CDR.
    """

    at: float
    data: bytes


@dataclass(frozen=True)
class Contents:
    """What stands in a recording.

    Attributes:
        types: of every topic, also those that are not kept.
        messages: of those topics that are.
        cut: whether it ends in the middle, as when a robot is switched off.
    """

    types: dict[str, str]
    messages: dict[str, list[Raw]]
    cut: bool


def read_contents(path: Path, scratch: Path) -> Contents:
    """Everything of `TYPES` that stands in a file.

    Args:
        path: of the file.
        scratch: a folder for what is unpacked.

    Raises:
        BagError: it is no such recording, damaged, or too large.
    """
    with path.open("rb") as file:
        begin = file.read(512)
    if begin.startswith(_ROS_1):
        raise BagError("this is a ROS 1 bag: convert it (rosbags-convert --src X.bag --dst X), and upload what comes out")
    if begin.startswith(_ZSTANDARD):
        raise BagError("this file is compressed as a whole: decompress it first (zstd -d)")
    parts = [path] if begin.startswith((_MCAP, _SQLITE)) else _unpacked(path, begin, scratch)
    reading = _Reading()
    for part in parts:
        with part.open("rb") as file:
            is_mcap = file.read(len(_MCAP)) == _MCAP
        (reading.mcap if is_mcap else reading.sqlite)(part)
    if not reading.types:
        raise BagError("the recording is empty: no message is in it")
    return Contents(reading.types, reading.messages, reading.cut)


def _unpacked(path: Path, begin: bytes, scratch: Path) -> list[Path]:
    """The recordings in an archive, in the order of their names."""
    try:
        if begin.startswith(_ZIP):
            with zipfile.ZipFile(path) as packed:
                found = _write_out({info.filename: partial(packed.open, info) for info in packed.infolist()}, scratch)
        elif begin.startswith(_GZIP) or begin[257:262] == b"ustar":
            with tarfile.open(path, "r:*") as tape:
                found = _write_out(
                    {each.name: partial(_opened, tape, each) for each in _first(tape) if each.isfile()}, scratch
                )
        else:
            raise BagError(f"this is no recording of ROS 2: choose {_FORMATS}")
    except UNPACKING_ERRORS as error:
        if not is_damage(error):
            raise
        raise BagError(_DAMAGED.format("the archive can't be unpacked")) from error
    if not found:
        raise BagError("no .mcap or .db3 file is in the archive: pack up the whole folder of the recording")
    return found


def _first(tape: tarfile.TarFile) -> Iterator[tarfile.TarInfo]:
    for number, member in enumerate(tape):
        if number >= _MOST_MEMBERS:
            raise BagError(f"the archive holds more than {_MOST_MEMBERS} files: pack up the folder of one recording")
        yield member


def _opened(tape: tarfile.TarFile, member: tarfile.TarInfo) -> IO[bytes]:
    file = tape.extractfile(member)
    assert file is not None
    return file


def _write_out(files: Mapping[str, Callable[[], IO[bytes]]], scratch: Path) -> list[Path]:
    """The recordings among the files of an archive, unpacked."""
    if len(files) > _MOST_MEMBERS:
        raise BagError(f"the archive holds more than {_MOST_MEMBERS} files: pack up the folder of one recording")
    recordings = sorted(name for name in files if name.endswith((".mcap", ".db3")))
    if not recordings and any(name.endswith((".zstd", ".zst")) for name in files):
        raise BagError("the files of this recording are compressed one by one: decompress them first (zstd -d)")
    budget = _Budget()
    found = []
    for number, name in enumerate(recordings):
        target = scratch / f"part-{number:03d}"
        with files[name]() as source, target.open("wb") as file:
            while block := source.read(_BLOCK):
                budget.spend(len(block))
                file.write(block)
        found.append(target)
    return found


def _decompressed(chunk: Chunk) -> bytes:
    """What is in a chunk; never more than it announces."""
    if chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=chunk.uncompressed_size + 1)
    elif chunk.compression == "zstd":
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as stream:
            data = stream.read(chunk.uncompressed_size + 1)
    else:
        data = chunk.data
    if len(data) != chunk.uncompressed_size or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
        raise ValueError("a chunk is not what it says")
    return bytes(data)


class _Budget:
    """Bytes that may still be unpacked."""

    def __init__(self) -> None:
        self._left = MAX_UNPACKED_BYTES

    def spend(self, count: int) -> None:
        """Unpack so many.

        Raises:
            BagError: they are too many.
        """
        self._left -= count
        if self._left < 0:
            raise BagError(
                f"the recording is larger than {MAX_UNPACKED_BYTES // 2**20} MiB once unpacked: record only what is needed "
                "(ros2 bag record /scan /odom /cmd_vel /goal_pose /tf /tf_static)"
            )


class _Reading:
    """Adds up what stands in the files of one recording."""

    def __init__(self) -> None:
        self.types: dict[str, str] = {}
        self.messages: dict[str, list[Raw]] = {}
        self.cut = False
        self._budget = _Budget()
        self._count = 0

    def _add(self, topic: str, nanoseconds: int, data: bytes) -> None:
        self._count += 1
        if self._count > _MOST_MESSAGES:
            raise BagError(f"the recording has more than {counted(_MOST_MESSAGES)} messages: upload a part of it")
        self.messages.setdefault(topic, []).append(Raw(1e-9 * nanoseconds, data))

    def mcap(self, path: Path) -> None:
        """A file in MCAP."""
        schemas: dict[int, Schema] = {}
        topics: dict[int, Channel] = {}
        with path.open("rb") as file:
            try:
                for record in self._records(file):
                    if isinstance(record, Schema):
                        schemas[record.id] = record
                    elif isinstance(record, Channel):
                        topics[record.id] = record
                        schema = schemas.get(record.schema_id)
                        self.types[record.topic] = schema.name if schema else "no type"
                    elif isinstance(record, Message):
                        topic = topics[record.channel_id].topic
                        if self.types[topic] in TYPES:
                            self._add(topic, record.log_time, record.data)
            except EndOfFile:
                # Whoever recorded it was stopped; what came before is good.
                self.cut = True
            except (McapError, ValueError, KeyError, struct.error, UnicodeDecodeError, RuntimeError) as error:
                raise BagError(_DAMAGED.format("its MCAP can't be read")) from error
            except Exception as error:
                # The decompressors' errors share no base but this.
                if type(error).__module__.partition(".")[0] not in ("zstandard", "lz4"):
                    raise
                raise BagError(_DAMAGED.format("a part of its MCAP can't be decompressed")) from error
        foreign = [
            topic for topic in topics.values() if self.types[topic.topic] in TYPES and topic.message_encoding != "cdr"
        ]
        if foreign:
            raise BagError(_FOREIGN.format(foreign[0].topic, foreign[0].message_encoding))

    def _records(self, file: BinaryIO) -> Iterator[McapRecord]:
        for record in StreamReader(file, emit_chunks=True, record_size_limit=MAX_UNPACKED_BYTES).records:
            if not isinstance(record, Chunk):
                yield record
                continue
            self._budget.spend(record.uncompressed_size)
            yield from breakup_chunk(replace(record, compression="", data=_decompressed(record)))

    def sqlite(self, path: Path) -> None:
        """A file as rosbag2's storage plugin sqlite3 writes it."""
        try:
            connection = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
            try:
                connection.execute("PRAGMA trusted_schema = OFF")
                tables = {row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
                if not {"topics", "messages"} <= tables:
                    raise BagError("this is a SQLite file, but no rosbag2 recording: it has no topics and messages")
                self._rows(connection)
            finally:
                connection.close()
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise BagError(_DAMAGED.format("its SQLite file can't be read")) from error

    def _rows(self, connection: sqlite3.Connection) -> None:
        kept: dict[int, str] = {}
        for topic_id, topic, kind, encoding in connection.execute(
            "SELECT id, name, type, serialization_format FROM topics LIMIT 10000"
        ):
            self.types[str(topic)] = str(kind)
            if kind in TYPES:
                if encoding != "cdr":
                    raise BagError(_FOREIGN.format(topic, encoding))
                kept[topic_id] = str(topic)
        for topic_id, nanoseconds, data in connection.execute(
            "SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp"
        ):
            if topic_id in kept:
                self._budget.spend(len(data))
                self._add(kept[topic_id], int(nanoseconds), bytes(data))
