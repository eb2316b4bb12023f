"""ROS 2 bags, opened for some of their topics whatever the others hold.

`rosbags` alone reads the types of all topics, or of none.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
    Nodetype,
)
from rosbags.rosbag2 import Reader, ReaderError, reader, storage_mcap
from rosbags.rosbag2.metadata import ReaderMetadata
from rosbags.rosbag2.reader import DirectoryReader
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

from continuair.errors import InputError
from continuair.files import check_regular, printed
from continuair.interfaces.bounded import (
    LARGEST_DEFINITION,
    LARGEST_MESSAGE,
    check_bag_folder,
    check_chunks,
    unpacked,
)

_FORMATS = {
    "ros2msg": MessageDefinitionFormat.MSG,
    "ros2idl": MessageDefinitionFormat.IDL,
    "omgidl": MessageDefinitionFormat.IDL,
}
_UNKNOWN = MessageDefinition(MessageDefinitionFormat.NONE, "")
_IDL_SEPARATOR = "=" * 80 + "\n"

_LIMIT_LENGTH = 0
"""SQLITE_LIMIT_LENGTH: largest value in a database [bytes]."""

_MOST_ENTRIES = 1 << 16
"""Largest total size of the arrays of a type that a bag defines."""


class _Schemas(dict[int, Any]):
    """Schemas of an MCAP file; those in unknown languages lose their text."""

    def __setitem__(self, key: int, schema: Any) -> None:
        if schema.encoding not in _FORMATS:
            schema = schema._replace(encoding="", data="")
        super().__setitem__(key, schema)


class _Mcap(McapReader):  # type: ignore[misc]
    def __init__(self, path: Any) -> None:
        super().__init__(path)
        self.schemas = _Schemas()

    def open(self) -> None:
        check_regular("data", Path(self.path))
        check_chunks(Path(self.path))
        super().open()


class _Sqlite(Sqlite3Reader):  # type: ignore[misc]
    def open(self) -> None:
        check_regular("data", Path(self.path))
        super().open()

    def _open(self) -> None:
        """Open the database as the parent does, but drop definitions in unknown languages."""
        assert self.dbconn is not None
        self.dbconn.limit(_LIMIT_LENGTH, LARGEST_MESSAGE)
        rows = self.dbconn.execute
        tables = {name for (name,) in rows("SELECT name FROM sqlite_master WHERE type='table'")}
        if not {"messages", "topics"} <= tables:
            raise ReaderError(f"Database {self.path} has no messages and topics.")
        definitions: dict[str, MessageDefinition] = {}
        if "message_definitions" in tables:
            for name, encoding, text in rows(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            ):
                if encoding in _FORMATS:
                    definitions[name] = MessageDefinition(_FORMATS[encoding], text)
        counts = dict(rows("SELECT topic_id, count(*) FROM messages GROUP BY topic_id").fetchall())
        self.connections = [
            Connection(
                number,
                topic,
                kind,
                definitions.get(kind, _UNKNOWN),
                "",
                counts.get(number, 0),
                ConnectionExtRosbag2(form, []),
                self,
            )
            for number, topic, kind, form in rows(
                "SELECT id, name, type, serialization_format FROM topics ORDER BY id"
            )
        ]
        ((first, last, count),) = rows(
            "SELECT min(timestamp), max(timestamp), count(*) FROM messages"
        )
        first, last = (first, last + 1) if count else (2**63 - 1, 0)
        length = last - first if count else 0
        self.metadata = ReaderMetadata(length, first, last, count, None, None, None, None)


class _Folder(DirectoryReader):  # type: ignore[misc]
    STORAGE_PLUGINS = {"mcap": _Mcap, "sqlite3": _Sqlite}

    def open(self) -> None:
        check_bag_folder(Path(self.path))
        super().open()


class _Reader(Reader):  # type: ignore[misc]
    STORAGE_PLUGINS = {"dir": _Folder, ".mcap": _Mcap, ".db3": _Sqlite}


class Bag:
    """An open bag. start: time of its first message [ns]; kinds: types of its topics by name."""

    def __init__(self, reader: Reader) -> None:
        self._reader, self.start = reader, reader.start_time
        self.kinds = {each.topic: each.msgtype for each in reader.connections}
        # Messages that are packed one by one are unpacked here, with a bound.
        self._packed = reader.compression_mode == "message"
        if self._packed:
            reader.storage.metadata = reader.storage.metadata._replace(compression_mode=None)
        self._store = get_typestore(Stores.EMPTY)
        self._standard = get_typestore(Stores.LATEST)

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Yield time [ns] and content of each message of a topic.

        Raises InputError, and the readers' exceptions for damaged files.
        """
        connections = [each for each in self._reader.connections if each.topic == topic]
        for kind in {each.msgtype: each for each in connections}.values():
            self._define(kind)
        for connection, received, raw in self._reader.messages(connections=connections):
            content = unpacked("zstd", raw, LARGEST_MESSAGE) if self._packed else raw
            if content is None or len(content) > LARGEST_MESSAGE:
                raise InputError(
                    "data",
                    f"has a message of {topic} of more than {LARGEST_MESSAGE >> 20} MiB",
                    "name a topic of poses or numbers",
                )
            standard = connection.msgtype in self._standard.fielddefs
            store = self._standard if standard else self._store
            yield received, store.deserialize_cdr(content, connection.msgtype)

    def _define(self, connection: Connection) -> None:
        """Register the definition of a type that is not part of ROS 2."""
        kind, definition = connection.msgtype, connection.msgdef
        known = self._standard.fielddefs
        if kind in known or kind in self._store.fielddefs:
            return
        text = definition.data
        if definition.format == MessageDefinitionFormat.NONE or len(text) > LARGEST_DEFINITION:
            told = printed(str(kind))
            raise InputError(
                "data",
                f"has messages of {told} ({connection.topic}), which neither ROS 2 nor the bag "
                "defines",
                "name a topic of another type",
            )
        found: dict[str, Any] = {}
        if definition.format == MessageDefinitionFormat.MSG:
            found |= get_types_from_msg(text, kind)
        elif text.startswith(f"{_IDL_SEPARATOR}IDL: "):
            for part in text.split(_IDL_SEPARATOR)[1:]:
                found |= get_types_from_idl(part.split("\n", 1)[1])
        else:
            found |= get_types_from_idl(text)
        _check_sizes(kind, found)
        self._store.register(found)


