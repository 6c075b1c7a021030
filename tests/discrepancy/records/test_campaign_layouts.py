"""Campaigns as people have them: other columns, units, signs, marks and zeros give the same."""

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_campaigns import small_campaign

from pymoo_hdte._io.layout import CHANNEL_UNITS
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import read_campaign, write_campaign
from pymoo_hdte.units import UNITS

CHANNELS = ("input_angle", "output_angle", "input_torque", "output_torque")
PREAMBLE = ["Rig 7; bench of the cellar, at 21,5 degrees", "", "Operator: Ann"]


@pytest.fixture(scope="module")
def campaign():
    return small_campaign()


def formed(number, decimal):
    return repr(float(number)).replace(".", decimal)


def rewritten(campaign, folder, table, titles, *, mark=",", decimal=".", head=(), units=None):
    """Write a campaign with the columns of a layout; a title may be of a column that is no channel.

    Angles that wrap are written so.
    """
    write_campaign(campaign, folder)
    toml = folder / "campaign.toml"
    whole = tomllib.loads(toml.read_text())
    for entry, record in zip(whole["record"], (*campaign.running, *campaign.torsion), strict=True):
        (folder / entry["file"]).unlink()
        entry["file"] = entry["file"].removesuffix(".gz")
        columns = {}
        for title in titles:
            name = next((n for n, c in table["channels"].items() if c["column"] == title), None)
            name = "time" if title == table["time"]["column"] else name
            if hasattr(record, name or "?"):
                channel = table["time"] if name == "time" else table["channels"][name]
                columns[title] = [formed(x, decimal) for x in readings(record, name, channel)]
            else:
                columns[title] = ["a remark"] * len(record.time)
        lines = [*head, mark.join(titles)]
        lines += [mark.join(units.get(title, "") for title in titles)] if units else []
        lines += [mark.join(row) for row in zip(*columns.values(), strict=True)]
        (folder / entry["file"]).write_text("\n".join(lines) + "\n", encoding="utf-8")
    toml.write_text(tomli_w.dumps(whole | {"table": table}))
    return folder


def readings(record, name, channel):
    factor = CHANNEL_UNITS.get(channel["unit"]) or 2.0 * math.pi / channel["counts_per_turn"]
    found = getattr(record, name) / (factor * channel.get("scale", 1.0)) + channel.get("zero", 0.0)
    turn = 2.0 * math.pi / factor if channel.get("unwrap") else channel.get("wraps")
    return found if turn is None else found % turn


def equal(read, campaign):
    pairs = zip((*read.running, *read.torsion), (*campaign.running, *campaign.torsion), strict=True)
    for ours, theirs in pairs:
        for name in ("time", *CHANNELS):
            if hasattr(theirs, name):
                expected = getattr(theirs, name)
                size = np.abs(expected).max()
                np.testing.assert_allclose(getattr(ours, name), expected, rtol=0, atol=1e-11 * size)


ANGLES = st.sampled_from([*UNITS["angle"], "counts"])
TORQUES = st.sampled_from([*UNITS["torque"]])
TITLES = st.text(st.characters(categories=["L", "N"]), min_size=1, max_size=6)


@st.composite
def layouts(draw):
    """Draw a layout as TOML would give it, and the titles in the order of the file."""
    names = st.lists(TITLES.map(lambda title: f"x {title}"), min_size=6, max_size=6, unique=True)
    titles = draw(names)
    channels = {}
    for name, title in zip(CHANNELS, titles, strict=False):
        unit = draw(ANGLES if "angle" in name else TORQUES)
        channel = {"column": title, "unit": unit, "scale": draw(st.sampled_from([1.0, -1.0, 0.5]))}
        if draw(st.booleans()):
            channel["zero"] = draw(st.floats(-9.0, 9.0))
        if unit == "counts":
            channel["counts_per_turn"] = draw(st.sampled_from([4096, 1e5]))
        channels[name] = channel
    time = {"column": titles[4], "unit": draw(st.sampled_from([*UNITS["time"]]))}
    return {"channels": channels, "time": time}, draw(st.permutations(titles))


@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    layout=layouts(),
    mark=st.sampled_from([",", ";", "\t"]),
    comma=st.booleans(),
    head=st.booleans(),
    units=st.booleans(),
)
def test_odd_units_and_marks_are_read_as_they_were_meant(
    campaign, tmp_path_factory, layout, mark, comma, head, units
):
    table, titles = layout
    row = {
        one["column"]: f"[{one['unit']}]" for one in (*table["channels"].values(), table["time"])
    }
    folder = rewritten(
        campaign,
        tmp_path_factory.mktemp("odd") / "rig",
        table,
        titles,
        mark=mark,
        decimal="," if comma and mark != "," else ".",
        head=PREAMBLE if head else (),
        units=row if units else None,
    )
    equal(read_campaign(folder), campaign)


TIME = {"column": "time_s", "unit": "s"}
ENCODERS = {
    "input_angle": {"column": "motor", "unit": "counts", "counts_per_turn": 8000, "scale": -1.0},
    "output_angle": {"column": "load", "unit": "deg"},
}


