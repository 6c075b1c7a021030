"""Joint states in rosbag2 and MCAP become columns, and any bytes a clear refusal."""

import contextlib
import sqlite3
import sys
import tracemalloc

import numpy as np
import pytest

from pymoo_hdte._io.tables import Channel, TableLayout, read_table
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import read_rig

rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="rosbags is not installed (extra ros)")
typesys = pytest.importorskip("rosbags.typesys")
mcap_writer = pytest.importorskip("mcap.writer", reason="mcap is not installed (extra ros)")

TYPES = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
KIND = "sensor_msgs/msg/JointState"
COUNT, START = 300, 1_700_000_000
TIME = np.arange(COUNT) * 0.002
WAVE, PUSH = np.sin(9.0 * TIME), np.cos(5.0 * TIME)
FORMS = ("rosbag2", "mcap")


def state(i, names=("wrist", "elbow"), effort=True, stamped=True):
    """Return a message: the wave is the position of the elbow."""
    message = TYPES.types[KIND]
    stamp = TYPES.types["builtin_interfaces/msg/Time"]
    nanoseconds = round(1e9 * TIME[i])
    when = stamp(START + nanoseconds // 10**9, nanoseconds % 10**9) if stamped else stamp(0, 0)
    header = TYPES.types["std_msgs/msg/Header"](when, "base")
    values = {"wrist": 3.0, "elbow": WAVE[i], "base": 1.0}
    position = np.array([values[name] for name in names])
    pushes = np.full(len(names), PUSH[i]) if effort else np.array([])
    return message(header, list(names), position, 2.0 * position, pushes)


def states(topic="/joint_states", count=COUNT, **options):
    """Return messages with their times of the log, which lag by 5 ms."""
    return [
        (topic, START * 10**9 + round(1e9 * TIME[i]) + 5_000_000, state(i, **options))
        for i in range(count)
    ]


def write_rosbag2(path, messages, plugin=rosbag2.StoragePlugin.SQLITE3):
    """Write a folder of a bag and return its one file."""
    with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        topics = dict.fromkeys(topic for topic, *_ in messages)
        known = {one: writer.add_connection(one, KIND, typestore=TYPES) for one in topics}
        for topic, logged, message in messages:
            writer.write(known[topic], logged, TYPES.serialize_cdr(message, KIND))
    (file,) = [one for one in path.iterdir() if one.suffix in (".db3", ".mcap")]
    return file


def write_mcap(path, messages, compression=mcap_writer.CompressionType.ZSTD):
    with path.open("wb") as file:
        writer = mcap_writer.Writer(file, compression=compression, chunk_size=4096)
        writer.start("ros2")
        schema = writer.register_schema(KIND, "ros2msg", b"")
        known = {}
        for topic, logged, message in messages:
            if topic not in known:
                known[topic] = writer.register_channel(topic, "cdr", schema)
            data = bytes(TYPES.serialize_cdr(message, KIND))
            writer.add_message(known[topic], logged, data, logged)
        writer.finish()
    return path


def write(folder, form, messages):
    if form == "mcap":
        return write_mcap(folder / "log.mcap", messages)
    return write_rosbag2(folder / "bag", messages)


def layout(form="csv", position="elbow.position", time="time"):
    channels = {"q": Channel(position, "rad"), "u": Channel("elbow.effort", "N.m")}
    if form == "position":
        form, channels = "csv", {"q": Channel(position, "rad")}
    return TableLayout(form, channels, Channel(time, "s"), None, 0)


def reads_the_wave(path, form="csv", **names):
    table = read_table(path, layout(form, **names))
    assert table.time - table.time[0] == pytest.approx(TIME, abs=1e-6)
    assert table.channels["q"] == pytest.approx(WAVE, abs=1e-12)
    assert table.channels["u"] == pytest.approx(PUSH, abs=1e-12)
    return table


@pytest.mark.parametrize("form", FORMS)
def test_joint_states_are_columns(form, tmp_path):
    path = write(tmp_path, form, states())
    for stated in (form, "csv"):
        assert reads_the_wave(path, stated).time[0] == 0.0
    table = reads_the_wave(path, position="/joint_states:elbow.position", time="stamp")
    assert table.time[0] == START
    speed = read_table(path, layout("position", "elbow.velocity")).channels["q"]
    assert speed == pytest.approx(2.0 * WAVE)


@pytest.mark.parametrize("compression", mcap_writer.CompressionType)
def test_any_compression_of_chunks_is_read(compression, tmp_path):
    reads_the_wave(write_mcap(tmp_path / "a.mcap", states(), compression))


@pytest.mark.parametrize("plugin", rosbag2.StoragePlugin)
def test_any_storage_of_a_bag_is_read(plugin, tmp_path):
    reads_the_wave(write_rosbag2(tmp_path / "bag", states(), plugin))


@pytest.mark.parametrize("form", FORMS)
def test_messages_of_other_joints_are_no_rows(form, tmp_path):
    several = [one for pair in zip(states(), states(names=("base",)), strict=True) for one in pair]
    reads_the_wave(write(tmp_path, form, several))


@pytest.mark.parametrize("form", FORMS)
def test_two_topics_are_told_apart_by_name(form, tmp_path):
    path = write(tmp_path, form, states() + states("/commands"))
    with pytest.raises(InvalidInput, match=r"one topic.*/commands:elbow\.effort"):
        read_table(path, layout())
    names = {"position": "/joint_states:elbow.position", "time": "/joint_states:time"}
    reads_the_wave(path, **names)


@pytest.mark.parametrize("form", FORMS)
def test_without_a_stamp_the_time_of_the_log_counts(form, tmp_path):
    path = write(tmp_path, form, states(stamped=False))
    assert reads_the_wave(path, time="stamp").time[0] == pytest.approx(START + 0.005)


@pytest.mark.parametrize("form", FORMS)
def test_a_quantity_that_no_message_has_is_refused(form, tmp_path):
    path = write(tmp_path, form, states(effort=False))
    with pytest.raises(InvalidInput, match="columns of one topic"):
        read_table(path, layout())
    assert len(read_table(path, layout("position")).time) == COUNT
    for name in ("shoulder.position", "elbow", "elbow.current", "/other:elbow.position", ""):
        with pytest.raises(InvalidInput, match="columns of one topic"):
            read_table(path, layout("position", name or "."))


@pytest.mark.parametrize("form", FORMS)
def test_a_damaged_log_is_refused(form, tmp_path, rng):
    path = write(tmp_path, form, states())
    whole = path.read_bytes()
    for content in (b"", b"\0", whole[: len(whole) // 2], rng.bytes(3000), whole[:16]):
        path.write_bytes(content)
        with pytest.raises(InvalidInput, match=path.name):
            read_table(path, layout())
    for _ in range(100):
        content = bytearray(whole)
        for place in rng.integers(len(content), size=3):
            content[place] = rng.integers(256)
        path.write_bytes(content)
        # Some damage shows in values only.
        with contextlib.suppress(InvalidInput):
            read_table(path, layout())


@pytest.mark.parametrize("form", FORMS)
def test_rows_and_bytes_keep_the_budget(form, tmp_path, monkeypatch):
    path = write(tmp_path, form, states())
    monkeypatch.setenv("PYMOO_HDTE_MOST_ROWS", "299")
    with pytest.raises(InvalidInput, match="MOST_ROWS"):
        read_table(path, layout())
    monkeypatch.setenv("PYMOO_HDTE_MOST_ROWS", "300")
    reads_the_wave(path)
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", "10000")
    with pytest.raises(InvalidInput, match="MOST_BYTES"):
        read_table(path, layout())


def bomb(path, said, compression):
    """Write an MCAP file whose one chunk expands to 100 MB of zeros, or says so."""
    zeros = bytes(100_000_000)
    if compression == "zstd":
        packed = pytest.importorskip("zstandard").ZstdCompressor().compress(zeros)
    else:
        packed = pytest.importorskip("lz4.frame").compress(zeros)
    from mcap.data_stream import RecordBuilder
    from mcap.records import Chunk, Header

    builder = RecordBuilder()
    Header("ros2", "").write(builder)
    Chunk(compression, packed, 0, 0, 0, said).write(builder)
    path.write_bytes(b"\x89MCAP0\r\n" + builder.end())


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize(("said", "word"), [(100_000_000, "MOST_BYTES"), (1000, "other bytes")])
def test_a_chunk_that_expands_is_refused_before_it_does(
    compression, said, word, tmp_path, monkeypatch
):
    bomb(tmp_path / "a.mcap", said, compression)
    monkeypatch.setenv("PYMOO_HDTE_MOST_BYTES", "1000000")
    tracemalloc.start()
    try:
        with pytest.raises(InvalidInput, match=word):
            read_table(tmp_path / "a.mcap", layout())
        assert tracemalloc.get_traced_memory()[1] < 30_000_000
    finally:
        tracemalloc.stop()


def test_a_database_whose_messages_never_end_is_refused(tmp_path):
    path = tmp_path / "a.db3"
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE topics (id INTEGER, name TEXT, type TEXT)")
        base.execute("INSERT INTO topics VALUES (1, '/joint_states', ?)", (KIND,))
        base.execute(
            "CREATE VIEW messages AS "
            "WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n) "
            "SELECT 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"
        )
    base.close()
    with pytest.raises(InvalidInput, match="no table messages"):
        read_table(path, layout())


@pytest.mark.parametrize("module", ["rosbags.typesys", "mcap.stream_reader"])
def test_without_a_library_the_extra_is_named(module, tmp_path, monkeypatch):
    path = write(tmp_path, "mcap", states())
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InvalidInput, match=r"pip install .pymoo-hdte\[ros\]"):
        read_table(path, layout())


RIG = """
title = "A joint"
[coordinates.elbow]
inertia = { value = 0.5, factor = 3.0 }
[ports.bearing]
motion = { elbow = 1.0 }
damping = { value = 3.0, tolerance = 1.0 }
[inputs.torque]
acts = { elbow = 1.0 }
gain = { value = 1.0 }
[table]
time = { column = "time", unit = "s" }
channels.elbow = { column = "elbow.position", unit = "rad" }
channels.torque = { column = "elbow.effort", unit = "N.m" }
[[records]]
file = "FILE"
"""


@pytest.mark.parametrize("form", FORMS)
def test_a_rig_reads_a_log(form, tmp_path):
    file = write(tmp_path, form, states()).relative_to(tmp_path).as_posix()
    (tmp_path / "rig.toml").write_text(RIG.replace("FILE", file), encoding="utf-8")
    measured = read_rig(tmp_path)
    elbow = np.concatenate([one.channels["elbow"] for one in measured.records])
    assert elbow == pytest.approx(WAVE, abs=1e-9)
