"""MCAP files whose chunks unpack to no more than they may: a small file can declare gigabytes."""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from continuair.errors import InputError

_MAGIC, _CHUNK = b"\x89MCAP0\r\n", 0x06

_LARGEST = 1 << 28
"""Bytes that a chunk may unpack to; writers make chunks of about a megabyte."""

_PIECE = 1 << 20


def check_chunks(path: Path) -> None:
    """Raise InputError for an MCAP file, or a folder of them, with a chunk that is too large.

    A file that is not complete MCAP is left to its reader.
    """
    for file in sorted(path.glob("*.mcap")) if path.is_dir() else [path]:
        with open(file, "rb") as stream:
            if stream.read(len(_MAGIC)) == _MAGIC:
                for compression, packed in _chunks(stream):
                    if _unpacks_beyond(compression, packed):
                        raise InputError(
                            f"has a chunk that unpacks to more than {_LARGEST >> 20} MiB; write it "
                            "with smaller chunks."
                        )


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
    found = 0
    while packed and compression in ("zstd", "lz4"):
        unpack = _decompressor(compression)
        data = packed
        while not unpack.eof:
            try:
                piece = unpack.decompress(data, max_length=_PIECE)
            except Exception:  # damaged, which its reader reports
                return False
            found, data = found + len(piece), b""
            if found > _LARGEST:
                return True
            if not piece and unpack.needs_input:
                return False
        packed = unpack.unused_data or b""
    return False


def _decompressor(compression: str) -> Any:
    if compression == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return LZ4FrameDecompressor()
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd.ZstdDecompressor()