def _check_sizes(kind: str, types: dict[str, Any]) -> None:
    """Raise InputError for types whose short messages need much time or memory."""
    entries = 0
    for _, fields in types.values():
        entries += len(fields) if fields else _MOST_ENTRIES  # of nothing, any number fit
        for _, (node, inside) in fields:
            if node == Nodetype.ARRAY:
                entries += inside[1]
    if entries >= _MOST_ENTRIES:
        told = printed(str(kind))
        raise InputError(
            "data",
            f"has messages of {told}, whose definition has an empty part, or arrays of too many "
            "entries",
            "name a topic of another type",
        )


@contextmanager
def opened(file: Path) -> Iterator[Bag]:
    """Open a bag's folder or file; raises InputError, and the readers' exceptions."""
    with _without_qos():
        found = _Reader(file)
        found.open()
    try:
        yield Bag(found)
    finally:
        found.close()


@contextmanager
def _without_qos() -> Iterator[None]:
    """Open bags without their topics' quality of service, whose YAML may take seconds."""
    kept = storage_mcap.get_qos, reader.parse_qos
    setattr(storage_mcap, "get_qos", lambda _: [])  # noqa: B010  # as mypy knows it
    setattr(reader, "parse_qos", lambda _: [])  # noqa: B010
    try:
        yield
    finally:
        setattr(storage_mcap, "get_qos", kept[0])  # noqa: B010
        setattr(reader, "parse_qos", kept[1])  # noqa: B010
