"""Other people's measurements: the verdicts that the literature lets one expect, and the twins."""

import pytest

from experiments import emps, kinova
from experiments.campaign import Campaign
from experiments.measured_rigs import MEASURED
from experiments.registry import Context


def result_of(experiment, folder, out):
    if not (MEASURED / folder).is_dir():
        pytest.skip(f"the measurements are not at {MEASURED / folder}")
    return experiment.run(Context(1, out, Campaign(out)))


@pytest.mark.parametrize(
    ("experiment", "folder"), [(emps, "emps"), (kinova, "kinova_gen3_j7")], ids=["emps", "kinova"]
)
def test_every_demand_on_a_real_rig_holds(experiment, folder, tmp_path):
    result = result_of(experiment, folder, tmp_path)
    findings = [finding for table in result.tables for finding in table.findings]
    assert len(findings) >= 4
    assert [finding.sentence for finding in findings if not finding.agrees] == []


@pytest.mark.parametrize("experiment", [emps, kinova], ids=["emps", "kinova"])
def test_without_the_measurements_the_report_says_so(experiment, tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.measured_rigs.MEASURED", tmp_path / "nowhere")
    result = experiment.run(Context(1, tmp_path, Campaign(tmp_path)))
    assert "Skipped" in result.paragraphs[0]
    assert str(tmp_path / "nowhere") in result.paragraphs[0]
