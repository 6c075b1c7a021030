"""Campaigns: written and read back, and every fault named with its file and line."""

import gzip
import shutil
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from night import others_at_night
from places import SHARED
from small_campaigns import small_campaign

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import (
    Rig,
    read_campaign,
    write_campaign,
)
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.units import ARCSEC

RIGS = SHARED / "rig"


@pytest.fixture(scope="module")
def campaign():
    return small_campaign()


@pytest.fixture
def folder(campaign, tmp_path):
    write_campaign(campaign, tmp_path / "rig")
    return tmp_path / "rig"


def edit(path, old, new):
    packed = path.suffix == ".gz"
    text = gzip.decompress(path.read_bytes()).decode() if packed else path.read_text()
    assert text.count(old) >= 1
    text = text.replace(old, new, 1)
    path.write_bytes(gzip.compress(text.encode()) if packed else text.encode())


def test_what_is_written_is_read_back(campaign, folder):
    read = read_campaign(folder)
    assert (read.title, read.drive) == (campaign.title, campaign.drive)
    for name in ("believed", "rig"):
        for field in fields(getattr(campaign, name)):
            value = getattr(getattr(read, name), field.name)
            expected = getattr(getattr(campaign, name), field.name)
            assert value == (
                expected if isinstance(expected, str) else pytest.approx(expected, rel=1e-11)
            )
    assert [record.name for record in read.train] == ["slow", "empty"]
    assert [record.name for record in read.held_out] == ["back"]
    pairs = zip((*read.running, *read.torsion), (*campaign.running, *campaign.torsion), strict=True)
    resolution = {"input_angle": 1e-9, "output_angle": 1e-11, "output_torque": 1e-5}
    for ours, theirs in pairs:
        for field in fields(theirs):
            value, expected = getattr(ours, field.name), getattr(theirs, field.name)
            if expected is None or isinstance(expected, str):
                assert value == expected
            else:
                close = 0.51 * resolution.get(field.name, 1e-6)
                np.testing.assert_allclose(value, expected, rtol=1e-11, atol=close)


def test_what_is_good_enough_is_read_in_its_units(campaign, folder, tmp_path):
    assert (campaign.good_enough_error, campaign.good_enough_torque) == (None, None)
    assert "good_enough" not in (folder / "campaign.toml").read_text()
    edit(folder / "campaign.toml", "title", "good_enough_arcsec = 2\ngood_enough_N_m = 0.05\ntitle")
    found = read_campaign(folder)
    assert found.good_enough_error == pytest.approx(2.0 * ARCSEC)
    assert found.good_enough_torque == 0.05
    write_campaign(found, tmp_path / "again")
    again = read_campaign(tmp_path / "again")
    assert again.good_enough_error == pytest.approx(found.good_enough_error, rel=1e-11)
    assert again.good_enough_torque == found.good_enough_torque


@pytest.mark.parametrize("key", ["good_enough_arcsec", "good_enough_N_m"])
@pytest.mark.parametrize("value", ["0", "-1.0", "nan", '"small"'])
def test_good_enough_is_above_zero(folder, key, value):
    edit(folder / "campaign.toml", "title", f"{key} = {value}\ntitle")
    with pytest.raises(InvalidInput, match=rf"line 1.*{key}|{key}.*line 1"):
        read_campaign(folder)


@pytest.mark.parametrize("field", ["good_enough_error", "good_enough_torque"])
def test_good_enough_is_checked_in_python_too(campaign, field):
    with pytest.raises(InvalidInput, match=field):
        replace(campaign, **{field: -1.0})


