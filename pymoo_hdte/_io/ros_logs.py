"""Joint states in logs of ROS 2, rosbag2 (SQLite) and MCAP, as columns.

Containers are read here, within a `Budget`: the readers of the libraries expand whatever a chunk,
a file or a view of a database asks for. Messages are decoded by rosbags.
"""

from __future__ import annotations

import math
import re
import sqlite3
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte._io.budget import Budget
from pymoo_hdte.checks import InvalidInput

ENDINGS = {"rosbag2": (".db3",), "mcap": (".mcap",)}
"""Of files, by format. The folder of a rosbag2 holds one or several."""
TIME, STAMP = "time", "stamp"
"""Columns in s: since the first message, and since 1970 as files of one clock share it."""
QUANTITIES = ("position", "velocity", "effort")
_TYPE = "sensor_msgs/msg/JointState"

Library = Callable[[str], Any]
"""Imports a module or tells how to install it."""
Message = tuple[str, int, bytes]
"""Topic, time of the log in ns, and content."""


@dataclass
class _Topic:
    """What has been read of a topic: stamps in ns, a list of values for each column, and joints."""

    columns: list[array[float]]
    stamps: array[int] = field(default_factory=lambda: array("q"))
    joints: dict[str, None] = field(default_factory=dict)


def joint_columns(
    path: Path, names: Sequence[str], library: Library
) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    """Return columns of one topic, and the names of all that there are.

    Parameters
    ----------
    path : Path
        Of a file.
    names : sequence of str
        `TIME`, `STAMP`, or a joint and one of `QUANTITIES`, ``"elbow.position"``; with
        ``"/topic:"`` ahead where more than one topic has them.
    library : callable

    Returns
    -------
    columns : dict of str to ndarray, shape (n,)
        A row for each message that holds one of the joints; NaN where one is missing.
    there : list of str

    Raises
    ------
    InvalidInput
        For a file that is damaged or above its budget, or names of no or of several topics.
    """
    topics: dict[str, _Topic] = {}
    bare = [_without_topic(name) for name in names]
    wanted = [one.rpartition(".")[::2] for one in bare]
    budget, count = Budget.now(), 0
    try:
        decode = library("rosbags.typesys")
        types = decode.get_typestore(decode.Stores.ROS2_HUMBLE)
        for name, logged, content in _messages(path, library, budget):
            count += 1
            budget.check("rows", count, f"{path.name}: messages")
            _take(types.deserialize_cdr(content, _TYPE), logged, wanted, topics, name)
    except (InvalidInput, MemoryError):
        raise
    # Whatever bytes of a stranger make the libraries raise: they have no common base.
    except Exception as error:
        if isinstance(error, OSError) and not path.exists():
            raise
        allowed = "an intact log of ROS 2, not compressed as a whole"
        raise InvalidInput(path.name, f"{type(error).__name__}: {error}"[:200], allowed) from None
    there = []
    for title, one in topics.items():
        joints = [f"{joint}.{word}" for joint in one.joints for word in QUANTITIES]
        there += [f"{title}:{column}" for column in (TIME, STAMP, *joints)]
    found = [name for name, one in topics.items() if _has(one, names, bare, name)]
    if len(found) != 1:
        allowed = f"columns of one topic of joint states; there are {there}"
        raise InvalidInput(f"{path.name}: columns", list(names), allowed[:500])
    topic = topics[found[0]]
    stamps = np.array(topic.stamps, np.int64)
    times = {TIME: (stamps - stamps[0]) / 1e9, STAMP: stamps / 1e9}
    columns = zip(names, bare, topic.columns, strict=True)
    return {
        name: times[column] if column in times else np.array(values, float)
        for name, column, values in columns
    }, there


def _without_topic(name: str) -> str:
    return name.partition(":")[2] if name.startswith("/") else name


def _has(topic: _Topic, names: Sequence[str], bare: Sequence[str], title: str) -> bool:
    """Tell whether a topic has all columns with a number in them."""
    return all(
        name in (column, f"{title}:{column}")
        and (column in (TIME, STAMP) or not all(map(math.isnan, values)))
        for name, column, values in zip(names, bare, topic.columns, strict=True)
    ) and bool(topic.stamps)