def with_encoders(campaign, folder, further):
    channels = {name: one | further.get(name, {}) for name, one in ENCODERS.items()}
    channels["input_torque"] = {"column": "input_torque_Nm", "unit": "N.m"}
    channels["output_torque"] = {"column": "output_torque_Nm", "unit": "N.m"}
    titles = ["time_s", *(one["column"] for one in channels.values())]
    return rewritten(campaign, folder, {"channels": channels, "time": TIME}, titles)


def turns_apart(read, campaign, turn, name):
    """Return by how many turns angles are off, which must be whole and the same over a record."""
    off = []
    for ours, theirs in zip(read.running, campaign.running, strict=True):
        apart = (getattr(ours, name) - getattr(theirs, name)) / turn
        assert np.abs(apart - np.round(apart)).max() < 1e-9
        assert np.ptp(np.round(apart)) == 0.0
        off.append(round(apart[0]))
    return off


@pytest.mark.parametrize("wrapped", [{"unwrap": True}, {"wraps": 8000.0}, {"wraps": 24000}])
def test_an_input_that_wraps_gets_its_turns_from_the_output(campaign, tmp_path, wrapped):
    if "unwrap" in wrapped:
        wrapped |= {"scale": 1.0}
    read = read_campaign(with_encoders(campaign, tmp_path / "rig", {"input_angle": wrapped}))
    assert set(turns_apart(read, campaign, 2.0 * math.pi, "input_angle")) == {0}


def test_an_output_that_wraps_gets_its_turns_from_the_input(campaign, tmp_path):
    wrapped = {"output_angle": {"wraps": 360.0}}
    read = read_campaign(with_encoders(campaign, tmp_path / "rig", wrapped))
    assert set(turns_apart(read, campaign, 2.0 * math.pi, "output_angle")) == {0}
    equal(read, campaign)


def test_both_wrap_and_have_one_common_zero(campaign, tmp_path):
    wrapped = {"output_angle": {"wraps": 360.0}, "input_angle": {"wraps": 8000.0}}
    read = read_campaign(with_encoders(campaign, tmp_path / "rig", wrapped))
    ratio = campaign.believed.ratio
    inputs = turns_apart(read, campaign, 2.0 * math.pi, "input_angle")
    outputs = turns_apart(read, campaign, 2.0 * math.pi, "output_angle")
    assert inputs == [ratio * one for one in outputs]


def test_a_record_has_zeros_and_a_layout_of_its_own(campaign, tmp_path):
    folder = with_encoders(campaign, tmp_path / "rig", {})
    toml, first = folder / "campaign.toml", campaign.running[0].name
    text = (folder / f"{first}.csv").read_text().replace("motor,", "engine,")
    head, *rows = text.splitlines()
    moved = []
    for row in rows:
        time, motor, load, *others = row.split(",")
        moved.append(",".join([time, repr(float(motor) + 77.0), repr(float(load) - 3.0), *others]))
    (folder / f"{first}.csv").write_text("\n".join([head, *moved]))
    whole = tomllib.loads(toml.read_text())
    own = ENCODERS["input_angle"] | {"column": "engine"}
    whole["record"][0] |= {"table": {"channels": {"input_angle": own}}}
    whole["record"][0] |= {"zero": {"input_angle": 77.0, "output_angle": -3.0}}
    toml.write_text(tomli_w.dumps(whole))
    equal(read_campaign(folder), campaign)


@pytest.fixture
def folder(campaign, tmp_path):
    return with_encoders(campaign, tmp_path / "rig", {})


def changed(folder, change):
    toml = folder / "campaign.toml"
    whole = tomllib.loads(toml.read_text())
    change(whole)
    toml.write_text(tomli_w.dumps(whole))


def put(*path):
    """Return a change of a campaign: the last of the path is put where the others lead."""

    def change(whole):
        for key in path[:-2]:
            whole = whole[key]
        whole[path[-2]] = path[-1]

    return change