def test_writing_again_gives_the_same_bytes(folder, tmp_path):
    write_campaign(read_campaign(folder), tmp_path / "again")
    files = sorted(path.name for path in folder.iterdir())
    assert files == sorted(path.name for path in (tmp_path / "again").iterdir())
    for name in files:
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_writing_is_all_or_nothing(campaign, tmp_path, monkeypatch):
    target = tmp_path / "out"
    target.mkdir()
    (target / "precious").write_text("keep")
    with pytest.raises(InvalidInput, match="new or empty"):
        write_campaign(campaign, target)
    assert (target / "precious").read_text() == "keep"

    def full_disk(path, columns):
        raise OSError("no space left")

    monkeypatch.setattr("pymoo_hdte.discrepancy._records.campaign_files.write_columns", full_disk)
    with pytest.raises(OSError, match="no space"):
        write_campaign(campaign, tmp_path / "new")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_comments_of_the_shared_form_are_the_defaults(campaign, folder):
    toml = folder / "campaign.toml"
    sentence = (
        'control = "speed loop at the input: T = 0.02*(w_set - w) + 0.5*integral(w_set - w)'
        ' + constant, N.m and rad/s"\n'
    )
    edit(toml, "proportional_Nms_per_rad = 0.02\nintegral_Nm_per_rad = 0.5\n", sentence)
    for line in (
        "tolerance = 0.1\nstatic_error_tolerance = 0.3\n",
        "angle_quantisation_arcsec = 0.3\n",
        "input_torque_gain = 0.005\ninput_torque_zero_Nm = 0.003\n",
        "output_torque_gain = 0.005\noutput_torque_zero_Nm = 0.1\n",
    ):
        edit(toml, line, "")
    read = read_campaign(folder)
    for field in fields(Rig):
        assert getattr(read.rig, field.name) == pytest.approx(getattr(campaign.rig, field.name))
    assert (read.believed.tolerance, read.believed.error_tolerance) == (0.1, 0.3)


def test_a_record_is_fitted_or_held_out_as_its_role_says(campaign):
    assert [record.name for record in campaign.train] == ["slow", "empty"]
    assert [record.name for record in campaign.held_out] == ["back"]


def test_no_held_out_record_is_no_error(campaign):
    alone = replace(campaign, running=campaign.train)
    assert alone.held_out == ()


ORDERS = "[\n    1,\n    2,\n    2.04,\n]"
AMPLITUDES = "[\n    4,\n    9,\n    5,\n]"
LINES_OF_ERROR = f"static_error_orders = {ORDERS}\nstatic_error_amplitudes_arcsec = {AMPLITUDES}"
NO_LINES = "static_error_orders = []\nstatic_error_amplitudes_arcsec = []"
BAD_FIELDS = {
    "unknown key": ("ratio = 50", "ratio = 50\nrattle = 1", "line 6: believed.rattle"),
    "missing key": ("angle_noise_arcsec = 0.7\n", "", "line 26: rig.angle_noise_arcsec"),
    "text for a number": ("ratio = 50", 'ratio = "50"', "line 5: believed.ratio"),
    "negative": (AMPLITUDES, "[4, -9, 5]", "line 18: believed.static_error_ampl"),
    "number for a list": (f"= {ORDERS}", "= 1", "line 13: believed.static_error_orders"),
    "not finite": ("stiffness_Nm_per_rad = 25830", "stiffness_Nm_per_rad = inf", "line 6"),
    "unknown test": ('test = "running"', 'test = "walking"', r"line 42: record\[0\].test"),
    "unknown role": ('role = "held_out"', 'role = "spare"', r"line 68: record\[2\].role"),
    "missing file": ('"empty.csv.gz"', '"full.csv.gz"', r"line 51: record\[1\].file"),
    "file elsewhere": ('"empty.csv.gz"', '"../empty.csv.gz"', r"line 51: record\[1\].file"),
    "listed twice": ('"empty.csv.gz"', '"slow.csv.gz"', r"line 51: record\[1\].file"),
    "part of a sample": ("samples_averaged = 20", "samples_averaged = 2.5", "line 46"),
    "control": ("proportional_Nms_per_rad = 0.02", 'control = "by hand"', "line 27: rig.control"),
    "no TOML": ("[rig]", "[rig", "at line 26"),
    "wrong speed": ("rpm = 500", "rpm = 52.36", r"slow.csv.gz, lines 2 to 302: mean speed"),
    "wrong load": ("load_torque_Nm = 20", "load_torque_Nm = 2", "slow.csv.gz.*output_torque"),
    "wrong rate": ("sample_rate_Hz = 50", "sample_rate_Hz = 20", "slow.csv.gz.*step of time"),
    "wrong ratio": ("ratio = 50", "ratio = 48", "slow.csv.gz.*transmission error"),
    "wrong turn": ("ratio = 50", "ratio = 52", "slow.csv.gz.*one output turn"),
    "wrong stiffness": ("rad = 25830", "rad = 450", "torsion.csv.gz.*slope"),
    "stiffness in N.m/arcmin": (
        "rad = 25830",
        "rad = 7.5",
        r"torsion.csv.gz.*slope.*nominal stiffness of 7\.5 N\.m/rad.*the unit of either",
    ),
    "stiffness without its power of ten": (
        "rad = 25830",
        "rad = 2.583",
        r"line 6: believed.stiffness.* is 2\.583.*in 10\^4 N\.m/rad",
    ),
    "inertia in g.cm2": (
        "inertia_kgm2 = 0.000197",
        "inertia_kgm2 = 1970",
        "line 8: believed.input_in",
    ),
    "inertia in kg.cm2": (
        "load_inertia_kgm2 = 0.08",
        "load_inertia_kgm2 = 8000",
        "line 12: .*load_in",
    ),
    "amplitudes in rad": (AMPLITUDES, "[4, 9e-6, 5]", "line 18: .*arcsec is 9e-06"),
    "no line": (LINES_OF_ERROR, NO_LINES, "line 13: believed.static_error_orders"),
    "frozen base": ("\ntolerance = 0.1", "\ntolerance = 0", "line 23: believed.tolerance"),
    "frozen error": ("error_tolerance = 0.3", "error_tolerance = 0", "line 24: .*error_tolerance"),
    "noise in mN.m": (
        "torque_noise_Nm = 0.003",
        "torque_noise_Nm = 3",
        "line 31: rig.input_torque_n",
    ),
    "angle noise in rad": (
        "angle_noise_arcsec = 0.7",
        "angle_noise_arcsec = 1e5",
        "line 29: .*angle_n",
    ),
}


