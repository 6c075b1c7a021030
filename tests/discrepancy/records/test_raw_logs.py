"""Raw logs of a robot joint, as they come, with a rig.toml of a few lines and no script."""

from dataclasses import replace

import numpy as np
import pytest

from pymoo_hdte._io.layout import Channel, TableLayout
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.revision_mechanism import revised_mechanism
from pymoo_hdte.discrepancy._evidence.force_balances.preconditions import (
    check_sampling,
    fine_enough,
    usual_cutoff,
)
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._records.rig_model import model_text, read_mechanism_model
from pymoo_hdte.discrepancy._records.rig_records import ListedRecord, _with_positions
from pymoo_hdte.discrepancy._report.mechanism_document import limits, record_remarks
from pymoo_hdte.discrepancy._report.mechanism_values import effects, quantities
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record
from pymoo_hdte.mechanism.motion import highest_share

INERTIA, DAMPING, LEVEL, GAIN = 0.4, 2.0, 1.5, -7.6
RATIO = 101.0
RIG = """\
title = "A joint"
[coordinates.joint]
inertia = { value = 1.0, factor = 3.0 }
[ports.bearing]
motion = { joint = 1.0 }
damping = { value = 1.0, factor = 3.0 }
[inputs.current]
acts = { joint = 1.0 }
gain = { value = -7.6 }
[table]
time = { column = 0, unit = "s" }
channels.joint = { column = 3, unit = "rad", divided_by = 101.0 }
channels.current = { column = 9, unit = "A" }
[[records]]
file = "log.csv"
"""
BY_ROWS = 'time = { column = 0, unit = "s" }'


def moved(time):
    """Return angle, speed and current of a joint at some times; it turns back many times."""
    angle, speed, acceleration = np.zeros((3, len(time)))
    for frequency, size, phase in ((0.11, 1.0, 0.3), (0.37, 0.4, 1.0), (0.9, 0.1, 2.0)):
        omega = 2.0 * np.pi * frequency
        angle += size * np.sin(omega * time + phase)
        speed += size * omega * np.cos(omega * time + phase)
        acceleration -= size * omega**2 * np.sin(omega * time + phase)
    torque = INERTIA * acceleration + DAMPING * speed + LEVEL * np.tanh(speed / 1e-4)
    return angle, speed, torque / GAIN


def log(folder, steps=(0.010, 0.012), rows=6000):
    """Write a log without titles and with many columns."""
    chance = np.random.default_rng(9)
    time = 1297.499 + np.cumsum(np.resize(steps, rows))
    angle, speed, current = moved(time)
    table = chance.standard_normal((rows, 12))
    table[:, 0] = time
    table[:, 3] = RATIO * (angle + 2e-5 * chance.standard_normal(rows))
    table[:, 6] = RATIO * (speed + 1e-4 * chance.standard_normal(rows))
    table[:, 9] = current + 5e-3 * chance.standard_normal(rows)
    np.savetxt(folder / "log.csv", table, delimiter=",", fmt="%.7f")
    return folder


def rig(folder, *changes):
    text = RIG
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (folder / "rig.toml").write_text(text)
    return read_rig(folder)


def found(measured):
    return examine_mechanism(measured.mechanism, measured.records, measured.cutoff)


def is_the_joint(finding, unit=1.0):
    """Check that a finding has the joint's dry friction and values, in N.m over a unit."""
    (effect,) = effects(finding)
    assert effect["name"] == "coulomb_friction"
    assert effect["parameters"]["level"]["value"] * unit == pytest.approx(LEVEL, rel=0.02)
    values = {name: one["value"] * unit for name, one in quantities(finding).items()}
    assert values["inertia of joint"] == pytest.approx(INERTIA, rel=0.05)
    assert values["damping of bearing"] == pytest.approx(DAMPING, rel=0.02)
    return True


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return log(tmp_path_factory.mktemp("joint"))


def test_a_log_with_uneven_times_and_no_titles_gives_the_friction_in_15_lines(folder):
    assert len(RIG.splitlines()) == 15
    measured = rig(folder)
    train, held_out = measured.records
    assert (train.name, train.role) == ("log_train", "train")
    assert (held_out.name, held_out.role) == ("log_held_out", "held_out")
    assert len(train.time) / (len(train.time) + len(held_out.time)) == pytest.approx(0.6, abs=1e-3)
    assert train.time[-1] < held_out.time[0]
    finding = found(measured)
    assert is_the_joint(finding)
    said = "log_train: Time stamps are uneven, with steps of 10 ms to 12 ms"
    assert any(said in one for one in record_remarks(finding))
    # What was revised keeps the factor and the sign, and is read again.
    revised = revised_mechanism("A joint", finding)
    assert revised.mechanism.inertias["joint"].factor == 3.0
    assert revised.mechanism.inputs[0].gain.value == GAIN


