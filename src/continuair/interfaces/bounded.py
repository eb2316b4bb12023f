"""Logs of others that unpack to no more than they may: a small file can declare gigabytes."""

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
"""Bytes of a message of what is read: poses, wrenches and numbers."""

LARGEST_DEFINITION = 1 << 18
"""Bytes of the definition of a type in a bag."""

_LARGEST_METADATA = 1 << 19
"""Bytes of the description of a bag's folder, of which some 60,000 are read in a second."""

_LARGEST_FILE, _LARGEST_RATIO = 1 << 28, 100
"""What a packed file may unpack to: so many bytes, or so many times its own."""

_MOST_FIELDS = 1 << 20
"""Of all the topics that a ULog subscribes to; a message holds 65,535 bytes at most."""

_DEEPEST = 16
"""Of formats in formats of a ULog."""

_ULOG_HEADER = 16

_OF_DEFINITIONS, _FIRST_OF_DATA, _OF_DATA = "BFIMPQ", "ALC", "IMPQALCDOS"
"""Kinds of messages that are in a ULog's two sections, and those that begin the second."""

_LONGEST_UNKNOWN = 10_000
"""Bytes of a message of a kind to come, at most."""

_PIECE = 1 << 20


def check_chunks(file: Path) -> None:
    """Raise InputError for an MCAP file with a chunk that is too large.

    What is no whole MCAP file is left for its reader to refuse.
    """
    with open(file, "rb") as stream:
        if stream.read(len(_MAGIC)) == _MAGIC:
            for compression, packed in _chunks(stream):
                if _unpacks_beyond(compression, packed):
                    raise InputError(
                        f"has a chunk that unpacks to more than {_LARGEST >> 20} MiB; write it "
                        "with smaller chunks."
                    )


def check_bag_folder(folder: Path) -> None:
    """Raise InputError for a bag's folder with a pipe or device in it, a description that is too
    large, or files packed as a whole that unpack to far more than they hold."""
    for file in sorted(folder.iterdir()):
        check_regular("data", file)
        if file.is_file() and _file_unpacks_beyond(file):
            raise InputError(
                f"has a file that unpacks to more than {_LARGEST_RATIO} times its size; unpack it "
                "first, if you trust it."
            )
    described = folder / "metadata.yaml"
    if described.is_file() and described.stat().st_size > _LARGEST_METADATA:
        raise InputError(
            f"has a metadata.yaml of more than {_LARGEST_METADATA >> 10} KiB; give a bag that "
            "ROS 2 wrote."
        )


def _file_unpacks_beyond(file: Path) -> bool:
    """Whether a file packed as a whole unpacks to more than it may, found piece by piece."""
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
                except Exception:  # damaged, which its reader tells
                    return False
                data = b""
                if found > most:
                    return True
                if unpack.eof:
                    data, unpack = unpack.unused_data, _decompressor("zstd")
    return False


def check_ulog(data: bytes) -> None:
    """Raise InputError for a ULog with a message that is none, over which its reader may stay for
    ever, or whose topics have more fields than messages can hold.

    What is no ULog is left for its reader to refuse.
    """
    formats: dict[str, list[tuple[str, int]]] = {}
    counted: dict[str, int] = {}
    fields, known = 0, _OF_DEFINITIONS
    for kind, size, content in _messages(data):
        known = _OF_DATA if kind in _FIRST_OF_DATA else known
        odd = kind == "\0" or size == 0 or size > _LONGEST_UNKNOWN
        if kind not in known and odd:
            raise InputError("holds damaged messages; download the log again.")
        if kind == "F":
            name, _, declared = content.decode("utf-8", "replace").partition(":")
            formats[name] = [_field(each) for each in declared.split(";") if each]
            counted.clear()
        elif kind == "A":
            name = content[3:].decode("utf-8", "replace")
            fields += _count(name, formats, counted, 0)
            if fields > _MOST_FIELDS:
                raise InputError(
                    "declares topics of more fields than their messages can hold; download the "
                    "log again."
                )


def _messages(data: bytes) -> Iterator[tuple[str, int, bytes]]:
    """Kind, size and content of each message of a ULog, as its reader meets them: what a crash has
    appended begins at offsets that the first message tells."""
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
    """Type and number of a field, as in float[3] x."""
    kind, _, size = declared.split(" ")[0].partition("[")
    size = size.rstrip("]")
    return kind, int(size) if size.isascii() and size.isdecimal() and len(size) < 9 else 1


def _count(
    name: str, formats: dict[str, list[tuple[str, int]]], counted: dict[str, int], depth: int
) -> int:
    """Fields of a format, those of formats in it among them; too many for what holds itself."""
    if depth > _DEEPEST:
        return _MOST_FIELDS + 1
    if name not in counted:
        counted[name] = sum(
            max(size, 1) * (_count(kind, formats, counted, depth + 1) if kind in formats else 1)
            for kind, size in formats.get(name, [])
        )
    return counted[name]


def _chunks(stream: IO[bytes]) -> Iterator[tuple[str, bytes]]:
    """Compression and content of each chunk."""
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
    """Whether a chunk unpacks to more than the largest, found piece by piece."""
    try:
        return sum(map(len, _pieces(compression, packed, _LARGEST))) > _LARGEST
    except Exception:  # damaged, which its reader tells
        return False


def unpacked(compression: str, packed: bytes, most: int) -> bytes | None:
    """Return what data unpack to, or None if that is more than so many bytes; raises what the
    library raises of damage."""
    pieces = list(_pieces(compression, packed, most))
    return None if sum(map(len, pieces)) > most else b"".join(pieces)


def _pieces(compression: str, packed: bytes, most: int) -> Iterator[bytes]:
    """What packed frames unpack to, no further than to the piece that makes it too large."""
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