@pytest.mark.parametrize("fault", BAD_FIELDS)
def test_a_bad_field_is_named_with_its_line(folder, fault):
    old, new, message = BAD_FIELDS[fault]
    edit(folder / "campaign.toml", old, new)
    with pytest.raises(InvalidInput, match=message):
        read_campaign(folder)


BAD_CELLS = {
    "missing column": ("input_torque_Nm", "torque", "line 1: columns"),
    "text": ("\n0.040000,", "\nsoon,", "line 4: time_s"),
    "not a number": ("\n0.040000,", "\nnan,", "line 4: time_s"),
    "empty cell": ("\n0.040000,", "\n,", "line 4: time_s"),
    "missing cell": ("\n0.040000,", "\n", "line 4: number of cells"),
    "blank line": ("\n0.040000,", "\n\n0.040000,", "line 4: number of cells"),
    "time": ("\n0.040000,", "\n0.010000,", r"line 4: time\[2\]"),
}


@pytest.mark.parametrize("fault", BAD_CELLS)
def test_a_bad_cell_is_named_with_its_line(folder, fault):
    old, new, message = BAD_CELLS[fault]
    edit(folder / "slow.csv.gz", old, new)
    with pytest.raises(InvalidInput, match=f"^slow.csv.gz, {message}"):
        read_campaign(folder)


@pytest.mark.parametrize("content", [b"", b"time_s", gzip.compress(b"x" * 999, mtime=0)[:-9]])
def test_a_file_that_is_no_record_is_refused(folder, content):
    (folder / "slow.csv.gz").write_bytes(content)
    with pytest.raises(InvalidInput, match="slow"):
        read_campaign(folder)


BAD_CHANNELS = {
    "input angle in degrees": {"input_angle": 57.3},
    "output angle in degrees": {"output_angle": 57.3},
    "both in degrees": {"input_angle": 57.3, "output_angle": 57.3},
    "output torque in kN.m": {"output_torque": 1e-3},
    "output torque with the other sign": {"output_torque": -1.0},
    "input torque in N.mm": {"input_torque": 1e3},
    "input torque in kN.m": {"input_torque": 1e-3},
    "time in ms": {"time": 1e3},
    "dead input angle": {"input_angle": 0.0},
    "dead output angle": {"output_angle": 0.0},
    "dead input torque": {"input_torque": 0.0},
    "dead output torque": {"output_torque": 0.0},
}


