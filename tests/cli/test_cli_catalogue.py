"""From a catalogue page to a decision: commands, and what they write against known truths."""

import csv
import json
import re
import shlex
import shutil
from dataclasses import replace

import pytest
from places import DOCS

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.cli import decision, decision_report
from pymoo_hdte.cli.drive_arguments import exceeded, near_resonances, read_drive
from pymoo_hdte.cli.example_records import TOLERANCES, TRUTH, VARIATION, true_drive
from pymoo_hdte.discrepancy import read_drive_model
from pymoo_hdte.discrepancy._records.known_values import known_values
from pymoo_hdte.drive import (
    ESTIMATES,
    built_in_page,
    complete,
    drive_of,
    load_drive,
    load_page,
    preset,
    starting_torque,
)
from pymoo_hdte.drive.catalogue import accuracy_of_parts
from pymoo_hdte.drive.levers import GRADE, LEVERS, SHARES, Lever, changed_drive
from pymoo_hdte.units import REVOLUTION_PER_MINUTE

PAGE = load_page(built_in_page(20))
FIGURES = complete(PAGE, {**ESTIMATES, **SHARES})


@pytest.fixture(scope="module")
def gear(tmp_path_factory):
    folder = tmp_path_factory.mktemp("work") / "my_gear"
    assert cli.main(["example", str(folder), "--quiet"]) == 0
    return folder


def test_records_give_the_figures_of_the_drive_that_was_measured(gear, tmp_path):
    out = tmp_path / "identified"
    files = (str(gear / "bench"), "--datasheet", str(gear / "gear.toml"))
    assert cli.main(["identify", *files, "--out", str(out), "--quiet"]) == 0
    before, after = (
        complete(load_page(gear / "gear.toml")),
        load_page(out / "identified_drive.toml"),
    )
    measured = complete(after)
    for name, factor in TRUTH.items():
        assert measured[name].value == pytest.approx(factor * before[name].value, rel=0.05)
        assert not measured[name].estimated
    assert measured["load_inertia"] == before["load_inertia"]
    assert after.printed == load_page(gear / "gear.toml").printed
    assert load_drive(out / "identified_drive.toml").sheet.ratio == 100.0


@pytest.mark.parametrize("size", [14, 20, 25])
def test_the_drive_of_the_records_is_within_what_their_campaign_states(size):
    """A limit that was taken for a value was found to be out of its tolerance."""
    page = load_page(built_in_page(size))
    believed, true = (known_values(drive.effects) for drive in (drive_of(page), true_drive(page)))
    for name, value in believed.items():
        tolerance = TOLERANCES.get(name.rpartition(".")[2], 0.0)
        assert true[name] == pytest.approx(value, rel=max(0.95 * tolerance, 1e-9)), name


def test_an_example_is_not_written_over_anything(gear, capsys):
    assert cli.main(["example", str(gear)]) == cli.MISTAKE
    assert "new or empty" in capsys.readouterr().err


