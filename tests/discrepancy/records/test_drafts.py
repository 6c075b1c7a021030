"""Logs that nobody has described: their columns are recognised, and a draft of them is read."""

import gzip
import json
import shutil
import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from places import SHARED
from small_campaigns import small_campaign

from pymoo_hdte._io.unstated import read_unstated
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.discrepancy import read_campaign, read_rig, write_campaign
from pymoo_hdte.discrepancy._records.drafts.column_roles import Log, find_roles
from pymoo_hdte.discrepancy._records.drafts.column_titles import read_title
from pymoo_hdte.discrepancy._records.drafts.draft import draft_of, write_draft
from pymoo_hdte.discrepancy._records.drafts.log_folder import read_log_folder

RATE = 200.0
MASS, DAMPING, DRY = 0.4, 2.0, 1.5


def joint(seed=3, rows=3000):
    """Return time, position, speed, acceleration and torque of a joint with dry friction; SI."""
    rng = np.random.default_rng(seed)
    time = np.arange(rows) / RATE
    speeds = 2.0 * np.pi * rng.uniform(0.1, 1.0, 6)
    sizes, phases = rng.uniform(0.3, 1.0, 6) / speeds, rng.uniform(0.0, 6.0, 6)
    waves = np.outer(time, speeds) + phases
    position = np.sin(waves) @ sizes
    speed = np.cos(waves) @ (sizes * speeds)
    acceleration = -np.sin(waves) @ (sizes * speeds**2)
    torque = MASS * acceleration + DAMPING * speed + DRY * np.sign(speed)
    noise = rng.standard_normal((4, rows))
    return {
        "time": time,
        "position": position + 1e-4 * noise[0],
        "speed": speed + 3e-3 * noise[1],
        "acceleration": acceleration + 0.05 * noise[2],
        "torque": torque + 0.02 * noise[3],
    }


def write(path, columns, titles, delimiter=",", decimal=".", lines_above=()):
    rows = [delimiter.join(titles)] if titles else []
    for row in np.column_stack(list(columns)):
        rows.append(delimiter.join(f"{one:.9g}".replace(".", decimal) for one in row))
    text = "\n".join([*lines_above, *rows]) + "\n"
    path.write_text(text, encoding="utf-8")


TITLES = {
    "time": [("t [s]", 1.0), ("time_s", 1.0), ("Zeit (ms)", 1e3), ("Timestamp", 1.0)],
    "position": [("pos [deg]", 180.0 / np.pi), ("q", 1.0), ("Position_rad", 1.0)],
    "speed": [("vel", 1.0), ("speed [rpm]", 30.0 / np.pi), ("joint_velocity_3", 1.0)],
    "torque": [("tau_Nm", 1.0), ("Moment [mNm]", 1e3), ("torque", 1.0)],
}
UNITS = {"deg": "deg", "mNm": "mN.m", "ms": "ms"}


