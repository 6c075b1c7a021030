"""Rigs in folders: read as described, and every mistake is named with its place."""

import hashlib
import random

import numpy as np
import pytest

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.rig_files import RIG_FILE, read_rig
from pymoo_hdte.discrepancy._records.rig_model import (
    MechanismModel,
    model_text,
    read_mechanism_model,
)
from pymoo_hdte.effects.effect import effect_named
from pymoo_hdte.mechanism import (
    BelievedValue,
    ErrorLine,
    Input,
    LawAt,
    Loop,
    Mechanism,
    Port,
)
from pymoo_hdte.mechanism.quantity_units import unit_of

MODEL = """\
title = "A rig"
cutoff = 40.0
[coordinates.q]
inertia = { value = 100.0, tolerance = 0.5 }
[coordinates.w]
inertia = { value = 2 }
[ports.joint]
motion = { q = 1.0, w = -0.5 }
damping = { value = 300.0, tolerance = 1.0 }
[ports.cell]
motion = { w = 1.0 }
stiffness = { value = 7e4 }
read = true
[[ports.cell.error]]
coordinate = "q"
order = 2.0
amplitude = 1e-4
phase = 0.25
[inputs.vir]
acts = { q = 1.0 }
gain = { value = 35.15 }
[[loops]]
input = "vir"
reference = "qg"
coordinate = "q"
position_gain = 38995.8
speed_gain = 243.45
limit = 10.0
[[effects]]
name = "coulomb_friction"
port = "joint"
level = 20.4
[[effects]]
name = "kinematic_error"
port = "cell"
order = 3.0
phase = 0.5
amplitude = 0.1
"""
TABLE = """\
[table]
format = "csv"
sample_rate = 100.0
channels.q = { column = "q", unit = "mm" }
"""
RECORDS = """\
[[records]]
file = "first.csv"
role = "train"
sha256 = "SHA"
[[records]]
file = "more/second.csv"
role = "held_out"
name = "another"
[records.table]
format = "csv"
time = { column = "t", unit = "s" }
channels.w = { column = "q", unit = "m" }
"""
MECHANISM = Mechanism(
    {"q": BelievedValue(100.0, 0.5), "w": BelievedValue(2.0)},
    [
        Port("joint", {"q": 1.0, "w": -0.5}, damping=BelievedValue(300.0, 1.0)),
        Port(
            "cell",
            {"w": 1.0},
            BelievedValue(7e4),
            read=True,
            error=(ErrorLine("q", 2.0, 1e-4, 0.25),),
        ),
    ],
    [Input("vir", {"q": 1.0}, BelievedValue(35.15))],
    [Loop("vir", "qg", "q", 38995.8, 243.45, 10.0)],
)
FRICTION = LawAt(
    "coulomb_friction", "joint", effect_named("coulomb_friction").law_of({"level": 20.4})
)
READING = {"order": 3.0, "phase": 0.5, "amplitude": 0.1}
ERROR = LawAt("kinematic_error", "cell", effect_named("kinematic_error").law_of(READING))
ROWS = "t,q\n" + "".join(f"{row / 100:.2f},{row * row}\n" for row in range(20))


def put_data(folder):
    (folder / "more").mkdir(parents=True)
    for file in ("first.csv", "more/second.csv"):
        (folder / file).write_text(ROWS)


@pytest.fixture
def folder(tmp_path):
    put_data(tmp_path / "rig")
    digits = hashlib.sha256(ROWS.encode()).hexdigest()[:14]
    text = MODEL + TABLE + RECORDS.replace("SHA", digits)
    (tmp_path / "rig" / RIG_FILE).write_text(text)
    return tmp_path / "rig"


def test_a_record_tells_how_many_rows_of_its_file_were_not_finite(folder):
    lost = ROWS.replace("0.00,0\n", "0.00,\n").replace("0.19,361\n", "0.19,nan\n")
    (folder / "more" / "second.csv").write_text(lost)
    assert [record.dropped for record in read_rig(folder).records] == [0, 2]