@pytest.mark.slow
def test_the_map_is_the_model_over_speed_load_and_direction(tmp_path):
    out = tmp_path / "map"
    load = ("--load", "-20", "--speed", "1500")
    assert cli.main(["simulate", "hs_20_100", *load, "--map", "--out", str(out), "--quiet"]) == 0
    with (out / "map.csv").open() as file:
        rows = list(csv.DictReader(file))
    model = preset("calibrated")
    for row in rows[:: len(rows) // 7]:
        if row["direction"] == "reverse" or float(row["load_Nm"]) == 0.0:
            continue
        there = model.at(
            float(row["input_speed_r_min"]) * REVOLUTION_PER_MINUTE, float(row["load_Nm"])
        )
        (dte,) = there.dte_arcsec(model.nominal[None])
        # The map lets the input angle fluctuate, Hill's method does not.
        assert float(row["dte_arcsec"]) == pytest.approx(dte, rel=0.03)
        assert 0.0 <= float(row["efficiency"]) < 1.0
    assert {row["direction"] for row in rows} == {"forward", "reverse"}
    assert (out / "map.svg").read_text().startswith("<?xml")
    document = json.loads((out / "simulation.json").read_text())
    assert document["load_torque_Nm"] == -20.0
    assert 0.0 < document["efficiency"] < 1.0


def test_a_thicker_wall_is_half_of_the_compliance_and_half_of_the_torque():
    thick = changed_drive(PAGE, FIGURES, {"wall_thickness": 1.1})
    plain = changed_drive(PAGE, FIGURES, {})
    share = plain.sheet.nominal.stiffness / thick.sheet.nominal.stiffness
    assert share == pytest.approx(0.5 / 1.1 + 0.5)
    expected = starting_torque(plain) * (0.5 + 0.5 * 1.1**3)
    assert starting_torque(thick) == pytest.approx(expected, rel=1e-3)
    assert thick.sheet.nominal.input_damping == pytest.approx(plain.sheet.nominal.input_damping)


def test_classes_of_cam_and_teeth_change_their_own_errors_only():
    plain = changed_drive(PAGE, FIGURES, {}).sheet
    for name, classes in (("cam_class", {"e_w"}), ("tooth_class", {"e_p", "e_h"})):
        finer = changed_drive(PAGE, FIGURES, {name: -1.0}).sheet
        for old, new in zip(plain.error_sources, finer.error_sources, strict=True):
            factor = 1.0 / GRADE if old.error_class in classes else 1.0
            assert (new.mean, new.std) == pytest.approx((factor * old.mean, factor * old.std))
        assert finer.nominal.static_error == accuracy_of_parts(finer)[0]
        assert finer.nominal.static_error < plain.nominal.static_error


def test_a_printed_accuracy_changes_as_that_of_the_parts():
    accuracy = replace(FIGURES["K3"], value=2e-4)
    figures = FIGURES | {"transmission_accuracy": accuracy}
    both = [changed_drive(PAGE, figures, s).sheet for s in ({}, {"cam_class": -1.0})]
    assert both[0].nominal.static_error == 2e-4
    parts = [accuracy_of_parts(sheet)[0] for sheet in both]
    expected = 2e-4 * parts[1] / parts[0]
    assert both[1].nominal.static_error == pytest.approx(expected)


@pytest.mark.slow
def test_what_has_no_influence_is_said_and_not_chosen(monkeypatch):
    """A lever that does nothing is idle; of the other, the best setting within the limits."""
    nothing = Lever("nothing", 1.0, (0.5, 1.0, 2.0), lambda figures, parts, s: (figures, parts), "")
    levers = (nothing, next(lever for lever in LEVERS if lever.name == "preload"))
    monkeypatch.setattr(decision, "LEVERS", levers)
    monkeypatch.setattr(decision, "DRIVES", 8)
    monkeypatch.setattr(decision, "DRAWS", 3)

    def changed(page, figures, settings):
        return changed_drive(page, figures, settings, levers)

    monkeypatch.setattr(decision, "changed_drive", changed)
    made = decision.decide(PAGE)
    assert made.idle == ("nothing",)
    assert made.settings == {"preload": 1.25}
    assert made.after.goal < made.before.goal
    assert made.after.starting == pytest.approx(1.125 * made.before.starting, rel=1e-3)
    tight = decision.Limits(starting_torque=1.1)
    assert decision.decide(PAGE, limits=tight).settings == {}


def test_a_change_that_brings_nothing_is_not_recommended(monkeypatch):
    """A lever that matters, but whose better setting is all but the unchanged one."""
    (preload,) = (lever for lever in LEVERS if lever.name == "preload")
    levers = (replace(preload, settings=(0.75, 1.0, 1.001)),)
    monkeypatch.setattr(decision, "LEVERS", levers)
    monkeypatch.setattr(decision, "DRIVES", 8)
    monkeypatch.setattr(decision, "DRAWS", 3)
    made = decision.decide(PAGE)
    assert made.effects["preload"][1.001].goal < made.before.goal
    assert made.idle == ()
    assert (made.settings, made.after) == ({}, made.before)
    assert len(decision_report.sentences(made)) == 1


def test_a_decision_near_a_resonance_says_so_and_tells_the_dte_from_that_of_the_page(monkeypatch):
    """The gear of size 20 runs at 2000 r/min, and order 2 meets its torsion at 2218 r/min."""
    monkeypatch.setattr(decision, "LEVERS", ())
    monkeypatch.setattr(decision, "DRIVES", 8)
    monkeypatch.setattr(decision, "DRAWS", 1)
    made = decision.decide(PAGE, (VARIATION,))
    (remark,) = near_resonances(drive_of(PAGE))
    remarks = decision_report.limits(made, ())
    assert remark in remarks
    plain, found = (decision.nominal_dte(drive) for drive in (drive_of(PAGE), made.drives[0]))
    assert found > 1.5 * plain
    assert f"{plain:.1f} arcsec" in remarks[0]
    assert f"{found:.1f}" in remarks[0]


OF_DRIVES = ("example", "identify", "simulate", "discrepancy", "decide", "optimise", "plan")


def commands_of_the_page():
    """Return every command on drives of the page on the command line."""
    text = (DOCS / "command_line.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", text, re.S)
    lines = [line for block in blocks for line in block.splitlines() if line]
    return [line for line in lines if line.split()[1] in OF_DRIVES]


def test_the_commands_of_the_page_name_files_that_an_earlier_one_writes():
    known = {"hs_20_100", "eyring_drag.py"}
    for line in commands_of_the_page():
        _, *words = shlex.split(line)
        options = cli._parser().parse_args(words)
        for word in words:
            if "/" in word or word.endswith((".toml", ".py")):
                made = {word, word.split("/")[0], "/".join(word.split("/")[:2])} & known
                assert made or word == str(getattr(options, "out", None)), line
        known.add(str(getattr(options, "out", None) or options.folder))


@pytest.mark.nightly
def test_the_commands_of_the_page_run_as_printed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(DOCS / "examples" / "eyring_drag.py", tmp_path)
    for line in commands_of_the_page():
        program, *words = shlex.split(line)
        assert program == "pymoo-hdte"
        assert cli.main([*words, "--quiet"]) == 0, line
    # The records hold a variation of the stiffness and nothing else that the page lacks.
    verdict = json.loads((tmp_path / "my_gear" / "verdict" / "verdict.json").read_text())
    (effect,) = verdict["effects"]
    assert (verdict["status"], effect["name"]) == ("named", "mesh_stiffness_variation")
    low, high = effect["parameters"]["depth"]["interval95"]
    assert low < VARIATION.depth < high
    found = json.loads((tmp_path / "my_gear" / "decision" / "decision.json").read_text())["found"]
    assert {lever["name"] for lever in found} == {"mesh_stiffness_variation"}


def test_every_command_reads_the_same_drive_from_the_page(gear):
    expected = load_drive(gear / "gear.toml")
    assert read_drive_model(gear / "gear.toml") == expected
    options = cli._parser().parse_args(["optimise", str(gear / "gear.toml"), "--out", "x"])
    model, _, remarks = read_drive(options)
    assert model == expected
    estimated = [name for name, entry in complete(PAGE).items() if entry.estimated]
    assert all(name in remarks[0] for name in estimated)
    with pytest.raises(InvalidInput, match="has its own model"):
        read_drive(cli._parser().parse_args(["optimise", str(gear / "gear.toml"), "--out", "x",
                                             "--model", "resonant"]))  # fmt: skip


@pytest.mark.parametrize(("load", "words"), [(60.0, 0), (-70.0, 1), (150.0, 2), (200.0, 3)])
def test_a_load_above_printed_torques_is_said(load, words):
    said = exceeded(PAGE, 200.0, load)
    assert " ".join(said).count("N.m") == words
