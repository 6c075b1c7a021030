"""Measured tables: what is read is what was written, in SI; what is wrong is named."""

import math
import tomllib

import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from places import SHARED

from pymoo_hdte._io import tables
from pymoo_hdte._io.fields import Fields
from pymoo_hdte.checks import InvalidInput

EMPS = SHARED / "measured" / "emps" / "DATA_EMPS.mat"
KINOVA = EMPS.parents[1] / "kinova_gen3_j7"
FILES = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25)
NUMBERS = st.floats(-tables.LARGEST, tables.LARGEST, allow_subnormal=False)
RECORDS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=16, max_size=40)
FORMS = pytest.mark.parametrize("form", ["matlab", "csv", "plain"])
MATLAB = [("matlab", None), ("matlab", "compressed")]
TEXTS = [("csv", ","), ("csv", ";"), *(("plain", mark) for mark in (" ", "\t", ",", ", "))]
Channel = tables.Channel
TIME = np.arange(300) * 1e-3
WAVE = np.sin(TIME)


def write(folder, form, columns, separator=None):
    path = folder / f"rig.{form}"
    if form == "matlab":
        scipy.io.savemat(path, columns, appendmat=False, do_compression=separator == "compressed")
        return path
    separator = separator or {"csv": ",", "plain": " "}[form]
    rows = [separator.join(map(repr, row)) for row in np.column_stack([*columns.values()]).tolist()]
    head = [separator.join(columns)] if form == "csv" else []
    path.write_text("\n".join(head + rows) + "\n", encoding="utf-8")
    return path


def layout(form="csv", rate=100.0, skip=0, time=None, **channels):
    return tables.TableLayout(form, channels, time, None if time else rate, skip)


def wave(form="csv", **options):
    names = (0, 1) if form == "plain" else ("t", "q")
    return layout(form, time=Channel(names[0], "s"), q=Channel(names[1], "m"), **options)


def refused(path, table_layout, *words):
    with pytest.raises(InvalidInput) as caught:
        tables.read_table(path, table_layout)
    for word in (path.name, *words):
        assert word in str(caught.value)


@pytest.mark.parametrize(("form", "separator"), [*MATLAB, *TEXTS])
@FILES
@given(record=RECORDS)
def test_what_was_written_is_read(form, separator, record, tmp_path):
    values = np.array(record).T
    path = write(tmp_path, form, {"angle": values[0], "b": values[1]}, separator)
    first, second = (0, 1) if form == "plain" else ("angle", "b")
    given = layout(form, y=Channel(second, "1"), x=Channel(first, "1", -2.0))
    table = tables.read_table(path, given)
    np.testing.assert_array_equal([table.channels["x"] / -2.0, table.channels["y"]], values)
    np.testing.assert_array_equal(table.time, np.arange(len(record)) / 100.0)


def test_all_numbers_of_matlab_in_rows_and_columns(tmp_path):
    for kind in ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8", "i8", "u8"):
        row = np.arange(20).astype(kind)[None, :]
        path = write(tmp_path, "matlab", {"t": row.T, "q": row, "s": {"a": 1}, "text": "abc"})
        got = tables.read_table(path, wave("matlab")).channels["q"]
        np.testing.assert_array_equal(got, np.arange(20.0))