def test_rig_is_read_as_described(folder):
    rig = read_rig(folder)
    assert (rig.title, rig.cutoff, rig.source) == ("A rig", 40.0, str(folder / RIG_FILE))
    assert rig.mechanism == MECHANISM
    assert rig.effects == (FRICTION, ERROR)
    first, second = rig.records
    assert (first.name, first.role, second.name, second.role) == (
        *("first", "train"),
        *("another", "held_out"),
    )
    np.testing.assert_allclose(first.channels["q"], 1e-3 * np.arange(20.0) ** 2, rtol=1e-12)
    np.testing.assert_allclose(second.channels["w"], np.arange(20.0) ** 2)
    assert set(first.channels) == {"q"}
    assert set(second.channels) == {"w"}
    np.testing.assert_allclose(first.time, second.time, atol=1e-12)


@pytest.mark.parametrize(
    ("unit", "position", "force"), [("deg", "rad", "N.m"), ("mm", "m", "N"), ("A", "SI", "SI")]
)
def test_a_coordinate_of_which_no_file_tells_is_neither_angle_nor_length(
    unit, position, force, tmp_path
):
    (tmp_path / "one.csv").write_text(ROWS)
    record = '[[records]]\nfile = "one.csv"\nrole = "train"\n'
    text = MODEL + TABLE.replace("mm", unit) + record
    (tmp_path / RIG_FILE).write_text(text)
    model = read_rig(tmp_path).model
    for mechanism in (model.mechanism, model_from_text(model_text(model), tmp_path)):
        assert unit_of(mechanism, "q", "position") == position
        assert unit_of(mechanism, "q") == force
        # Of `w` there is no column, and the joint moves with both.
        assert {unit_of(mechanism, name) for name in ("w", "cell", "joint")} == {"SI"}


def model_from_text(text, folder):
    (folder / "model.toml").write_text(text)
    return read_mechanism_model(folder / "model.toml").mechanism


def test_path_of_the_file_and_another_folder_of_data(folder, tmp_path):
    (folder / RIG_FILE).rename(tmp_path / "mine.toml")
    rig = read_rig(str(tmp_path / "mine.toml"), data=str(folder))
    assert [record.name for record in rig.records] == ["first", "another"]
    with pytest.raises(InvalidInput, match=r"mine\.toml, line \d+: records\[0\]\.file is 'first"):
        read_rig(tmp_path / "mine.toml")


def test_written_model_with_records_is_read(folder):
    text = (
        model_text(MechanismModel("A rig", MECHANISM, (FRICTION,), 12.5))
        + TABLE
        + RECORDS.replace("SHA", 14 * "0")
    )
    (folder / RIG_FILE).write_text(text.replace('sha256 = "00000000000000"\n', ""))
    rig = read_rig(folder)
    assert (rig.mechanism, rig.effects, rig.cutoff) == (MECHANISM, (FRICTION,), 12.5)


