"""Other people's measurements: the verdicts that the literature lets one expect, and the twins."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from experiments.runner.campaign import Campaign
from experiments.runner.registry import Context
from experiments.runner.result import Finding
from experiments.studies.measured import emps, kinova
from experiments.studies.measured import rigs as measured_rigs
from experiments.studies.measured.rigs import MEASURED
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism


def result_of(experiment, folder, out):
    if not (MEASURED / folder).is_dir():
        pytest.skip(f"the measurements are not at {MEASURED / folder}")
    return experiment.run(Context(1, out, Campaign(out)))


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("experiment", "folder"), [(emps, "emps"), (kinova, "kinova_gen3_j7")], ids=["emps", "kinova"]
)
def test_every_demand_on_a_real_rig_holds(experiment, folder, tmp_path):
    result = result_of(experiment, folder, tmp_path)
    findings = [finding for table in result.tables for finding in table.findings]
    assert len(findings) >= 4
    assert [finding.sentence for finding in findings if not finding.agrees] == []


def names_in(rig, records):
    finding = examine_mechanism(rig.mechanism, records, rig.cutoff, rig.effects)
    return {candidate.name for candidate in finding.accepted.candidates}


def test_a_quarter_of_a_record_shows_the_friction_of_a_real_rig():
    if not (MEASURED / "emps").is_dir():
        pytest.skip(f"the measurements are not at {MEASURED}")
    rig = read_rig(measured_rigs.RIGS / "emps.toml", MEASURED / "emps")
    whole = next(record for record in rig.records if record.role == "train")
    n = len(whole.time) // 4
    channels = {name: channel[:n] for name, channel in whole.channels.items()}
    found = names_in(rig, [replace(whole, time=whole.time[:n], channels=channels)])
    assert found == {"coulomb_friction", "direction_dependent_friction"}


RAW_LOGS = {
    "ur10e_joint_1": "ur10e",
    "ur10e_joint_4": "ur10e",
    "ur10e_joint_6": "ur10e",
    "tx40_joint_4": "tx40_j4",
    "silverbox": "silverbox",
    "bouc_wen": "bouc_wen",
    "lara8_joint_3": "lara8_j3",
}


@pytest.mark.parametrize(("name", "folder"), RAW_LOGS.items())
def test_a_raw_log_needs_25_lines_and_no_script(name, folder):
    path = measured_rigs.RIGS / f"{name}.toml"
    assert len(path.read_text().splitlines()) <= 25
    if not (MEASURED / folder).is_dir():
        pytest.skip(f"the measurements are not at {MEASURED}")
    rig = read_rig(path, MEASURED / folder)
    assert {record.role for record in rig.records} == {"train", "held_out"}
    needed = {*rig.mechanism.coordinates, *(one.name for one in rig.mechanism.inputs)}
    assert all(set(record.channels) == needed for record in rig.records)
    uneven = folder in ("ur10e", "lara8_j3")
    assert all(bool(record.remarks) == uneven for record in rig.records)


@pytest.mark.parametrize("experiment", [emps, kinova], ids=["emps", "kinova"])
def test_without_the_measurements_the_report_says_so(experiment, tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.studies.measured.rigs.MEASURED", tmp_path / "nowhere")
    result = experiment.run(Context(1, tmp_path, Campaign(tmp_path)))
    assert "Skipped" in result.answer
    assert str(tmp_path / "nowhere") in result.paragraphs[0]


@pytest.fixture
def judge_kinova(monkeypatch):
    """Judge a study without effects, whose limits and next test are given."""

    def judge(*, said=True, rate=-1.0):
        limits = ("The records cannot separate Coulomb friction from an offset.",) * said
        line = {"value": 0.03, "interval95": (0.02, 0.035)}
        fitted = {"kinematic error: order 200 amplitude": line, "another": line}
        monkeypatch.setattr(measured_rigs, "fitted_values", lambda one: fitted)
        monkeypatch.setattr(kinova, "limits", lambda finding: limits)
        monkeypatch.setattr(kinova, "next_test", lambda finding: SimpleNamespace(rate=rate))
        monkeypatch.setattr(kinova, "twins_finding", lambda found: Finding(True, "", check=True))
        study = SimpleNamespace(
            names=(), finding=SimpleNamespace(accepted=SimpleNamespace(effects=()))
        )
        return kinova._judged(study, ())

    return judge


@pytest.mark.parametrize(
    ("said", "rate", "words"),
    [
        (True, -1.0, ": said, and the reverse run is proposed."),
        (True, 1.0, ": said, and the reverse run is not proposed."),
        (False, -1.0, ": not said, and the reverse run is proposed."),
        (False, 1.0, ": not said, and the reverse run is not proposed."),
    ],
)
def test_what_is_said_of_one_direction_is_what_happened(judge_kinova, said, rate, words):
    *_, finding, _ = judge_kinova(said=said, rate=rate).findings
    assert finding.sentence.endswith(words)
    assert finding.agrees == (said and rate < 0.0)


def test_our_own_fits_are_not_called_literature(judge_kinova):
    table = judge_kinova()
    names = [column.name for column in table.columns]
    assert "literature" not in names
    assert table.note.startswith("Our fits record by record: ")
    line, other = table.rows
    values = dict(zip(names, line, strict=True))
    assert values["our fits record by record"] == 0.040
    assert values["difference"] == pytest.approx(-25.0)
    assert values["interval covers"] == "no"
    assert other[4:] == (None, None, "")