def test_every_unit_is_converted(tmp_path):
    path = write(tmp_path, "csv", {"a": np.arange(20.0)})
    known = {"um": 1e-6, "rev": 2 * math.pi, "arcsec": math.pi / 648000, "r/min": math.pi / 30}
    known |= {"rpm": math.pi / 30, "arcmin": math.pi / 10800, "N.cm": 1e-2}
    known |= dict.fromkeys(("ms", "mm", "mm/s", "N.mm", "mN.m", "mA", "mV"), 1e-3)
    known |= dict.fromkeys(("deg", "deg/s"), math.pi / 180)
    si = {"K", "s", "m", "rad", "rad/s", "m/s", "N", "N.m", "A", "V", "m/s2", "rad/s2", "1"}
    known |= dict.fromkeys(set(tables.CHANNEL_UNITS) & si, 1.0)
    assert {*known, "C"} == set(tables.CHANNEL_UNITS)
    for unit, factor in known.items():
        values = tables.read_table(path, layout(x=Channel("a", unit))).channels["x"]
        np.testing.assert_allclose(values, np.arange(20.0) * factor, rtol=1e-14)
    values = tables.read_table(path, layout(x=Channel("a", "C"))).channels["x"]
    np.testing.assert_allclose(values, np.arange(20.0) + 273.15, rtol=1e-14)


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2 * math.pi), ("rev", 1.0)])
def test_an_angle_that_wraps_is_unwrapped_also_across_a_gap(unit, turn, tmp_path):
    angle = np.linspace(0.0, 3.2 * turn, 400)
    column = angle % turn
    column[np.flatnonzero(np.diff(column) < 0)[0]] = math.nan
    given = layout(x=Channel("a", unit, 0.5, unwrap=True))
    table = tables.read_table(write(tmp_path, "csv", {"a": column}), given)
    np.testing.assert_allclose(
        table.channels["x"], angle * tables.CHANNEL_UNITS[unit] * 0.5, atol=1e-9
    )


@FORMS
def test_skipped_rows_keep_their_place_in_time(form, tmp_path):
    path = write(tmp_path, form, {"t": TIME, "q": WAVE})
    by_rate = layout(form, 1000.0, 100, **wave(form).channels)
    for table in (tables.read_table(path, wave(form, skip=100)), tables.read_table(path, by_rate)):
        np.testing.assert_allclose(table.time, TIME[100:], rtol=1e-12)
        np.testing.assert_array_equal(table.channels["q"], WAVE[100:])
    refused(path, wave(form, skip=285), "finite rows after skip_rows = 285", "is 15", "at least 16")
    refused(path, wave(form, skip=10**6), "finite rows", "is 0")


@FORMS
def test_rows_that_are_not_finite_are_dropped_filled_and_counted(form, tmp_path):
    columns = {"t": TIME, "q": 2.0 * TIME, "r": WAVE.copy(), "unmapped": np.full(300, math.inf)}
    columns["q"][[0, 1, -1]] = math.nan, math.inf, -math.inf
    columns["q"][150] = columns["r"][151] = math.nan
    given = wave(form)
    given.channels["r"] = Channel(2 if form == "plain" else "r", "1")
    table = tables.read_table(write(tmp_path, form, columns), given)
    assert table.dropped == 5
    np.testing.assert_array_equal(table.time, TIME[2:-1])
    np.testing.assert_allclose(table.channels["q"], 2.0 * TIME[2:-1], rtol=1e-12)
    assert table.channels["r"][149] == pytest.approx((WAVE[150] + WAVE[152]) / 2, rel=1e-12)
    # Only the value that is missing is made up: the other columns of its row were measured.
    assert table.channels["r"][148] == WAVE[150]
    longer = columns | {"q": columns["q"].copy()}
    longer["q"][152] = math.nan
    wide = {name: np.concatenate([column] * 2) for name, column in longer.items()}
    wide["t"] = np.arange(600) * 1e-3
    wide["q"][298:302] = wide["r"][450:452] = 0.0
    wide["q"][450] = 0.0
    place = {"matlab": "row 151: ", "csv": "line 152: "}.get(form, "line 151: ")
    refused(write(tmp_path, form, wide), given, place, "gaps of at most 2 rows; here are 3")
    columns["q"][160] = math.nan
    place = {"matlab": "row 151: q", "csv": "line 152: q"}.get(form, "line 151: col")
    refused(write(tmp_path, form, columns), given, place, "is nan", "1 % of rows; here 3 are not")