BAD = [
    ('title = "A rig"\n', "", "rig.toml, line 1: title is None"),
    ("cutoff = 40.0", "cutoff = -1", "line 2: cutoff is -1.0, allowed: a finite number above 0"),
    ("cutoff = 40.0", "cut_off = 40.0", "line 2: cut_off is 40.0, allowed: no such field here"),
    ("cutoff = 40.0", "cutoff 40.0", "allowed: valid TOML"),
    ("tolerance = 0.5", "tolerance = 2", "line 4: coordinates.q.inertia.tolerance is 2.0"),
    ("value = 100.0", "value = 0.0", "line 4: coordinates.q.inertia.value is 0.0"),
    ("value = 100.0", "value = nan", "line 4: coordinates.q.inertia.value is nan"),
    ("{ value = 2 }", "2", "line 6: coordinates.w.inertia is 2, allowed: a table"),
    ("{ value = 2 }", '{ value = 2, unit = "kg" }', "coordinates.w.inertia.unit is 'kg'"),
    ("{ value = 2 }", "{ value = 2 }\nmass = 1", "line 7: coordinates.w.mass is 1"),
    ("{ q = 1.0, w = -0.5 }", "{ x = 1.0 }", "joint.motion is 'x', allowed: one of 'q', 'w'"),
    ("{ q = 1.0, w = -0.5 }", "{ q = true }", "line 8: ports.joint.motion.q is True"),
    ("{ q = 1.0, w = -0.5 }", "{ q = 0 }", "rig.toml: motion of joint is {'q': 0.0}"),
    ("{ q = 1.0, w = -0.5 }", '"q"', "line 8: ports.joint.motion is 'q'"),
    ("value = 300.0", "value = -300.0", "line 9: ports.joint.damping.value is -300.0"),
    ("[ports.joint]", "[ports.q]", "rig.toml: mechanism name is 'q'"),
    ("[ports.joint]", '[ports.""]', "rig.toml: mechanism name is ''"),
    ("read = true", 'read = "yes"', "line 13: ports.cell.read is 'yes', allowed: true or false"),
    ('coordinate = "q"\norder', 'coordinate = "x"\norder', "line 15: ports.cell.error[0].coord"),
    ("phase = 0.25\n", "", "line 14: ports.cell.error[0].phase is None"),
    ("acts = { q = 1.0 }", "acts = { z = 1.0 }", "line 20: inputs.vir.acts is 'z'"),
    ("gain = { value = 35.15 }\n", "", "line 19: inputs.vir.gain is None"),
    ('input = "vir"', 'input = "u"', "line 23: loops[0].input is 'u', allowed: one of 'vir'"),
    ('reference = "qg"', "reference = 1", "line 24: loops[0].reference is 1"),
    ("limit = 10.0", "limit = 0", "line 28: loops[0].limit is 0.0"),
    ("limit = 10.0", "limits = 10.0", "line 28: loops[0].limits is 10.0"),
    ('"coulomb_friction"', '"friction"', "line 30: effects[0].name is 'friction'"),
    ('port = "joint"', 'port = "hip"', "effects[0].port is 'hip', allowed: one of 'joint', 'cell'"),
    ("level = 20.4\n", "", "line 29: effects[0].level is None"),
    ("level = 20.4", "level = inf", "line 32: effects[0].level is inf"),
    ("level = 20.4", "levels = 20.4", "line 32: effects[0].levels is 20.4"),
    (
        'port = "cell"',
        'port = "joint"',
        "line 35: effects[1].port is 'joint', allowed: a port with",
    ),
    ("order = 3.0", "order = 0.0", "line 36: effects[1].order is 0.0"),
    (TABLE, "", "records[0].table is None, allowed: a layout here, or [table]"),
    (RECORDS, "", "rig.toml, line 1: records is None"),
    ('unit = "mm"', 'unit = "furlong"', "table.channels.q.unit is 'furlong'"),
    ('role = "train"', 'role = "test"', "records[0].role is 'test'"),
    ('"another"', '"first"', "records[1].name is 'first', allowed: a name of its own"),
    ('"first.csv"', '"third.csv"', "records[0].file is 'third.csv', allowed: a file inside"),
    ('"first.csv"', '"/etc/passwd"', "records[0].file is '/etc/passwd'"),
    ('"first.csv"', '"C:first.csv"', "records[0].file is 'C:first.csv'"),
    ('"first.csv"', '"more/../first.csv"', "records[0].file is 'more/../first.csv'"),
    ('"first.csv"', "'..\\first.csv'", "records[0].file is '..\\\\first.csv'"),
    ('"first.csv"', '"more"', "records[0].file is 'more'"),
    ('"SHA"', '"abc"', "records[0].sha256 is 'abc', allowed: 8 to 64 hexadecimal digits"),
    ('"SHA"', '"0123456789"', "first.csv: sha256 is"),
    (
        'channels.w = { column = "q"',
        'channels.w = { column = "z"',
        "second.csv, line 1: columns is ['t', 'q'], allowed: t, z",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD)
def test_mistake_is_named_with_its_line(folder, old, new, message):
    text = MODEL + TABLE + RECORDS
    assert text.count(old) >= 1
    (folder / RIG_FILE).write_text(text.replace(old, new, 1).replace('sha256 = "SHA"\n', ""))
    with pytest.raises(InvalidInput) as caught:
        read_rig(folder)
    assert message in str(caught.value)
    assert str(caught.value).startswith(("rig.toml", "first.csv", "second.csv"))


def test_uneven_times_are_brought_to_even_steps_and_the_record_says_so(folder):
    # Steps within 1 % of the median, but one of them not within 1 % of the mean.
    steps = np.r_[0.0, np.full(10, 1.0), np.full(9, 1.0099), 0.9901]
    rows = "".join(f"{one:.6f},{index}\n" for index, one in enumerate(np.cumsum(steps)))
    (folder / "more/second.csv").write_text("t,q\n" + rows)
    first, second = read_rig(folder).records
    assert not first.remarks
    assert "every 1004 ms" in second.remarks[0]
    assert np.ptp(np.diff(second.time)) < 1e-9
    (folder / "more/second.csv").write_text("t,q\n" + rows + "40.0,1\n")
    with pytest.raises(InvalidInput, match=r"^second\.csv, line 23: t is 40\.0"):
        read_rig(folder)


def test_missing_files_are_errors_of_the_system(tmp_path):
    for wrong in (tmp_path, tmp_path / "none", tmp_path / "none.toml"):
        with pytest.raises(OSError, match="No such file"):
            read_rig(wrong)
    with pytest.raises(OSError, match="No such file"):
        read_mechanism_model(tmp_path / "none.toml")


def test_model_alone_has_no_records(folder):
    with pytest.raises(InvalidInput, match=r"rig\.toml, line \d+: table is .* no such field here"):
        read_mechanism_model(folder / RIG_FILE)


def mutated(text, chance):
    """Return a text in which a word, a line or a character is lost, doubled or another one."""
    mark = chance.choice(["\n", " ", '"', "", "", ""])
    parts = text.split(mark) if mark else list(text)
    at, other = chance.randrange(len(parts)), chance.choice(parts)
    junk = chance.choice(["", "0", "-1", "1e400", "7", "[", "=", "inf", "\0", "q", "true", "'é'"])
    parts[at] = chance.choice([other, junk, parts[at] + mark + other, parts[at] + mark + junk])
    return mark.join(parts)


def test_mutated_files_give_a_rig_or_a_clear_error(folder):
    chance, read = random.Random(5), 0
    for _ in range(600):
        text = MODEL + TABLE + RECORDS.replace('sha256 = "SHA"\n', "")
        (folder / RIG_FILE).write_text(mutated(text, chance), encoding="utf-8")
        try:
            rig = read_rig(folder)
        except (InvalidInput, OSError):
            continue
        read += 1
        (folder / "model.toml").write_text(model_text(rig.model), encoding="utf-8")
        assert read_mechanism_model(folder / "model.toml") == rig.model
    assert 30 < read < 570


def test_noise_that_is_known_goes_to_the_records_that_have_the_channel(folder):
    text = (folder / RIG_FILE).read_text()
    top = 'title = "A rig"\ncutoff = 40.0\n'
    (folder / RIG_FILE).write_text(top + "[noise]\nq = 1e-6\n" + text.removeprefix(top))
    first, other = read_rig(folder).records
    assert first.noise == {"q": 1e-6}
    assert other.noise == {}
    (folder / RIG_FILE).write_text(top + "[noise]\nq = -1.0\n" + text.removeprefix(top))
    with pytest.raises(InvalidInput, match=r"noise\.q"):
        read_rig(folder)