MOTOR = ("table", "channels", "input_angle")
FAULTS = {
    "unit": (put(*MOTOR, "unit", "N.m"), "input_angle.unit is 'N.m', .*'counts', 'rad', 'deg'"),
    "channel": (put("table", "channels", "angle", TIME), "channels.name is 'angle', .*input_angle"),
    "no counts": (put(*MOTOR, "unit", "deg"), "counts_per_turn is 8000.* absent with any other"),
    "format": (put("table", "format", "xls"), "table.format is 'xls', .*'csv'"),
    "delimiter": (put("table", "delimiter", "|"), "table.delimiter is '|', .*'semicolon'"),
    "column": (
        put(*MOTOR, "column", "gear"),
        r"csv, line 1: columns is \['time_s', 'motor', 'load'",
    ),
    "zero": (put("record", 0, "zero", {"angle": 1.0}), r"record\[0\].zero.*is 'angle', .*input_an"),
    "zero far off": (
        put("record", 0, "zero", {"output_angle": 20.0}),
        "csv, lines 2 to .*: largest transmission error .* one common zero",
    ),
    "wraps": (put(*MOTOR, "wraps", 0.0), "input_angle.wraps is 0.0, allowed: .*above 0"),
    "decimal": (put("table", "decimal", "comma"), "csv, line 2: time_s is '0.0', .*decimal comma"),
    "unknown": (put(*MOTOR, "sign", -1), "input_angle.sign is -1, allowed: no such field"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_bad_layout_is_named(folder, fault):
    change, message = FAULTS[fault]
    changed(folder, change)
    with pytest.raises(InvalidInput, match=message):
        read_campaign(folder)


def test_a_row_of_units_that_contradicts_the_layout_is_refused(folder, campaign):
    path = folder / f"{campaign.running[0].name}.csv"
    path.write_text(path.read_text().replace("\n", "\ns,counts,rad,Nm,Nm\n", 1))
    with pytest.raises(InvalidInput, match="line 2: unit of load is 'rad', allowed: deg, as the"):
        read_campaign(folder)


def test_a_bad_cell_below_a_preamble_has_its_line_and_title(folder, campaign):
    path = folder / f"{campaign.running[0].name}.csv"
    lines = [*PREAMBLE, *path.read_text().splitlines()]
    lines[20] = lines[20].replace(",", ",x", 1)
    path.write_text("\n".join(lines))
    with pytest.raises(InvalidInput, match=r"line 21: motor is 'x.*', allowed: a finite number"):
        read_campaign(folder)


def rpm(record):
    return record.input_speed * 30.0 / math.pi


def ranged(entry, record, speed, load):
    del entry["input_speed_rpm"], entry["load_torque_Nm"]
    entry["input_speed_range_rpm"] = [rpm(record) + off for off in speed]
    entry["load_torque_range_Nm"] = [record.load_torque + off for off in load]


def test_ranges_of_speed_and_load_replace_the_conditions_and_are_written_back(
    folder, campaign, tmp_path
):
    first = campaign.running[0]
    changed(folder, lambda whole: ranged(whole["record"][0], first, (-3.0, 3.0), (-2.0, 2.0)))
    read = read_campaign(folder)
    assert read.running[0].input_speed == pytest.approx(first.input_speed)
    assert read.running[0].load_torque == pytest.approx(first.load_torque)
    write_campaign(read, tmp_path / "again")
    again = read_campaign(tmp_path / "again").running[0]
    assert again.speed_range == pytest.approx(read.running[0].speed_range)
    assert again.load_range == pytest.approx(read.running[0].load_range)


@pytest.mark.parametrize(
    ("speed", "load", "message"),
    [
        ((5.0, 9.0), (-2.0, 2.0), "csv, lines 2 to .*: mean speed of input_angle .* the range of"),
        ((-3.0, 3.0), (5.0, 9.0), "csv, lines 2 to .*: mean of output_torque .* the range of the"),
        ((3.0, -3.0), (-2.0, 2.0), r"record\[0\].input_speed_range_rpm .*\[lowest, highest\]"),
        ((-1e5, 3.0), (-2.0, 2.0), r"record\[0\].input_speed_range_rpm .*without zero"),
    ],
)
def test_a_record_outside_its_ranges_is_refused(folder, campaign, speed, load, message):
    changed(folder, lambda whole: ranged(whole["record"][0], campaign.running[0], speed, load))
    with pytest.raises(InvalidInput, match=message):
        read_campaign(folder)


def anew(angle, row):
    angle[row:] -= angle[row]


def every_turn(angle, row):
    for place in range(row, len(angle), 6):
        angle[place:] -= 2.0 * np.pi


def misread(angle, row):
    angle[row] -= 2.0 * np.pi


@pytest.mark.parametrize(
    ("channel", "message"),
    [
        ("input_angle", "mean speed of input_angle"),
        ("output_angle", "largest transmission error"),
    ],
)
@pytest.mark.parametrize(
    ("fault", "told"), [(anew, True), (every_turn, True), (misread, False), (None, False)]
)
def test_an_angle_that_begins_anew_is_told_where_its_record_is_refused(
    campaign, channel, message, fault, told
):
    """An encoder that was zeroed within a record was told as a wrong speed of the whole record."""
    first, row = campaign.running[0], 30
    # Without a leap, and beside a row that was misread, the whole angle is wrong.
    angle = getattr(first, channel) * (1.0 if told else 2.0)
    if fault:
        fault(angle, row)
    record = replace(first, **{channel: angle})
    with pytest.raises(InvalidInput, match=message) as refused:
        replace(campaign, running=(record, *campaign.running[1:]))
    leap = rf"; {channel} leaps by -\S+ rad after row {row}: an angle"
    assert bool(re.search(leap, str(refused.value))) == told


def test_rows_that_are_missing_are_no_leap(campaign):
    first = campaign.running[0]
    kept = np.r_[0:100, 150 : len(first.time)]
    columns = ("time", "input_angle", "output_angle", "input_torque", "output_torque")
    record = replace(first, **{one: getattr(first, one)[kept] for one in columns})
    record = replace(record, output_angle=2.0 * record.output_angle)
    with pytest.raises(InvalidInput, match="largest transmission error") as refused:
        replace(campaign, running=(record, *campaign.running[1:]))
    assert "leaps" not in str(refused.value)