def test_a_missing_time_is_filled_but_time_must_rise_without_gaps(tmp_path):
    for value in (math.nan, TIME[50] + 0.5e-5):
        time = np.concatenate([TIME[:50], [value], TIME[51:]])
        table = tables.read_table(write(tmp_path, "csv", {"t": time, "q": WAVE}), wave())
        np.testing.assert_allclose(table.time, TIME, atol=0.6e-5)
        assert not table.remark
    falling, late = TIME.copy(), TIME.copy()
    falling[50], late[50:] = falling[49], TIME[50:] + 5e-3
    for time in (falling, late, np.delete(TIME, range(50, 55))):
        path = write(tmp_path, "csv", {"t": time, "q": WAVE[: len(time)]})
        refused(path, wave(), "line 52: t", f"is {float(time[50])}", "0.001 s, within 1 %")
    for time in (TIME[::-1], np.zeros(300)):
        refused(write(tmp_path, "csv", {"t": time, "q": WAVE}), wave(), "line 3: t")


GOOD = "t,q\n" + "".join(f"{t},{q}\n" for t, q in zip(TIME.tolist(), WAVE.tolist(), strict=True))
FAULTS = [
    ("t,q", "t,r", "line 1: columns is ['t', 'r'], allowed: t, q, each once"),
    ("t,q", "t,q,q", "line 1: columns is ['t', 'q', 'q'], allowed: t, q, each once"),
    ("\n0.001,", "\n0.001,7,", "line 3: number of cells is 3, allowed: 2"),
    ("\n0.001,", "\n0.001,x", "line 3: q is 'x0.0009"),
    ("\n0.002,", "\n0_002,", "line 4: t is '0_002', allowed: a number"),
    ("\n0.001,0", "\n0.001,9999999999999999", "line 3: q is 1e+16, allowed: at most 1e+15"),
    ("\n0.002,", "\n0.002\0,", "line 4 is '0.002\\x00"),
    ("\n0.002,", "\n0.002\udc81,", "line 4 is '0.002\ufffd"),
]


def test_a_bad_text_is_refused_with_its_line(tmp_path):
    path = tmp_path / "rig.csv"
    for old, new, words in FAULTS:
        assert GOOD.count(old) == 1
        path.write_bytes(GOOD.replace(old, new).encode("utf-8", "surrogateescape"))
        refused(path, wave(), words)


def test_odd_but_good_texts_are_read(tmp_path):
    path = tmp_path / "rig.csv"
    quoted = GOOD.replace("t,q", '"t", "q"').replace("\n0.001,0.0009999998333333417", "\n0.001,")
    for text in (quoted.replace("\n", "\r\n"), "\ufeff" + GOOD + "\n \n", GOOD.replace("\n", "\r")):
        path.write_text(text, encoding="utf-8", newline="")
        np.testing.assert_allclose(tables.read_table(path, wave()).channels["q"], WAVE, atol=1e-9)
    plain = GOOD.replace(",", " ").replace("t q\n", "# remark, with commas\n")
    path.write_text(plain)
    assert len(tables.read_table(path, wave("plain", skip=1)).time) == 300
    refused(
        path,
        layout("plain", skip=1, q=Channel(2, "m")),
        "line 2: columns is [0, 1], allowed: 2, each once",
    )
    path.write_text(plain.replace(".", ","))
    refused(path, layout("plain", skip=1, q=Channel(0, "m")), "line 2: column 1 is '0 0'")


@FORMS
def test_files_that_are_empty_absent_or_folders(form, tmp_path):
    path = tmp_path / "rig"
    for content in (b"", b"\n", b"\xff\xfe\0", b"\x89HDF" + bytes(600)):
        path.write_bytes(content)
        refused(path, wave(form))
    for bad in (tmp_path, tmp_path / "absent"):
        with pytest.raises(OSError, match="directory"):
            tables.read_table(bad, wave(form))
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + bytes(384) + b"\x89HDF\r\n")
    refused(path, wave(form), "v5 or v7" if form == "matlab" else "NUL")