def test_a_speed_is_integrated_and_what_that_leaves_open_is_said(folder):
    speed = "column = 3", "column = 6"
    finding = found(rig(folder, speed, ('"rad"', '"rad/s"')))
    assert is_the_joint(finding)
    assert any("where it began is not known" in one for one in record_remarks(finding))
    # Both parts count from the first row of the file.
    first, second = finding.records
    start = moved(np.array([first.time[0]]))[0][0]
    for one in (first, second):
        angle = moved(one.time)[0] - start
        assert np.std(one.channels["joint"] - angle) < 1e-3
        assert abs(np.mean(one.channels["joint"] - angle)) < 1e-2
    with pytest.raises(InvalidInput, match=r"unit of the coordinate joint is 'rad/s2'"):
        rig(folder, speed, ('"rad"', '"rad/s2"'))


def test_a_unit_of_speed_for_a_column_of_positions_is_refused():
    for title, refused in (("motorPosition", True), ("angle rad", True), ("pos_rate", False)):
        channel = Channel(title, "r/min")
        listed = ListedRecord(
            "records[0]", {}, TableLayout("csv", {"q": channel}, None, 100.0, 0), (), None
        )
        if refused:
            with pytest.raises(InvalidInput, match=r"unit of the coordinate q is 'r/min'.*title"):
                _with_positions(listed, ["q"])
        else:
            assert _with_positions(listed, ["q"])[0].channels["q"].integrated


def test_without_a_gain_the_ratios_are_determined_and_that_is_said(folder):
    measured = rig(
        folder,
        ("gain = { value = -7.6 }\n", ""),
        ('"A" }', '"A", scale = -1.0 }'),
        ("inertia = { value = 1.0, factor = 3.0 }", "inertia = { value = 0.1, factor = 10.0 }"),
        ("damping = { value = 1.0, factor = 3.0 }", "damping = { value = 0.1, factor = 10.0 }"),
    )
    finding = found(measured)
    assert is_the_joint(finding, unit=-GAIN)
    assert any("are in units of current" in one for one in limits(finding))
    with pytest.raises(InvalidInput, match=r"line 7: inputs\.current\.gain is None.*inertia of"):
        rig(folder, ("gain = { value = -7.6 }\n", ""), ("1.0, factor = 3.0 }\n[p", "1.0 }\n[p"))


def test_a_gain_is_needed_where_something_else_has_a_scale_of_its_own(folder):
    no_gain = "gain = { value = -7.6 }\n", ""
    second = "[inputs.load]\nacts = { joint = 1.0 }\ngain = { value = 1.0, factor = 3.0 }\n[table]"
    sensor = "[ports.sensor]\nmotion = { joint = 1.0 }\nread = true\n[inputs"
    law = '[[effects]]\nname = "coulomb_friction"\nport = "bearing"\nlevel = 1.0\n[table]'
    for change in (("[table]", second), ("[inputs", sensor), ("[table]", law)):
        with pytest.raises(InvalidInput, match=r"inputs\.current\.gain is None, .*of its own"):
            rig(folder, no_gain, change)
    # Two inputs without a gain are not in one unit either.
    with pytest.raises(InvalidInput, match=r"gain of current is None"):
        Mechanism(
            {"joint": BelievedValue(1.0, factor=3.0)},
            inputs=[Input(name, {"joint": 1.0}, scaled=False) for name in ("current", "load")],
        )


def test_effects_of_a_revised_model_without_a_gain_are_in_units_of_the_signal(folder):
    law = '[[effects]]\nname = "coulomb_friction"\nport = "bearing"\nlevel = 1.0\n[table]'
    given = rig(folder, ("[table]", law)).model
    inputs = [replace(one, scaled=False) for one in given.mechanism.inputs]
    revised = replace(given, mechanism=replace(given.mechanism, inputs=inputs))
    (folder / "revised.toml").write_text(model_text(revised))
    records = RIG[RIG.index("[table]") :]
    (folder / "rig.toml").write_text(f'title = "again"\nmodel = "revised.toml"\n{records}')
    assert read_rig(folder).effects == given.effects


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("value = -7.6", "value = -7.6, factor = 2, tolerance = 0.1"), "gain.factor is 2.0"),
        (("value = -7.6", "value = -7.6, factor = 0.5"), "gain.factor is 0.5"),
        (("1.0, factor = 3.0 }\n[i", "-1.0 }\n[i"), "ports.bearing.damping.value is -1.0"),
        (('file = "log.csv"', 'files = { joint = "log.csv" }'), "records[0].files is ['joint']"),
        (('file = "log.csv"', 'files = { torque = "log.csv" }'), "files.channel is 'torque'"),
        (('file = "log.csv"', 'file = "log.csv"\nshare = [0, 0.5]'), "records[0].role is None"),
        (('"rad", divided_by = 101.0', '"rad", divided_by = 0'), "joint.divided_by is 0.0"),
    ],
)
def test_what_goes_wrong_is_named_with_its_line(folder, change, words):
    with pytest.raises(InvalidInput) as caught:
        rig(folder, change)
    assert str(caught.value).startswith("rig.toml, line ")
    assert words in str(caught.value)


