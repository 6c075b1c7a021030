"""Campaigns as people have them: names of files, paths, columns, and where a sensor sits."""

import tomllib

import numpy as np
import pytest
import tomli_w
from small_campaigns import small_campaign

from pymoo_hdte.checks import InvalidInput, SeveralComplaints
from pymoo_hdte.discrepancy import read_campaign, write_campaign


@pytest.fixture
def folder(tmp_path):
    write_campaign(small_campaign(), tmp_path / "Prüfstand 3")
    return tmp_path / "Prüfstand 3"


def changed(folder, change):
    toml = folder / "campaign.toml"
    whole = tomllib.loads(toml.read_text(encoding="utf-8"))
    change(whole)
    toml.write_text(tomli_w.dumps(whole), encoding="utf-8")


def renamed(folder, name):
    def change(whole):
        (folder / whole["record"][0]["file"]).rename(folder / name)
        whole["record"][0]["file"] = name

    changed(folder, change)


@pytest.mark.parametrize(
    "name",
    [
        "Öl kalt, 20 Nm",
        "größe 1",
        "a (2)",
        "slow.2-b",
        "ταχύς",
        "慢速",
        "медленно, 5 °C",
        "धीमा",
        "_1",
    ],
)
def test_a_record_is_called_as_its_file_in_any_script(folder, name):
    renamed(folder, f"{name}.csv.gz")
    read = read_campaign(folder)
    assert read.running[0].name == name
    write_campaign(read, folder.parent / "again")
    assert (folder.parent / "again" / f"{name}.csv.gz").is_file()
    assert read_campaign(folder.parent / "again").running[0].name == name


def test_names_that_differ_in_any_character_are_two(folder):
    names = [f"{name}.csv.gz" for name in ("慢 1", "快 1", "慢_1")]
    old = [record.name for record in read_campaign(folder).running]

    def change(whole):
        for entry in whole["record"]:
            stem = entry["file"].removesuffix(".csv.gz")
            if stem in old:
                (folder / entry["file"]).rename(folder / names[old.index(stem)])
                entry["file"] = names[old.index(stem)]

    changed(folder, change)
    assert [f"{one.name}.csv.gz" for one in read_campaign(folder).running] == names


@pytest.mark.parametrize(
    "file", ["../slow.csv", "a/b.csv", "a\\b.csv", ".csv", " .csv", ".a.csv", "a.exe"]
)
def test_a_file_of_another_folder_is_refused(folder, file):
    changed(folder, lambda whole: whole["record"][0].update(file=file))
    with pytest.raises(InvalidInput, match="without folders"):
        read_campaign(folder)


def test_the_path_of_campaign_toml_is_that_of_its_folder(folder):
    assert read_campaign(folder / "campaign.toml").title == read_campaign(folder).title


@pytest.mark.parametrize("missing", ["input_angle", "output_angle"])
@pytest.mark.parametrize("usual", [False, True], ids=["own column", "usual column"])
def test_a_transmission_error_stands_for_one_of_the_angles(folder, missing, usual):
    campaign = small_campaign()
    stated = {"input_angle": "output_angle", "output_angle": "input_angle"}[missing]
    rows = {"transmission_error": {"column": "TE", "unit": "arcsec"}}
    title, unit = (f"{stated}_rad", "rad") if usual else ("angle", "deg")
    rows[stated] = {"column": title, "unit": unit}
    for record in campaign.running:
        error = np.degrees(record.transmission_error(50.0)) * 3600.0
        angle = getattr(record, stated)
        columns = [record.time, angle if usual else np.degrees(angle), error]
        columns += [record.input_torque, record.output_torque]
        text = f"time_s,{title},TE,input_torque_Nm,output_torque_Nm\n" + "\n".join(
            ",".join(map(repr, row)) for row in np.column_stack(columns).tolist()
        )
        (folder / f"{record.name}.csv").write_text(text)

    def change(whole):
        for entry in whole["record"]:
            if entry["test"] == "running":
                entry["file"] = entry["file"].removesuffix(".gz")
                entry["table"] = {"channels": rows}

    changed(folder, change)
    for ours, theirs in zip(read_campaign(folder).running, campaign.running, strict=True):
        found, expected = getattr(ours, missing), getattr(theirs, missing)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max())

    other = {missing: {"column": f"{missing}_rad" if usual else "angle", "unit": unit}}
    changed(folder, lambda whole: whole["record"][0]["table"]["channels"].update(other))
    with pytest.raises(InvalidInput, match="absent beside both"):
        read_campaign(folder)


def test_an_angle_that_is_computed_has_no_zero(folder):
    def change(whole):
        error = {"transmission_error": {"column": "TE", "unit": "arcsec"}}
        whole["record"][0] |= {"table": {"channels": error}, "zero": {"output_angle": 1.0}}

    changed(folder, change)
    with pytest.raises(InvalidInput, match=r"zero.*'output_angle'.*one of"):
        read_campaign(folder)


def test_all_that_is_wrong_in_a_table_is_told_at_once(folder):
    def change(whole):
        whole["believed"] |= {"stiffness_Nm_per_rad": "soft", "colour": 3, "weight": 4}
        del whole["believed"]["ratio"]

    changed(folder, change)
    with pytest.raises(SeveralComplaints) as caught:
        read_campaign(folder)
    for word in ("stiffness_Nm_per_rad", "colour", "weight", "ratio"):
        assert sum(word in one.field for one in caught.value.complaints) == 1
    assert all("line" in one.field for one in caught.value.complaints)
