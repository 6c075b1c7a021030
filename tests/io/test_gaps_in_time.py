"""A gap in the time of a log divides it; what is between gaps is what was measured there."""

import numpy as np
import pytest
import tomli_w

from pymoo_hdte._io.layout import Channel, TableLayout
from pymoo_hdte._io.tables import read_table, read_unbroken_tables
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import read_rig

LAYOUT = TableLayout("csv", {"q": Channel("q", "m")}, Channel("t", "s"), None, 0)


def log(path, gaps, rows=2700, further=()):
    """Write a log of 1 kHz that stands still for some seconds before some rows."""
    steps = np.full(rows, 1e-3)
    for row, seconds in gaps:
        steps[row] += seconds
    time = np.cumsum(steps)
    columns = [time, np.sin(9.0 * time), *(np.cos(9.0 * time) for _ in further)]
    lines = [",".join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    path.write_text("\n".join([",".join(["t", "q", *further]), *lines]) + "\n")
    return time


@pytest.mark.parametrize(
    ("gaps", "lengths"),
    [([(1300, 7e-3)], [1300, 1400]), ([(500, 2.0), (510, 7e-3), (2000, 30.0)], [500, 1490, 700])],
)
def test_rows_between_gaps_stay_as_they_are(gaps, lengths, tmp_path):
    path = tmp_path / "a.csv"
    time = log(path, gaps)
    with pytest.raises(InvalidInput, match="line"):
        read_table(path, LAYOUT)
    tables = read_unbroken_tables(path, LAYOUT)
    assert [len(table.time) for table in tables] == lengths
    for table in tables:
        first = int(np.argmin(np.abs(time - table.time[0])))
        rows = slice(first, first + len(table.time))
        np.testing.assert_allclose(table.time, time[rows], rtol=1e-12)
        np.testing.assert_allclose(table.channels["q"], np.sin(9.0 * time[rows]), atol=1e-12)
        assert f"line {gaps[0][0] + 1}" in table.remark
        assert not table.interpolated


def test_without_a_gap_one_table_is_as_ever(tmp_path):
    path = tmp_path / "a.csv"
    log(path, [])
    (table,), whole = read_unbroken_tables(path, LAYOUT), read_table(path, LAYOUT)
    np.testing.assert_array_equal(table.time, whole.time)
    assert table.remark == whole.remark == ""


@pytest.mark.parametrize("gaps", [[(row, 9e-3) for row in range(50, 2700, 90)], [(9, -5e-3)]])
def test_many_gaps_or_a_time_that_falls_are_refused(gaps, tmp_path):
    path = tmp_path / "a.csv"
    log(path, gaps)
    with pytest.raises(InvalidInput, match="rising by the median step"):
        read_unbroken_tables(path, LAYOUT)


def rig_with(*records):
    return {
        "title": "a mass",
        "coordinates": {"q": {"inertia": {"value": 1.0}}},
        "ports": {"slide": {"motion": {"q": 1.0}, "damping": {"value": 1.0, "tolerance": 1.0}}},
        "inputs": {"u": {"acts": {"q": 1.0}, "gain": {"value": 1.0}}},
        "table": {
            "time": {"column": "t", "unit": "s"},
            "channels": {"q": {"column": "q", "unit": "m"}, "u": {"column": "u", "unit": "N"}},
        },
        "records": [*records],
    }


def test_a_name_that_a_part_has_is_refused(tmp_path):
    log(tmp_path / "a.csv", [(900, 7e-3)], further=["u"])
    log(tmp_path / "b.csv", [], further=["u"])
    rig = rig_with(
        {"file": "a.csv", "name": "a", "role": "train"},
        {"file": "b.csv", "name": "a_1", "role": "held_out"},
    )
    (tmp_path / "rig.toml").write_text(tomli_w.dumps(rig))
    with pytest.raises(InvalidInput, match="a_1"):
        read_rig(tmp_path)


def test_a_rig_has_a_record_for_each_part(tmp_path):
    log(tmp_path / "a.csv", [(900, 7e-3)], further=["u"])
    (tmp_path / "rig.toml").write_text(tomli_w.dumps(rig_with({"file": "a.csv"})))
    records = read_rig(tmp_path).records
    names = ["a_train_1", "a_train_2", "a_held_out"]
    assert [(one.name, one.role) for one in records] == [
        (name, name[2:].rstrip("_12")) for name in names
    ]
    assert all(records[at].remarks for at in (0, 1))
    assert not records[2].remarks


def test_a_log_of_angles_that_wrap_is_not_divided(tmp_path):
    """Nobody knows how many turns an angle made while nothing was recorded."""
    path = tmp_path / "a.csv"
    log(path, [(1300, 0.8)])
    wrapping = TableLayout(
        "csv", {"q": Channel("q", "rad", unwrap=True)}, Channel("t", "s"), None, 0
    )
    with pytest.raises(InvalidInput, match="rising by the median step"):
        read_unbroken_tables(path, wrapping)