@pytest.mark.parametrize("fault", BAD_CHANNELS)
def test_a_wrong_unit_or_a_dead_channel_is_refused(campaign, fault):
    slow = campaign.running[0]
    scaled = {name: factor * getattr(slow, name) for name, factor in BAD_CHANNELS[fault].items()}
    with pytest.raises(InvalidInput):
        replace(campaign, running=(replace(slow, **scaled),))


@pytest.mark.parametrize("factor", [1e3, -1.0])
def test_a_motor_torque_that_no_friction_explains_is_refused(campaign, factor):
    loaded, empty, _ = campaign.running
    spoilt = replace(empty, input_torque=factor * empty.input_torque)
    with pytest.raises(InvalidInput, match="empty: mean of input_torque"):
        replace(campaign, running=(loaded, spoilt))


def test_swapped_channels_are_refused(campaign):
    slow = campaign.running[0]
    torques = replace(slow, input_torque=slow.output_torque, output_torque=slow.input_torque)
    angles = replace(slow, input_angle=slow.output_angle, output_angle=slow.input_angle)
    for swapped in (torques, angles):
        with pytest.raises(InvalidInput, match="slow"):
            replace(campaign, running=(swapped,))


def test_too_little_is_refused(campaign):
    slow = campaign.running[0]
    channels = [field.name for field in fields(slow) if hasattr(getattr(slow, field.name), "shape")]
    short = replace(slow, **{name: getattr(slow, name)[:250] for name in channels})
    with pytest.raises(InvalidInput, match="one output turn"):
        replace(campaign, running=(short,))
    with pytest.raises(InvalidInput, match="running records"):
        replace(campaign, running=())


def test_a_copy_of_a_record_is_refused(campaign):
    copy = replace(campaign.running[0], name="copy", role="held_out")
    with pytest.raises(InvalidInput, match="repeats slow"):
        replace(campaign, running=(*campaign.running, copy))


LINES = st.integers(0, 400)
GARBAGE = st.one_of(
    st.just(None),
    st.text(max_size=20),
    st.sampled_from(["1e308", "nan", "[[record]]", "[rig]", "ratio = 1e-300", "=", "1,2,3,4,5"]),
)


@pytest.mark.nightly
@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    file=st.sampled_from(["campaign.toml", "slow.csv.gz", "torsion.csv.gz"]),
    at=LINES,
    garbage=GARBAGE,
    swallow=st.booleans(),
)
def test_a_garbled_line_gives_an_error_or_a_campaign(folder, tmp_path, file, at, garbage, swallow):
    shutil.copytree(folder, tmp_path / "garbled", dirs_exist_ok=True)
    path = tmp_path / "garbled" / file
    packed = file.endswith(".gz")
    text = gzip.decompress(path.read_bytes()) if packed else path.read_bytes()
    lines = text.decode().split("\n")
    at %= len(lines)
    kept = "" if swallow else lines[at]
    lines[at : at + 1] = [] if garbage is None else [kept + garbage]
    text = "\n".join(lines).encode(errors="surrogatepass")
    path.write_bytes(gzip.compress(text) if packed else text)
    refused = ""
    try:
        read_campaign(tmp_path / "garbled")
    except InvalidInput as error:
        refused = error.field
    assert refused == "" or ".toml" in refused or ".csv.gz" in refused


SHARED_CAMPAIGNS = sorted(path.parent.name for path in RIGS.glob("*/campaign.toml"))
needs_shared = pytest.mark.skipif(not RIGS.is_dir(), reason="the shared rig data are not here")


@needs_shared
@pytest.mark.parametrize("name", others_at_night(SHARED_CAMPAIGNS, *SHARED_CAMPAIGNS[:4]))
def test_shared_campaigns_are_read(name):
    read = read_campaign(RIGS / name)
    assert (len(read.train), len(read.held_out), len(read.torsion)) == (13, 6, 1)
    assert (read.rig.proportional, read.rig.integral) == (0.02, 0.5)
    assert read.rig.angle_quantisation == pytest.approx(0.3 * ARCSEC)
    for record in read.running:
        # The load of a record is set to about a per cent only, beside gain and zero.
        limit = 0.03 * record.load_torque + 3.0 * read.rig.output_torque_zero
        assert record.output_torque.mean() == pytest.approx(record.load_torque, abs=limit)