def _take(
    state: Any,
    logged: int,
    wanted: Sequence[tuple[str, str]],
    topics: dict[str, _Topic],
    name: str,
) -> None:
    """Add a row to the topic of a message, unless it has none of the joints."""
    topic = topics.setdefault(name, _Topic([array("d") for _ in wanted]))
    places = {joint: place for place, joint in enumerate(state.name)}
    # A name for every joint: of more than anybody has, errors would be pages.
    for joint in state.name if len(topic.joints) < 100 else ():
        topic.joints.setdefault(str(joint))
    row = []
    for joint, quantity in wanted:
        values = getattr(state, quantity) if quantity in QUANTITIES else ()
        place = places.get(joint, len(values))
        row.append(float(values[place]) if place < len(values) else math.nan)
    if not all(map(math.isnan, row)):
        stamp = state.header.stamp
        # Publishers that set no stamp leave it 0.
        topic.stamps.append(int(stamp.sec) * 10**9 + int(stamp.nanosec) or logged)
        for column, value in zip(topic.columns, row, strict=True):
            column.append(value)


def _messages(path: Path, library: Library, budget: Budget) -> Iterator[Message]:
    """Yield the joint states of a file."""
    with path.open("rb") as file:
        start = file.read(16)
    return (
        _in_sqlite(path, budget)
        if start == b"SQLite format 3\0"
        else _in_mcap(path, library, budget)
    )


def _in_sqlite(path: Path, budget: Budget) -> Iterator[Message]:
    address = f"file:{quote(str(path.absolute()))}?mode=ro&immutable=1"
    base = sqlite3.connect(address, uri=True)
    try:
        base.execute("PRAGMA trusted_schema = OFF")
        tables = dict(base.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))
        for name in ("topics", "messages"):
            # A view, or a virtual table, may make rows without end.
            if not re.match(r"CREATE TABLE\b", str(tables.get(name)), re.IGNORECASE):
                raise ValueError(f"no table {name}")
        topics = {}
        for number, title, kind in base.execute("SELECT id, name, type FROM topics"):
            if kind == _TYPE:
                topics[number] = str(title)
            budget.check("rows", len(topics), f"{path.name}: topics")
        rows = base.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp")
        for number, logged, content in rows:
            if number in topics:
                yield topics[number], int(logged), bytes(memoryview(content))
    finally:
        base.close()


def _in_mcap(path: Path, library: Library, budget: Budget) -> Iterator[Message]:
    mcap, records = library("mcap.stream_reader"), library("mcap.records")
    data = path.read_bytes()
    # Of bytes in memory no more can be read than there are, whatever a length says.
    stream = mcap.StreamReader(BytesIO(data), emit_chunks=True, record_size_limit=len(data))
    kinds, channels = dict[int, str](), dict[int, str]()
    expanded = 0
    for outer in stream.records:
        inner = [outer]
        if isinstance(outer, records.Chunk):
            expanded += outer.uncompressed_size
            budget.check("bytes", expanded, f"{path.name}, expanded")
            plain = replace(outer, compression="", data=_expanded(outer, library))
            inner = mcap.breakup_chunk(plain, validate_crc=True)
        for record in inner:
            if isinstance(record, records.Schema):
                kinds[record.id] = record.name
            elif isinstance(record, records.Channel):
                if kinds.get(record.schema_id) == _TYPE and record.message_encoding == "cdr":
                    channels[record.id] = record.topic
            elif isinstance(record, records.Message) and record.channel_id in channels:
                yield channels[record.channel_id], record.log_time, record.data


def _expanded(chunk: Any, library: Library) -> bytes:
    """Return the content of a chunk; `ValueError` if it is not as long as it says."""
    size, data = chunk.uncompressed_size, chunk.data
    if chunk.compression == "zstd":
        reader = library("zstandard").ZstdDecompressor().stream_reader(BytesIO(data))
        data = reader.read(size + 1)
    elif chunk.compression == "lz4":
        data = library("lz4.frame").LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    elif chunk.compression:
        raise ValueError(f"compression {chunk.compression!r}")
    if len(data) != size:
        raise ValueError("a chunk has other bytes than it says")
    return bytes(data)
