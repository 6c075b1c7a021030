"""The page on files of campaigns: its example is read, and it has every key that is read."""

import gzip
import json
import re
import shutil
import tomllib

import numpy as np
import pytest
import scipy.io
import tomli_w
from places import DOCS
from small_campaigns import small_campaign

from pymoo_hdte._io.array_files import READERS
from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.layout import COUNTS
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import read_campaign, write_campaign
from pymoo_hdte.discrepancy._records.believed import SENSOR_PLACES
from pymoo_hdte.discrepancy._records.campaign_keys import COLUMNS, LAYOUT
from pymoo_hdte.units import DEGREE, UNITS

PAGE = (DOCS / "campaign_format.md").read_text(encoding="utf-8")
EXAMPLE, ROWS = (re.search(rf"```{kind}\n(.*?)```", PAGE, re.S)[1] for kind in ("toml", "text"))
TABLES = {
    "Top of campaign.toml": "",
    "[believed]": "believed",
    "[tolerance]": "tolerance",
    "[rig]": "rig",
    "[[record]]": "record",
    "[table] and [record.table]": "table",
    "Columns of time and channels": "column",
}
"""For each section with keys the table that has them."""


def keys_of_page():
    sections = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", PAGE, re.M | re.S))
    found = {}
    for title, name in TABLES.items():
        cells = re.findall(r"^\|([^|]*)\|", sections[title], re.M)
        found[name] = {key for cell in cells for key in re.findall("`(.*?)`", cell)}
    return found


def table_of(path):
    """Return which of `TABLES` a table of a campaign's file is, None if its keys are free."""
    inner = re.sub(r"\[\d+]", "", path).removeprefix("campaign.toml").lstrip(".")
    inner = inner.removeprefix("record.") if inner.startswith("record.table") else inner
    if re.fullmatch(r"table\.(time|channels\.\w+)", inner):
        return "column"
    return inner if inner in TABLES.values() else None


@pytest.fixture
def asked(monkeypatch):
    """The keys that are asked for while files are read, by table."""
    keys = {}

    def note(fields, key):
        if (table := table_of(fields._path)) is not None:
            keys.setdefault(table, set()).add(key)

    for name in ("take", "has"):
        method = getattr(Fields, name)

        def noted(self, key, *rest, method=method):
            note(self, key)
            return method(self, key, *rest)

        monkeypatch.setattr(Fields, name, noted)
    return keys


def write_example(folder):
    """Write the campaign of the page, its rows those of a record that fits it."""
    folder.mkdir()
    (folder / "campaign.toml").write_text(EXAMPLE, encoding="utf-8")
    slow = small_campaign().running[0]
    columns = [
        slow.time * 1e3,
        (slow.input_angle * 8192 / (2.0 * np.pi)) % 8192,
        41.5 - slow.output_angle / DEGREE,
        slow.input_torque * 1e3,
        -slow.output_torque,
    ]
    head = ROWS.splitlines()[:3]
    rows = [";".join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    text = "\n".join([*head, *(row.replace(".", ",") for row in rows)])
    (folder / "slow.csv").write_text(text, encoding="utf-8")
    return slow


def test_the_example_is_read_with_its_units_signs_and_zeros(tmp_path):
    slow = write_example(tmp_path / "rig")
    (read,) = read_campaign(tmp_path / "rig").running
    for name in COLUMNS:
        expected = getattr(slow, name)
        size = np.abs(expected).max()
        np.testing.assert_allclose(getattr(read, name), expected, rtol=0, atol=1e-12 * size)
    assert read.speed_range == pytest.approx((495 * np.pi / 30, 505 * np.pi / 30))
    shown = ROWS.splitlines()[3].replace(",", ".").split(";")
    first = (tmp_path / "rig" / "slow.csv").read_text().splitlines()[3].replace(",", ".").split(";")
    np.testing.assert_allclose(np.array(first, float), np.array(shown, float), rtol=1e-4)


def test_the_page_has_every_key_that_is_read_and_no_other(tmp_path, asked):
    write_example(tmp_path / "first")
    read_campaign(tmp_path / "first")
    campaign = small_campaign()
    write_campaign(campaign, tmp_path / "second")
    # The other way to say what is believed, by a model file.
    toml = tmp_path / "second" / "campaign.toml"
    whole = tomllib.loads(toml.read_text())
    for file in ("my_drive.toml", "my_drive_model.toml"):
        shutil.copy(DOCS / "examples" / file, tmp_path / "second")
    del whole["believed"]
    named = {"model": "my_drive_model.toml", "sheet": "my_drive.toml", "tolerance": {}}
    toml.write_text(tomli_w.dumps(named | whole))
    with pytest.raises(InvalidInput, match="one output turn"):
        read_campaign(tmp_path / "second")
    assert asked == keys_of_page()


def test_the_page_has_every_unit_channel_and_title():
    columns = PAGE.split("## Columns of time and channels")[1]
    (cell,) = re.findall(r"^\| `unit` \|(.*)\|$", columns, re.M)
    units = [UNITS["time"], [*UNITS["angle"], COUNTS], UNITS["torque"], ["C", "K"]]
    assert [re.findall("`(.*?)`", part) for part in cell.split(";")] == [list(one) for one in units]
    assert all(f"`{name}`" in PAGE for name in LAYOUT.channels)
    assert all(f"`{title}`" in PAGE for title, _ in COLUMNS.values())


def copied_without_files(tmp_path):
    """Return a folder of a campaign with its table as a dict, and the columns of its records."""
    campaign = small_campaign()
    write_campaign(campaign, tmp_path / "rig")
    whole = tomllib.loads((tmp_path / "rig" / "campaign.toml").read_text())
    for entry in whole["record"]:
        (tmp_path / "rig" / entry["file"]).unlink()
    records = (*campaign.running, *campaign.torsion)
    columns = [
        {title: getattr(one, name) for name, (title, _) in COLUMNS.items() if hasattr(one, name)}
        for one in records
    ]
    return tmp_path / "rig", whole, columns


def written(path, columns):
    """Write columns to a file in the format of its ending."""
    if path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".mat":
        scipy.io.savemat(path, columns)
    elif path.suffix in (".h5", ".hdf5"):
        with pytest.importorskip("h5py").File(path, "w") as file:
            file.update(columns)
    elif path.suffix == ".xlsx":
        book = pytest.importorskip("openpyxl").Workbook()
        for row in (tuple(columns), *zip(*(one.tolist() for one in columns.values()), strict=True)):
            book.active.append(row)
        book.save(path)
    else:
        rows = zip(*(one.tolist() for one in columns.values()), strict=True)
        if "json" in path.name:
            lines = [json.dumps(dict(zip(columns, row, strict=True))) for row in rows]
        else:
            lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
        text = "\n".join(lines).encode()
        path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)