@pytest.mark.parametrize("origin", [0.0, 1e-3, 7.3, 1553.0, 1.7e9])
def test_the_clock_of_a_record_does_not_move_it_in_the_session(campaign, origin):
    shifted = [replace(record, time=record.time + origin) for record in campaign.running]
    found = measure(campaign, shifted, [1.0, 2.0]).conditions.elapsed
    wanted = [
        record.elapsed + (record.time[-1] - record.time[0]) / 2.0 for record in campaign.running
    ]
    # To within the first row, which a record's own clock counts from its first sample.
    rows = [1.0 / record.sample_rate for record in campaign.running]
    assert np.all(np.abs(found - wanted) <= rows)


def plainly(folder, name):
    """Unpack a record's file in a campaign."""
    packed = folder / f"{name}.csv.gz"
    (folder / f"{name}.csv").write_bytes(gzip.decompress(packed.read_bytes()))
    packed.unlink()
    toml = folder / "campaign.toml"
    toml.write_text(toml.read_text().replace(f"{name}.csv.gz", f"{name}.csv"))


def test_a_plain_csv_file_is_read_like_a_compressed_one(campaign, tmp_path):
    write_campaign(campaign, tmp_path / "c")
    packed = read_campaign(tmp_path / "c")
    for record in (*campaign.running[:2], *campaign.torsion):
        plainly(tmp_path / "c", record.name)
    plain = read_campaign(tmp_path / "c")
    assert [one.name for one in plain.running] == [one.name for one in packed.running]
    for one, other in zip(
        (*plain.running, *plain.torsion), (*packed.running, *packed.torsion), strict=True
    ):
        for field in fields(one):
            assert np.array_equal(getattr(one, field.name), getattr(other, field.name))


def test_a_fault_in_a_plain_csv_file_names_it(campaign, tmp_path):
    name = campaign.running[0].name
    write_campaign(campaign, tmp_path / "c")
    plainly(tmp_path / "c", name)
    file = tmp_path / "c" / f"{name}.csv"
    text = file.read_text()
    rows = text.splitlines()[1:]
    toml = tmp_path / "c" / "campaign.toml"
    beliefs = toml.read_text()
    toml.write_text(beliefs.replace("input_speed_rpm = 500", "input_speed_rpm = 900", 1))
    with pytest.raises(InvalidInput, match=rf"{name}\.csv, lines 2 to \d+: mean speed"):
        read_campaign(tmp_path / "c")
    toml.write_text(beliefs)
    file.write_bytes(gzip.compress(text.encode()))
    with pytest.raises(InvalidInput, match=rf"^{name}\.csv is .*allowed: CSV text"):
        read_campaign(tmp_path / "c")
    file.write_text(text.replace(rows[3], rows[3].rsplit(",", 1)[0]))
    with pytest.raises(InvalidInput, match=rf"^{name}\.csv, line 5: number of cells"):
        read_campaign(tmp_path / "c")


def test_a_record_stands_in_one_file(campaign, tmp_path):
    name = campaign.running[0].name
    write_campaign(campaign, tmp_path / "c")
    toml = tmp_path / "c" / "campaign.toml"
    packed = (tmp_path / "c" / f"{name}.csv.gz").read_bytes()
    (tmp_path / "c" / f"{name}.csv").write_bytes(gzip.decompress(packed))
    entry = toml.read_text().split("\n[[record]]")[1].replace(".csv.gz", ".csv")
    toml.write_text(f"{toml.read_text()}\n[[record]]{entry}")
    with pytest.raises(InvalidInput, match=r"\.file is .*allowed: each name once"):
        read_campaign(tmp_path / "c")


def test_a_torsion_sweep_that_is_held_out_is_refused_where_it_is_said(campaign, tmp_path):
    (sweep,) = campaign.torsion
    with pytest.raises(InvalidInput, match="role is 'held_out', allowed: 'train' for a torsion"):
        replace(sweep, role="held_out")
    write_campaign(campaign, tmp_path / "c")
    toml = tmp_path / "c" / "campaign.toml"
    before, after = toml.read_text().split('test = "torsion"')
    toml.write_text(f'{before}test = "torsion"{after.replace("train", "held_out")}')
    with pytest.raises(InvalidInput, match=r"^campaign\.toml, line \d+: record\[3\]\.role is"):
        read_campaign(tmp_path / "c")