@pytest.mark.slow
@settings(max_examples=15)
@given(data=st.data())
def test_columns_are_recognised_in_any_order_notation_and_unit(data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("log")
    signals = joint(data.draw(st.integers(0, 99)))
    order = data.draw(st.permutations(list(TITLES)))
    titled = {name: data.draw(st.sampled_from(TITLES[name])) for name in order}
    marks = [(",", "."), (";", ","), (";", "."), ("\t", ",")]
    delimiter, decimal = data.draw(st.sampled_from(marks))
    above = data.draw(st.sampled_from([(), ("Bench 3; Tuesday, 10.5 degrees",)]))
    columns = [signals[name] * titled[name][1] for name in order]
    write(
        folder / "log.csv", columns, [titled[name][0] for name in order], delimiter, decimal, above
    )
    write_draft(folder)
    table = tomllib.loads((folder / "rig.toml").read_text())["table"]
    for channel, name in (("joint", "position"), ("torque", "torque")):
        found = table["channels"][channel]
        assert found["column"] == titled[name][0]
        known = next((unit for word, unit in UNITS.items() if word in found["column"]), None)
        assert known in (None, found["unit"])
    assert table["time"]["column"] == titled["time"][0]
    # In SI the records are the joint, whatever the file has.
    for record in read_rig(folder).records:
        measured = np.interp(record.time, signals["time"], signals["position"])
        assert record.channels["joint"] == pytest.approx(measured, abs=1e-6)


@settings(max_examples=10)
@given(st.permutations(["time", "position", "speed", "acceleration", "torque"]), st.integers(0, 99))
def test_derivatives_tell_columns_that_have_no_titles(order, seed):
    signals = joint(seed)
    found = _roles([signals[name] for name in order])
    assert order[found.time.column] == "time"
    assert order[found.coordinates[0].column] == "position"
    assert order[found.forces[0].column] == "torque"


def _roles(columns, path=None):
    from pymoo_hdte._io.unstated import UnstatedTable

    named = dict(enumerate(columns))
    return find_roles(Log([UnstatedTable(path, "plain", named, dict.fromkeys(named, ""), {})]))


def test_the_balance_has_the_mass_damping_and_friction_of_the_joint():
    signals = joint()
    balance = _roles(list(signals.values())).balance
    assert balance.share > 0.98
    assert balance.inertia == pytest.approx(MASS, rel=0.1)
    assert balance.damping == pytest.approx(DAMPING, rel=0.3)
    assert balance.dry == pytest.approx(DRY, rel=0.2)


def test_a_speed_tells_the_rate_of_a_log_without_times():
    signals = joint()
    found = _roles([signals["torque"], signals["speed"], signals["position"]])
    assert found.coordinates[0].column == 2
    assert found.sample_rate == pytest.approx(RATE, rel=0.01)


def test_physics_is_stronger_than_titles_and_the_draft_says_so(tmp_path):
    signals = joint()
    # The titles of position and speed are exchanged.
    titles = ["time_s", "speed", "position", "torque_Nm"]
    write(
        tmp_path / "log.csv",
        [signals[one] for one in ("time", "position", "speed", "torque")],
        titles,
    )
    draft = draft_of(tmp_path)
    assert draft.roles.coordinates[0].column == "speed"
    assert any("although its title" in one for one in draft.roles.remarks)


@pytest.mark.parametrize("ratio", [101.0, -50.0])
def test_two_encoders_of_a_drive_show_its_ratio(tmp_path, ratio):
    signals = joint()
    twist = signals["torque"] / 2e4
    motor = ratio * (signals["position"] + twist)
    columns = [signals["time"], motor, signals["position"], signals["torque"]]
    write(tmp_path / "log.csv", columns, ["t", "motor_pos", "load_pos", "torque"])
    found = draft_of(tmp_path).roles
    assert [one.column for one in found.coordinates] == ["motor_pos", "load_pos"]
    assert found.coordinates[0].options["divided_by"] == ratio
    write_draft(tmp_path)
    assert read_rig(tmp_path).mechanism.coordinates == ("motor", "load")


def test_counts_of_an_encoder_are_told_by_an_angle_beside_it(tmp_path):
    signals = joint()
    counts = np.round(signals["position"] * 65536 / (2.0 * np.pi))
    columns = [signals["time"], counts, signals["position"] + 1e-3, signals["torque"]]
    write(tmp_path / "log.csv", columns, ["t", "encoder_inc", "angle_rad", "torque"])
    log = read_log_folder(tmp_path).log
    from pymoo_hdte.discrepancy._records.drafts.column_roles import _Finder

    unit, sure, options, _ = _Finder(log)._counts("encoder_inc", None)
    assert (unit, sure, options["counts_per_turn"]) == ("counts", True, 65536.0)


def test_an_angle_that_wraps_is_continued(tmp_path):
    signals = joint()
    turning = signals["position"] + 2.0 * signals["time"]
    wrapped = np.degrees(turning) % 360.0
    columns = [signals["time"], wrapped, signals["torque"]]
    write(tmp_path / "log.csv", columns, ["t", "angle", "torque"])
    write_draft(tmp_path)
    for record in read_rig(tmp_path).records:
        angle = np.interp(record.time, signals["time"], turning)
        assert np.ptp(record.channels["joint"]) == pytest.approx(np.ptp(angle), rel=1e-3)


def test_signals_in_files_of_their_own_are_one_record(tmp_path):
    signals = joint()
    for name in ("position", "torque"):
        write(tmp_path / f"{name}.csv", [signals[name]], ["Joint_4"])
    draft = write_draft(tmp_path)
    assert "sample_rate = 1000" in draft.text
    assert {one.name for one in read_rig(tmp_path).records} == {
        f"{tmp_path.name}_train",
        f"{tmp_path.name}_held_out",
    }


def test_several_files_are_shared_out_by_name_or_by_speed(tmp_path):
    signals = joint()
    columns = [signals[one] for one in ("time", "position", "torque")]
    titles = ["t", "q", "tau"]
    for name in ("a", "b", "c"):
        write(tmp_path / f"{name}.csv", columns, titles)
    roles = [one["role"] for one in tomllib.loads(draft_of(tmp_path).text)["records"]]
    assert sorted(roles) == ["held_out", "train", "train"]
    (tmp_path / "a.csv").rename(tmp_path / "validation.csv")
    records = tomllib.loads(draft_of(tmp_path).text)["records"]
    assert {one["file"] for one in records if one["role"] == "held_out"} == {"validation.csv"}


def test_a_file_of_other_columns_is_named_and_left_out(tmp_path):
    signals = joint()
    write(
        tmp_path / "log.csv",
        [signals[one] for one in ("time", "position", "torque")],
        ["t", "q", "tau"],
    )
    write(tmp_path / "other.csv", [signals["time"][:50]], ["load_kg"])
    text = draft_of(tmp_path).text
    assert "other.csv is not used" in text
    assert [one["file"] for one in tomllib.loads(text)["records"]] == ["log.csv"]


def test_a_file_in_which_the_joint_stands_still_is_left_out(tmp_path):
    signals = joint()
    columns = [signals[one] for one in ("time", "position", "torque")]
    write(tmp_path / "moves.csv", columns, ["t", "q", "tau"])
    columns[1] = 1e-3 * columns[1]
    write(tmp_path / "rests.csv", columns, ["t", "q", "tau"])
    text = write_draft(tmp_path).text
    assert [one["file"] for one in tomllib.loads(text)["records"]] == ["moves.csv"]
    assert "rests.csv is not used" in text


def test_a_file_that_a_rig_cannot_use_does_not_keep_the_others_from_a_verdict(tmp_path):
    signals = joint()
    columns = [signals[one] for one in ("time", "position", "torque")]
    write(tmp_path / "whole.csv", columns, ["t", "q", "tau"])
    columns[1] = columns[1].copy()
    columns[1][500:600] = np.nan
    write(tmp_path / "torn.csv", columns, ["t", "q", "tau"])
    text = write_draft(tmp_path).text
    assert [one["file"] for one in tomllib.loads(text)["records"]] == ["whole.csv"]
    assert "torn.csv is not used" in text
    assert len(read_rig(tmp_path).records) == 2


def test_a_single_file_that_a_rig_cannot_use_is_drafted_with_the_reason(tmp_path):
    signals = joint()
    columns = [signals[one] for one in ("time", "position", "torque")]
    columns[1] = columns[1].copy()
    columns[1][500:600] = np.nan
    write(tmp_path / "torn.csv", columns, ["t", "q", "tau"])
    assert "it is refused" in write_draft(tmp_path).text


def test_records_of_a_bench_become_a_campaign(tmp_path):
    folder = tmp_path / "bench"
    campaign = small_campaign()
    write_campaign(campaign, folder)
    (folder / "campaign.toml").unlink()
    draft = write_draft(folder)
    assert draft.file == "campaign.toml"
    found = read_campaign(folder)
    assert found.believed.ratio == campaign.believed.ratio
    speeds = {one.name: one.input_speed for one in campaign.running}
    assert {one.name: one.input_speed for one in found.running} == pytest.approx(speeds, rel=0.02)
    assert {one.name for one in found.torsion} == {one.name for one in campaign.torsion}


def a_log(folder):
    folder.mkdir(exist_ok=True)
    signals = joint()
    columns = [signals[one] for one in ("time", "position", "torque")]
    write(folder / "log.csv", columns, ["t", "q", "tau_Nm"])
    return folder


@pytest.mark.parametrize("name", ["rig.toml", "campaign.toml"])
@pytest.mark.parametrize("content", ["", "mine"])
def test_no_file_is_ever_replaced(tmp_path, name, content):
    folder = a_log(tmp_path / "log")
    (folder / name).write_text(content)
    with pytest.raises(InvalidInput, match="none that is there"):
        write_draft(folder)
    assert (folder / name).read_text() == content
    assert {one.name for one in folder.iterdir()} == {"log.csv", name}


def test_a_link_that_leads_nowhere_is_not_followed(tmp_path):
    folder = a_log(tmp_path / "log")
    (folder / "rig.toml").symlink_to(tmp_path / "elsewhere.toml")
    with pytest.raises(InvalidInput, match="none that is there"):
        write_draft(folder)
    assert not (tmp_path / "elsewhere.toml").exists()


def test_a_file_that_appears_meanwhile_is_not_replaced(tmp_path, monkeypatch):
    folder = a_log(tmp_path / "log")
    from pymoo_hdte.discrepancy._records.drafts import draft as module

    made = module.draft_of

    def slow(where):
        result = made(where)
        (folder / "rig.toml").write_text("mine")
        return result

    monkeypatch.setattr(module, "draft_of", slow)
    with pytest.raises(InvalidInput, match="none that is there"):
        write_draft(folder)
    assert (folder / "rig.toml").read_text() == "mine"
    assert {one.name for one in folder.iterdir()} == {"log.csv", "rig.toml"}


HOSTILE = {
    "empty": b"",
    "binary": bytes(range(256)) * 40,
    "words": b"one,two\nthree,four\n" * 30,
    "zeros": b"\0" * 5000,
    "ragged": b"t,q,u\n" + b"1,2,3\n" * 20 + b"1,2\n" * 20,
    "text below": b"t,q,u\n" + b"1,2,3\n" * 20 + b"1,x,3\n" * 20,
    "constant": b"t,q,u\n" + b"1,1,1\n" * 50,
    "few rows": b"t,q,u\n1,2,3\n2,3,4\n",
    "nothing but nan": b"t,q,u\n" + b"nan,nan,nan\n" * 50,
    "one long line": b"1," * 200_000,
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE)
@pytest.mark.parametrize("name", ["log.csv", "log.mat", "log.npz", "log.jsonl", "log.csv.gz"])
def test_a_hostile_file_is_refused_in_words_and_nothing_is_written(tmp_path, name, content, capsys):
    (tmp_path / name).write_bytes(content)
    assert cli.main(["init", str(tmp_path)]) == 2
    assert "pymoo-hdte: error:" in capsys.readouterr().err
    assert [one.name for one in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("folder", ["missing", "file.csv", "empty"])
def test_what_is_no_folder_of_logs_is_refused(tmp_path, folder):
    (tmp_path / "file.csv").write_text("t,q\n1,2\n")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidInput):
        write_draft(tmp_path / folder)


@settings(max_examples=25)
@given(titles=st.lists(st.text(max_size=12), min_size=3, max_size=3))
def test_titles_of_any_characters_cannot_leave_their_comments(titles, tmp_path_factory):
    folder = tmp_path_factory.mktemp("log")
    signals = joint()
    columns = {one: signals[name] for one, name in enumerate(("time", "position", "torque"))}
    np.savez(folder / "log.npz", **{f"c{one}": values for one, values in columns.items()})
    table = read_unstated(folder / "log.npz")
    from dataclasses import replace

    from pymoo_hdte.discrepancy._records.drafts.log_folder import LogFolder
    from pymoo_hdte.discrepancy._records.drafts.rig_draft import rig_text

    known = replace(table, titles=dict(zip(table.columns, titles, strict=True)))
    logs = LogFolder(folder, Log([known]), (known,), {}, (), tuple(titles))
    roles = find_roles(logs.log)
    if roles.coordinates:
        text = tomllib.loads(rig_text(logs, roles))
        assert set(text) <= {"title", "coordinates", "ports", "inputs", "table", "records"}


@pytest.mark.parametrize("form", ["csv.gz", "npz", "mat", "jsonl", "xlsx", "h5"])
def test_every_kind_of_file_gives_its_columns(tmp_path, form):
    signals = {name: joint()[name] for name in ("time", "position", "torque")}
    path = tmp_path / f"log.{form}"
    if form == "csv.gz":
        write(tmp_path / "log.csv", signals.values(), list(signals))
        path.write_bytes(gzip.compress((tmp_path / "log.csv").read_bytes()))
        (tmp_path / "log.csv").unlink()
    elif form == "npz":
        np.savez(path, **signals, matrix=np.eye(3))
    elif form == "mat":
        from scipy.io import savemat

        savemat(path, {**signals, "matrix": np.eye(3)})
    elif form == "jsonl":
        rows = zip(*(one.tolist() for one in signals.values()), strict=True)
        path.write_text("\n".join(json.dumps(dict(zip(signals, row, strict=True))) for row in rows))
    elif form == "xlsx":
        openpyxl = pytest.importorskip("openpyxl")
        book = openpyxl.Workbook()
        book.active.append(["Bench 3"])
        book.active.append(list(signals))
        for row in zip(*(one.tolist() for one in signals.values()), strict=True):
            book.active.append(row)
        book.save(path)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, one in signals.items():
                file[name] = one
    draft = write_draft(tmp_path)
    assert [one.column for one in (*draft.roles.coordinates, *draft.roles.forces)] == [
        "position",
        "torque",
    ]
    assert len(read_rig(tmp_path).records) == 2


@pytest.mark.parametrize(
    ("title", "quantity", "unit"),
    [
        ("pos [deg]", "position", "deg"),
        ("tau_Nm", "torque", "N.m"),
        ("Drehzahl (U/min)", "speed", "rpm"),
        ("F_N", "force", "N"),
        ("t", "time", ""),
        ("speed_rad_s", "speed", "rad/s"),
        ("", "", ""),
    ],
)
def test_titles_tell_quantity_and_unit(title, quantity, unit):
    assert (read_title(title).quantity, read_title(title).unit) == (quantity, unit)


def test_the_first_call_drafts_and_later_ones_propose(tmp_path, capsys):
    folder = a_log(tmp_path / "log")
    assert cli.main(["init", str(folder)]) == 0
    draft = (folder / "rig.toml").read_text()
    assert cli.main(["init", str(folder), "--json"]) == 0
    assert '"verdict": null' in capsys.readouterr().out
    assert cli.main(["discrepancy", str(folder), "--out", str(folder / "report"), "--quiet"]) == 0
    capsys.readouterr()
    assert cli.main(["init", str(folder), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["verdict"].endswith("verdict.json")
    assert any("revised_model.toml" in one for one in document["sentences"])
    assert (folder / "rig.toml").read_text() == draft
    verdict = json.loads((folder / "report" / "verdict.json").read_text())
    assert "coulomb_friction" in [one["name"] for one in verdict["effects"]]


@pytest.mark.parametrize("content", [b"", b"[]", b"{}", b'{"status": 3}', b"[" * 100_000, b"\xff"])
def test_a_verdict_of_something_else_is_refused(tmp_path, content, capsys):
    folder = a_log(tmp_path / "log")
    write_draft(folder)
    (folder / "report").mkdir()
    (folder / "report" / "verdict.json").write_bytes(content)
    assert cli.main(["init", str(folder)]) == 2
    assert "verdict" in capsys.readouterr().err


RIGS = {
    "UR10e, joint 4": (["measured/ur10e/joint_4.csv"], {"joint": 4, "drive": 16}),
    "Kinova Gen3, joint 4": (
        ["cases/real/vote_kills_gravity/joint_4.csv"],
        {"joint": "Position4", "current": "Cur4"},
    ),
    "KonradMnich, rack and pinion": (
        ["cases/real/one_way_push/push.csv"],
        {"position": "x_m", "force": "F_N"},
    ),
    "LARA8, joint 6": (
        ["cases/real/lara8_order_3131/jogging_linear_mass.csv"],
        {"motor": "encoder_motorinc_6", "load": "encoder_loadinc_6"},
    ),
}


@pytest.mark.parametrize("rig", RIGS)
def test_a_log_of_a_real_machine_becomes_a_rig_without_editing(rig, tmp_path):
    files, channels = RIGS[rig]
    for file in files:
        if not (SHARED / file).is_file():
            pytest.skip(f"{SHARED / file} is not there")
        shutil.copyfile(SHARED / file, tmp_path / (SHARED / file).name)
    write_draft(tmp_path)
    table = tomllib.loads((tmp_path / "rig.toml").read_text())["table"]["channels"]
    assert {name: table[name]["column"] for name in channels} == channels
    assert {record.role for record in read_rig(tmp_path).records} == {"train", "held_out"}


@pytest.mark.nightly
@pytest.mark.parametrize("rig", RIGS)
def test_the_draft_of_a_real_machine_leads_to_a_verdict(rig, tmp_path):
    test_a_log_of_a_real_machine_becomes_a_rig_without_editing(rig, tmp_path)
    assert cli.main(["discrepancy", str(tmp_path), "--out", str(tmp_path / "report")]) == 0
