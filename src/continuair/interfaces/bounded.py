"""Bounds on the unpacked size of logs: a small file can declare gigabytes."""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from continuair.errors import InputError
from continuair.files import check_regular

_MAGIC, _CHUNK = b"\x89MCAP0\r\n", 0x06
_ZSTD = b"\x28\xb5\x2f\xfd"

_LARGEST = 1 << 28
"""Bytes that a chunk may unpack to; writers make chunks of about a megabyte."""

LARGEST_MESSAGE = 1 << 24
"""Largest message [bytes]; poses, wrenches and numbers are read."""

LARGEST_DEFINITION = 1 << 18
"""Largest definition of a type in a bag [bytes]."""

_LARGEST_METADATA = 1 << 19
"""Largest metadata.yaml of a bag [bytes]; about 60,000 are read per second."""

_LARGEST_FILE, _LARGEST_RATIO = 1 << 28, 100
"""A packed file may unpack to the larger of this size [bytes] and this ratio."""

_MOST_FIELDS = 1 << 20
"""Most fields of all subscribed topics of a ULog; a message holds at most 65,535 bytes."""

_DEEPEST = 16
"""Deepest nesting of formats in a ULog."""

_ULOG_HEADER = 16

_OF_DEFINITIONS, _FIRST_OF_DATA, _OF_DATA = "BFIMPQ", "ALC", "IMPQALCDOS"
"""Kinds of messages in a ULog's first section, that begin the second, and in the second."""

_LONGEST_UNKNOWN = 10_000
"""Largest message of an unknown kind [bytes]."""

_PIECE = 1 << 20


def check_chunks(file: Path) -> None:
    """Raise InputError for an MCAP file with a chunk that is too large.

    A file that is not complete MCAP is left to its reader.
    """
    with open(file, "rb") as stream:
        if stream.read(len(_MAGIC)) == _MAGIC:
            for compression, packed in _chunks(stream):
                if _unpacks_beyond(compression, packed):
                    raise InputError(
                        "data",
                        f"has a chunk that unpacks to more than {_LARGEST >> 20} MiB",
                        "write it with smaller chunks",
                    )


def check_bag_folder(folder: Path) -> None:
    """Raise InputError for a bag's folder that is not safe to read.

    Refused are pipes and devices, a metadata.yaml that is too large, and packed files that unpack
    to too much.
    """
    for file in sorted(folder.iterdir()):
        check_regular("data", file)
        if file.is_file() and _file_unpacks_beyond(file):
            raise InputError(
                "data",
                f"has a file that unpacks to more than {_LARGEST_RATIO} times its size",
                "unpack it first, if you trust it",
            )
    described = folder / "metadata.yaml"
    if described.is_file() and described.stat().st_size > _LARGEST_METADATA:
        raise InputError(
            "data",
            f"has a metadata.yaml of more than {_LARGEST_METADATA >> 10} KiB",
            "give a bag that ROS 2 wrote",
        )


def _file_unpacks_beyond(file: Path) -> bool:
    """Return whether a packed file unpacks to too much, found piece by piece."""
    most, found = max(_LARGEST_FILE, _LARGEST_RATIO * file.stat().st_size), 0
    with open(file, "rb") as stream:
        if stream.read(len(_ZSTD)) != _ZSTD:
            return False
        stream.seek(0)
        unpack = _decompressor("zstd")
        while data := stream.read(_PIECE):
            while data or not (unpack.eof or unpack.needs_input):
                try:
                    found += len(unpack.decompress(data, max_length=_PIECE))
                except Exception:  # damaged, which its reader reports
                    return False
                data = b""
                if found > most:
                    return True
                if unpack.eof:
                    data, unpack = unpack.unused_data, _decompressor("zstd")
    return False