def test_a_matlab_variable_that_is_no_vector_of_numbers(tmp_path):
    values = {"6 of shape [4, 5]": np.ones((4, 5)), "6 of shape [1, 19]": np.ones(19)}
    values |= {"806": np.ones(20) * 1j, "4": "text", "2": {"a": 1.0}}
    for words, value in values.items():
        path = write(tmp_path, "matlab", {"t": np.arange(20.0), "q": value})
        refused(path, wave("matlab"), f"q is 'MATLAB class 0x{words}", "a vector of real numbers")
    refused(path, layout("matlab", x=Channel("absent", "m")), "absent is None", "'t': ", "'q': ")
    # scipy.io.loadmat looks an unknown type of numbers up unchecked, which crashes Python.
    good = write(tmp_path, "matlab", {"t": TIME, "q": WAVE}).read_bytes()
    for kind in (0, 8, 19, 200):
        path.write_bytes(good[:176] + bytes([kind]) + good[177:])
        refused(path, wave("matlab"), f"KeyError({kind})")


def test_an_error_shows_the_titles_of_the_file_and_what_comes_near(tmp_path):
    rows = "".join(f"{row / 100:.3f};{row * 1.25:.3f};0,5\n" for row in range(30)).replace(".", ",")
    (tmp_path / "a.csv").write_text("Logger; 1\nZeit;Winkel [deg];Moment\n" + rows)
    asked = layout(q=Channel("winkel", "deg"), u=Channel("Moment", "N.m"))
    refused(tmp_path / "a.csv", asked, "line 2", "'Zeit', 'Winkel [deg]', 'Moment'", "is winkel '")
    (tmp_path / "a.csv").write_text(rows)
    refused(tmp_path / "a.csv", asked, "line 1", "called by numbers, from 0")


LAYOUT = """format = "csv"
skip_rows = 3
time = { column = "t", unit = "ms" }
[channels]
q = { column = "qm", unit = "deg", scale = -2, unwrap = true }
"""


def parsed(text):
    return tables.layout_from_fields(Fields(tomllib.loads(text), "rig.toml: table"))


def test_a_layout_is_read_from_its_table():
    angle = Channel("qm", "deg", -2.0, True)
    assert parsed(LAYOUT) == layout("csv", skip=3, time=Channel("t", "ms"), q=angle)
    plain = 'format = "plain"\nsample_rate = 990\nchannels.q = { column = 1, unit = "mV" }'
    assert parsed(plain) == layout("plain", 990.0, q=Channel(1, "mV"))
    # Columns with titles are those of a CSV file, others of a plain one.
    assert parsed(LAYOUT.removeprefix('format = "csv"\n')) == parsed(LAYOUT)
    assert parsed(plain.removeprefix('format = "plain"')) == parsed(plain)


def test_a_gear_ratio_divides_a_reading(tmp_path):
    text = 'sample_rate = 100\nchannels.q = { column = "a", unit = "deg", divided_by = -48 }'
    path = write(tmp_path, "csv", {"a": np.arange(20.0)})
    angle = tables.read_table(path, parsed(text)).channels["q"]
    np.testing.assert_allclose(angle, np.deg2rad(np.arange(20.0)) / -48.0, rtol=1e-14)
    with pytest.raises(InvalidInput, match=r"q\.divided_by is 0\.0"):
        parsed(text.replace("-48", "0"))


def test_a_matlab_file_is_known_by_its_name(tmp_path):
    path = write(tmp_path, "matlab", {"q": WAVE}).rename(tmp_path / "a.mat")
    found = tables.read_table(
        path, parsed('sample_rate = 9\nchannels.q = {column = "q", unit="m"}')
    )
    np.testing.assert_array_equal(found.channels["q"], WAVE)


BAD_LAYOUTS = [
    ('"csv"', '"xls"', r"table\.format is 'xls', .*'matlab', 'csv', 'plain'"),
    ('"csv"', '"plain"', r"channels\.q\.column is 'qm'"),
    ("skip_rows = 3", "sample_rate = 990", r"table\.time .* if sample_rate"),
    ('time = { column = "t", unit = "ms" }', "", r"table\.sample_rate is None"),
    ('"ms"', '"m"', r"time\.unit is 'm', .*'s', 'ms'"),
    ("skip_rows", "skip", r"table\.skip is 3, .*no such"),
    ("-2", "1e16", r"channels\.q\.scale is 1e\+16"),
    ("= true", "= 1", r"channels\.q\.unwrap is 1"),
    ("unwrap", "wrap", r"channels\.q\.wrap is True, .*no such"),
    ('"deg"', '"m"', r"channels\.q\.unit is 'm', .*'rad', 'deg', 'arcmin', 'arcsec', 'rev'$"),
    ('"deg", scale = -2, unwrap = true', '"lb"', r"q\.unit is 'lb', .*'N\.mm'"),
    ("q = {", "# {", r"channels is \{\}, .*at least one"),
]


