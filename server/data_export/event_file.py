"""TensorBoard's event files, written without TensorBoard: scalars a few thousand records at a time, and one text.

A record is the length of an `Event` (8 bytes, little-endian), the masked CRC-32C of these, the event, and its own.
Of the protocol buffers only this is needed:

    Event: wall_time = 1 (double), step = 2 (int64), file_version = 3 (string), summary = 5 (Summary)
    Summary: value = 1 (Value)
    Value: tag = 1 (string), simple_value = 2 (float); of a text: tensor = 8 (TensorProto), metadata = 9 (SummaryMetadata)
    TensorProto: dtype = 1 (7 for strings), string_val = 8 (bytes)
    SummaryMetadata: plugin_data = 1, of which plugin_name = 1 (string); data_class = 4 (2 for tensors)
"""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from server.metrics.points import Points

# A field's number and how it is written, as protocol buffers have it before each field.
_WALL_TIME, _STEP, _FILE_VERSION, _SUMMARY = b"\x09", b"\x10", b"\x1a", b"\x2a"
_VALUE, _TAG, _SIMPLE_VALUE = b"\x0a", b"\x0a", b"\x15"
_TENSOR, _METADATA, _STRING_DTYPE, _STRING, _TENSOR_CLASS = b"\x42", b"\x4a", b"\x08\x07", b"\x42", b"\x20\x02"
_NOTE = b"mapless/thinned"
# From this version on steps may go back between series.
_VERSION = b"brain.Event:2"
_MAX_STEP_BYTES = 9

Bytes = NDArray[np.uint8]


def event_file(began: float, series: Iterable[tuple[str, Points]], note: str | None = None) -> Iterator[bytes]:
    """The points as an event file, block by block; what was not finite is nan.

    Args:
        began: when the run did, in seconds since the epoch.
        series: pieces of series by name, steps not negative.
        note: a text for who looks at them.
    """
    yield _records([_WALL_TIME, _doubles(np.array([began])), _FILE_VERSION, _sized(_VERSION)], 1)
    if note is not None:
        plugin = b"\x0a" + _sized(b"\x0a" + _sized(b"text")) + _TENSOR_CLASS
        tensor = _STRING_DTYPE + _STRING + _sized(note.encode())
        value = _TAG + _sized(_NOTE) + _TENSOR + _sized(tensor) + _METADATA + _sized(plugin)
        yield _records([_WALL_TIME, _doubles(np.array([began])), _SUMMARY, _sized(_VALUE + _sized(value))], 1)
    for name, points in series:
        tag = _TAG + _sized(name.encode())
        value = _VALUE + _varint(len(tag) + 5) + tag + _SIMPLE_VALUE
        summary = _SUMMARY + _varint(len(value) + 4) + value
        # Steps grow, so that those that take equally many bytes stand together, and so do events of one length.
        ends = np.searchsorted(points.steps, 1 << (7 * np.arange(1, _MAX_STEP_BYTES, dtype=np.int64)))
        start = 0
        for length, end in enumerate([*ends.tolist(), len(points)], start=1):
            if end > start:
                part = points[start:end]
                values = np.ascontiguousarray(part.values, "<f4").view(np.uint8).reshape(-1, 4)
                pieces: list[bytes | Bytes] = [
                    _WALL_TIME,
                    _doubles(part.times),
                    _STEP,
                    _varints(part.steps, length),
                    summary,
                    values,
                ]
                yield _records(pieces, len(part))
            start = end


def masked_crc32c(rows: Bytes) -> NDArray[np.uint32]:
    """The CRC-32C (Castagnoli) of each row of (n, length), rotated and shifted as TensorFlow's records have it; (n,)."""
    crc = np.full(len(rows), 0xFFFFFFFF, np.uint32)
    for column in rows.T:
        crc = _CRC_TABLE[(crc ^ column) & np.uint32(0xFF)] ^ (crc >> np.uint32(8))
    crc = ~crc
    return ((crc >> np.uint32(15)) | (crc << np.uint32(17))) + np.uint32(0xA282EAD8)


def _crc_table() -> NDArray[np.uint32]:
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ np.uint32(0x82F63B78), table >> 1).astype(np.uint32)
    return table


_CRC_TABLE = _crc_table()


def _records(pieces: list[bytes | Bytes], count: int) -> bytes:
    """`count` events of one length; a piece is the same in all of them, or has a row for each."""
    columns = [
        np.broadcast_to(np.frombuffer(piece, np.uint8), (count, len(piece))) if isinstance(piece, bytes) else piece
        for piece in pieces
    ]
    events = np.hstack(columns)
    length = np.frombuffer(events.shape[1].to_bytes(8, "little"), np.uint8)[None]
    head = np.hstack([length, _four_bytes(masked_crc32c(length))])
    return np.hstack([np.broadcast_to(head, (count, 12)), events, _four_bytes(masked_crc32c(events))]).tobytes()


def _doubles(numbers: NDArray[np.float64]) -> Bytes:
    return np.ascontiguousarray(numbers, "<f8").view(np.uint8).reshape(-1, 8)


def _four_bytes(numbers: NDArray[np.uint32]) -> Bytes:
    return numbers.astype("<u4").view(np.uint8).reshape(-1, 4)


def _varints(numbers: NDArray[np.int64], length: int) -> Bytes:
    """Numbers that take that many bytes in seven bits each, the lowest first, all but the last with the eighth bit set."""
    digits = (numbers[:, None] >> (7 * np.arange(length))) & 0x7F
    digits[:, :-1] |= 0x80
    return digits.astype(np.uint8)


def _varint(number: int) -> bytes:
    return _varints(np.array([number]), max(1, -(-number.bit_length() // 7))).tobytes()


def _sized(text: bytes) -> bytes:
    return _varint(len(text)) + text