def check_ulog(data: bytes) -> None:
    """Raise InputError for a ULog with damaged messages, on which its reader may never return.

    Also raises it if topics have more fields than messages can hold. A file that is not a ULog is
    left to its reader.
    """
    formats: dict[str, list[tuple[str, int]]] = {}
    counted: dict[str, int] = {}
    fields, known = 0, _OF_DEFINITIONS
    for kind, size, content in _messages(data):
        known = _OF_DATA if kind in _FIRST_OF_DATA else known
        odd = kind == "\0" or size == 0 or size > _LONGEST_UNKNOWN
        if kind not in known and odd:
            raise InputError("data", "holds damaged messages", "download the log again")
        if kind == "F":
            name, _, declared = content.decode("utf-8", "replace").partition(":")
            formats[name] = [_field(each) for each in declared.split(";") if each]
            counted.clear()
        elif kind == "A":
            name = content[3:].decode("utf-8", "replace")
            fields += _count(name, formats, counted, 0)
            if fields > _MOST_FIELDS:
                raise InputError(
                    "data",
                    "declares topics of more fields than their messages can hold",
                    "download the log again",
                )


def _messages(data: bytes) -> Iterator[tuple[str, int, bytes]]:
    """Yield kind, size and content of each message of a ULog, in its reader's order.

    The first message holds the offsets of data that were appended after a crash.
    """
    at, ends = _ULOG_HEADER, [len(data)]
    if data[at + 2 : at + 3] == b"B" and len(data) >= at + 43:
        offsets = struct.unpack_from("<3Q", data, at + 19)
        ends = [*(offset for offset in offsets if offset), *ends]
    for end in ends:
        while at + 3 <= len(data):
            size, kind = struct.unpack_from("<HB", data, at)
            if at + 3 + size > end < len(data):
                break
            yield chr(kind), size, data[at + 3 : at + 3 + size]
            at += 3 + size
        at = end


def _field(declared: str) -> tuple[str, int]:
    """Return type and size of a field, such as `float[3] x`."""
    kind, _, size = declared.split(" ")[0].partition("[")
    size = size.rstrip("]")
    return kind, int(size) if size.isascii() and size.isdecimal() and len(size) < 9 else 1


def _count(
    name: str, formats: dict[str, list[tuple[str, int]]], counted: dict[str, int], depth: int
) -> int:
    """Return the number of fields of a format, nested ones included; too many if recursive."""
    if depth > _DEEPEST:
        return _MOST_FIELDS + 1
    if name not in counted:
        counted[name] = sum(
            max(size, 1) * (_count(kind, formats, counted, depth + 1) if kind in formats else 1)
            for kind, size in formats.get(name, [])
        )
    return counted[name]


def _chunks(stream: IO[bytes]) -> Iterator[tuple[str, bytes]]:
    """Yield compression and content of each chunk."""
    while len(head := stream.read(9)) == 9:
        code, size = struct.unpack("<BQ", head)
        if code != _CHUNK:
            stream.seek(size, 1)
            continue
        fixed = stream.read(32)
        if len(fixed) < 32 or size < 40:
            return
        (name,) = struct.unpack_from("<I", fixed, 28)
        if name > size - 40:
            return
        compression = stream.read(name).decode("ascii", "replace")
        (length,) = struct.unpack("<Q", stream.read(8).ljust(8, b"\0"))
        packed = min(length, size - 40 - name)
        yield compression, stream.read(packed)
        stream.seek(size - 40 - name - packed, 1)


def _unpacks_beyond(compression: str, packed: bytes) -> bool:
    """Return whether a chunk unpacks to more than the largest, found piece by piece."""
    try:
        return sum(map(len, _pieces(compression, packed, _LARGEST))) > _LARGEST
    except Exception:  # damaged, which its reader reports
        return False


def unpacked(compression: str, packed: bytes, most: int) -> bytes | None:
    """Return unpacked data, or None if they are larger than `most` bytes.

    Raises the library's exceptions for damaged data.
    """
    pieces = list(_pieces(compression, packed, most))
    return None if sum(map(len, pieces)) > most else b"".join(pieces)


def _pieces(compression: str, packed: bytes, most: int) -> Iterator[bytes]:
    """Yield unpacked frames in pieces, up to the piece that exceeds `most` bytes."""
    found = 0
    while packed and compression in ("zstd", "lz4"):
        unpack = _decompressor(compression)
        data = packed
        while not unpack.eof:
            piece = unpack.decompress(data, max_length=_PIECE)
            found, data = found + len(piece), b""
            yield piece
            if found > most or (not piece and unpack.needs_input):
                return
        packed = unpack.unused_data or b""


def _decompressor(compression: str) -> Any:
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return LZ4FrameDecompressor()
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd.ZstdDecompressor()