(FILES,) = re.findall(r"^\| `file` \|.*It ends in (.*) \|$", PAGE, re.M)
ENDINGS = [
    *re.findall("`(.*?)`", FILES.replace(", these also with `.gz`", "")),
    *(f"{one}.gz" for one in (".jsonl", ".ndjson")),
]


def test_the_page_has_every_ending():
    endings = {one for endings, _ in READERS.values() for one in endings}
    assert {*ENDINGS} == endings | {".csv", ".csv.gz", ".txt", ".txt.gz"}


# Logs of ROS have columns of their own: test_ros_logs.
@pytest.mark.parametrize("ending", [one for one in ENDINGS if one not in (".db3", ".mcap")])
def test_a_campaign_of_files_with_any_ending_is_read(tmp_path, ending):
    folder, whole, columns = copied_without_files(tmp_path)
    for entry, rows in zip(whole["record"], columns, strict=True):
        entry["file"] = entry["file"].replace(".csv.gz", ending)
        written(folder / entry["file"], rows)
    (folder / "campaign.toml").write_text(tomli_w.dumps(whole))
    read = read_campaign(folder)
    for ours, theirs in zip((*read.running, *read.torsion), columns, strict=True):
        for name, (title, _) in COLUMNS.items():
            if title in theirs:
                np.testing.assert_allclose(getattr(ours, name), theirs[title], rtol=1e-12)


NUMBERED = """
[table]
format = "csv"
encoding = "cp1252"
time = { column = 0, unit = "s" }
[table.channels]
input_angle = { column = 1, unit = "deg" }
output_angle = { column = 2, unit = "deg" }
input_torque = { column = 3, unit = "N.m" }
output_torque = { column = 4, unit = "N.m" }
"""
"""Columns of a log without useful titles."""


def test_numbered_columns_in_another_encoding_are_read(tmp_path):
    folder, whole, columns = copied_without_files(tmp_path)
    whole["record"] = [one for one in whole["record"] if one["test"] == "running"]
    for head in ("Prüfstand 3\nZeit;Winkel [°];Winkel [°];Moment;Moment\n", ""):
        for entry, rows in zip(whole["record"], columns, strict=False):
            entry["file"] = entry["file"].removesuffix(".gz")
            scales = (1.0, 1.0 / DEGREE, 1.0 / DEGREE, 1.0, 1.0)
            scaled = np.column_stack([*rows.values()]) * scales
            text = head + "\n".join(";".join(map(repr, row)) for row in scaled.tolist())
            (folder / entry["file"]).write_text(text, encoding="cp1252")
        (folder / "campaign.toml").write_text(tomli_w.dumps(whole) + NUMBERED)
        for ours, theirs in zip(read_campaign(folder).running, columns, strict=False):
            for name, (title, _) in COLUMNS.items():
                np.testing.assert_allclose(getattr(ours, name), theirs[title], rtol=1e-12)


def test_each_place_of_the_torque_sensor_on_the_page_is_read(tmp_path):
    places = re.findall(r'^output_torque_at = "(\w+)"', PAGE, re.M)
    folder, whole, columns = copied_without_files(tmp_path)
    for entry, rows in zip(whole["record"], columns, strict=True):
        entry["file"] = entry["file"].removesuffix(".gz")
        written(folder / entry["file"], rows)
    for place in places:
        whole["rig"]["output_torque_at"] = place
        (folder / "campaign.toml").write_text(tomli_w.dumps(whole))
        assert read_campaign(folder).rig.output_torque_at == place
    assert tuple(places) == SENSOR_PLACES
