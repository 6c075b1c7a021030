"""Other people's measurements are read from their raw logs, and short ones suffice."""

from dataclasses import replace

import pytest

from experiments.studies.measured import rigs as measured_rigs
from experiments.studies.measured.rigs import MEASURED
from pymoo_hdte.discrepancy._records.rig_files import read_rig
from pymoo_hdte.discrepancy._verdicts.mechanism import examine_mechanism


def names_in(rig, records):
    finding = examine_mechanism(rig.mechanism, records, rig.cutoff, rig.effects)
    return {candidate.name for candidate in finding.accepted.candidates}


@pytest.mark.slow
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
