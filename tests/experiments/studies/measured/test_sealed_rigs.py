"""The committed verdicts on sealed rigs are those of today's workflow."""

import pytest

from experiments.runner.committed import committed_file, read_rows
from experiments.runner.registry import Context
from experiments.studies.measured.sealed_rigs import COLUMNS, NAME, RIGS, SECONDS, run, verdict_row
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte.discrepancy import analyse, read_campaign


@pytest.fixture(scope="module")
def committed():
    rows = [list(row.values()) for row in read_rows(committed_file(f"{NAME}.csv", NAME))]
    return {row[0]: row for row in rows}


def test_every_rig_is_shown_with_its_seconds(committed, tmp_path):
    verdicts, seconds = run(Context(1, tmp_path, Campaign(tmp_path))).tables
    rigs = [f"rig-{number:02}" for number in range(1, 15)]
    assert list(committed) == [row[0] for row in verdicts.rows] == rigs
    assert [row[0] for row in seconds.rows] == rigs
    assert all(len(row) == len(COLUMNS) for row in verdicts.rows)
    # Labels of code are for files.
    assert not [cell for row in verdicts.rows for cell in row if {"_", "@", ":"} & set(str(cell))]
    assert all(isinstance(cell, float) for row in seconds.rows for cell in row[1 : len(SECONDS)])


@pytest.mark.parametrize(
    "name",
    [f"rig-{n:02}" for n in (3, 7, 8, 12, 14)],
)
@pytest.mark.nightly
def test_the_stored_verdict_is_what_comes_out(name, committed):
    if not (RIGS / name).is_dir():
        pytest.skip(f"needs {RIGS / name}, which is no part of the project")
    row, stored = verdict_row(name, analyse(read_campaign(RIGS / name))), committed[name]
    words = [column.name for column in COLUMNS].index("before")
    assert row[:words] == stored[:words]
    # Other processors round otherwise, and a fit ends where a step brings less than it counts.
    for now, before in zip(row[words:], stored[words:], strict=True):
        assert float(now) == pytest.approx(float(before), rel=2e-3)