def test_the_limits_of_a_factor_and_of_a_negative_value():
    assert BelievedValue(6.0, factor=3.0).limits == (2.0, 18.0)
    assert BelievedValue(-6.0, factor=3.0).limits == (-18.0, -2.0)
    assert BelievedValue(-6.0, 0.5).limits == (-9.0, -3.0)
    assert BelievedValue(-6.0).known
    with pytest.raises(InvalidInput, match="damping of bearing"):
        Mechanism(
            {"q": BelievedValue(1.0)}, [Port("bearing", {"q": 1.0}, damping=BelievedValue(-1.0))]
        )


def test_a_model_with_a_factor_a_negative_and_an_unknown_gain_is_written_and_read(folder, tmp_path):
    for change in ((), (("gain = { value = -7.6 }\n", ""),)):
        model = rig(folder, *change).model
        (tmp_path / "model.toml").write_text(model_text(model))
        assert read_mechanism_model(tmp_path / "model.toml") == model


def several(folder, rates=(200.0, 200.0), rows=(2400, 2400), timed=False):
    """Write angle and current of a joint to files of their own."""
    for name, place, rate, count in zip("ab", (0, 2), rates, rows, strict=True):
        time = np.arange(count) / rate
        lines = [repr(one) for one in moved(time)[place].tolist()]
        if timed:
            lines = [f"{at!r},{line}" for at, line in zip(time.tolist(), lines, strict=True)]
        text = "\n".join(["t,Joint" if timed else "Joint", *lines])
        (folder / f"{name}.csv").write_text(text + "\n")
    table = 'time = { column = "t", unit = "s" }' if timed else "sample_rate = 200.0"
    return rig(
        folder,
        (BY_ROWS, table),
        ("column = 3", 'column = "Joint"'),
        ("column = 9", 'column = "Joint"'),
        (", divided_by = 101.0", ""),
        (
            'file = "log.csv"',
            'role = "train"\nfiles = { joint = "a.csv", current = "b.csv" }\nshare = [0.0, 0.6]\n'
            '[[records]]\nrole = "held_out"\nshare = [0.6, 1.0]\n'
            'files = { joint = "a.csv", current = "b.csv" }',
        ),
    )


def test_a_record_of_several_files_has_all_their_channels(tmp_path):
    first, second = several(tmp_path).records
    assert (first.name, second.name) == ("a_train", "a_held_out")
    for one in (first, second):
        angle, _, current = moved(one.time)
        np.testing.assert_allclose(one.channels["joint"], angle, atol=1e-8)
        np.testing.assert_allclose(one.channels["current"], current, atol=1e-8)
        assert not one.remarks
    with pytest.raises(InvalidInput, match=r"rows of the files is \{'a\.csv': 1440, 'b\.csv': 600"):
        several(tmp_path, rows=(2400, 1000))


def test_files_of_one_clock_need_one_rate_and_are_known_to_a_tenth_of_it(tmp_path):
    with pytest.raises(InvalidInput, match=r"rates of the files, Hz .* 200\.0, 'b\.csv': 500\.0"):
        several(tmp_path, (200.0, 500.0), (2400, 6000), timed=True)
    measured = several(tmp_path, (200.0, 200.5), timed=True)
    for one in measured.records:
        np.testing.assert_allclose(one.channels["joint"], moved(one.time)[0], atol=1e-5)
        assert "a.csv, b.csv are taken at the steps of the finest file" in one.remarks[0]
        with pytest.raises(InvalidInput, match=r"ten rows in a period"):
            fine_enough([one], 0.3 / one.step)
    assert not several(tmp_path, timed=True).records[0].remarks


def test_rows_that_were_brought_to_even_steps_are_used_with_ten_in_a_period(folder):
    measured = rig(folder)
    (record, _) = measured.records
    tenth = 0.1 / record.step
    assert f"Motion is known up to {tenth:.4g} Hz" in record.remarks[0]
    with pytest.raises(InvalidInput, match=r"sampling rate of record log_train .*ten rows in a p"):
        found(replace(measured, cutoff=1.2 * tenth))
    # A motion with five rows in a period: between them it is not known.
    time = 0.01 * np.arange(3000.0)
    signals = {"joint": np.sin(40.0 * np.pi * time), "current": np.cos(time)}
    for interpolated in (False, True):
        one = Record("one", "train", time, signals, interpolated=interpolated)
        assert (usual_cutoff(measured.mechanism, [one]) > 10.1) != interpolated


def test_rates_that_differ_by_rounding_only_are_no_reason_to_refuse():
    channels = {"q": np.sin(np.arange(4000.0))}
    records = [
        Record(str(n), "train", np.arange(4000.0) / (750.0 - n * 4.2e-6), channels) for n in (0, 1)
    ]
    mechanism = Mechanism(
        {"q": BelievedValue(1.0)}, [Port("p", {"q": 1.0})], [Input("q2", {"q": 1})]
    )
    for share in (0.1, 1.0 / 3.0):
        cutoff = highest_share(records[0].step, share)
        fine = fine_enough(records, cutoff)
        check_sampling(mechanism, fine, cutoff)
        # Both are treated alike.
        assert len(fine[0].time) == len(fine[1].time)