def test_a_bad_layout_is_refused_with_its_field():
    for old, new, words in BAD_LAYOUTS:
        assert LAYOUT.count(old) == 1
        with pytest.raises(InvalidInput, match=rf"^rig\.toml: .*{words}"):
            parsed(LAYOUT.replace(old, new))


def test_a_file_is_known_by_its_sha256(tmp_path):
    (path := tmp_path / "a").write_bytes(b"abc")
    tables.check_sha256(path, "BA7816bf")
    short = dict.fromkeys(("ba7816b", "ba7816bz", 12345678, "0" * 65), "8 to 64 hexadecimal")
    for bad, words in (short | {"ba7816b0": "a: sha256 is 'ba78.*begins with ba7816b0"}).items():
        with pytest.raises(InvalidInput, match=words):
            tables.check_sha256(path, bad)


@pytest.mark.parametrize(("form", "separator"), [*MATLAB, ("csv", ";"), ("plain", " ")])
def test_damaged_files_give_a_table_or_a_clear_refusal(form, separator, tmp_path, rng):
    good = (path := write(tmp_path, form, {"t": TIME[:40], "q": WAVE[:40]}, separator)).read_bytes()
    for trial in range(200):
        damaged = bytearray(good if trial % 10 else rng.bytes(rng.integers(1, 300)))
        damaged = damaged[: rng.integers(1, len(good)) if trial % 10 == 1 else None]
        # The structure of a MATLAB file stands in the first bytes after 124 of remarks.
        start = 124 if form == "matlab" and len(damaged) > 124 else 0
        for reach in rng.choice([80, 300, 10**6], size=2):
            at = rng.integers(start, min(start + reach, len(damaged)))
            damaged[at] = rng.integers(256) if form == "matlab" else good[rng.integers(len(good))]
        path.write_bytes(damaged)
        try:
            table = tables.read_table(path, wave(form))
        except InvalidInput:
            continue
        assert len(table.time) == len(table.channels["q"]) >= 16
        assert np.all(np.isfinite(table.channels["q"]) & (np.gradient(table.time) > 0.0))


@pytest.mark.skipif(not EMPS.is_file(), reason=f"no measured data at {EMPS}")
def test_emps_is_read_whole():
    tables.check_sha256(EMPS, "6cf6814ae14618")
    given = layout("matlab", time=Channel("t", "s"), q=Channel("qm", "mm"), v=Channel("vir", "V"))
    table, raw = tables.read_table(EMPS, given), scipy.io.loadmat(EMPS)
    assert (table.dropped, len(table.time)) == (0, 24_841)
    np.testing.assert_allclose(table.channels["q"], raw["qm"].ravel() * 1e-3, rtol=1e-14)
    np.testing.assert_array_equal(table.channels["v"], raw["vir"].ravel())
    np.testing.assert_array_equal(table.time, raw["t"].ravel())


@pytest.mark.skipif(not KINOVA.is_dir(), reason=f"no measured data at {KINOVA}")
def test_kinova_turns_as_far_as_its_speed_says():
    names = {"angle": Channel(1, "rad", 1.0, True), "speed": Channel(2, "rad/s")}
    for path in (paths := list(KINOVA.glob("velocity_*.csv"))):
        table = tables.read_table(path, layout("plain", 990.0, 600, **names, own=Channel(6, "N.m")))
        assert table.dropped == 0
        turned = np.ptp(table.channels["angle"])
        assert turned == pytest.approx(np.ptp(table.time) * table.channels["speed"].mean(), rel=0.1)
    first = tables.read_table(min(paths), layout("plain", 990.0, own=Channel(6, "N.m")))
    assert (first.dropped, first.time[0], len(first.time)) == (1, 1 / 990.0, 2978)
