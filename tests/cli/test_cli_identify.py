"""``pymoo-hdte identify``: the truth of a virtual bench comes back from its CSV files."""

import json
import re
import shutil

import numpy as np
import pytest
from bench_records import BENCH, TRUTH, write_runs, write_series
from scipy.stats import linregress
from scipy.stats import t as student

from experiments.paper.bench.rigs import INPUT_BEARING
from pymoo_hdte.cli import command_line as cli
from pymoo_hdte.drive import hs_20_100, load_datasheet
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE


def identify(*arguments):
    return cli.main(["identify", *map(str, arguments)])


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """The files of the bench."""
    folder = tmp_path_factory.mktemp("bench") / "series-1"
    write_series(folder)
    return folder


@pytest.fixture
def copied(records, tmp_path):
    return shutil.copytree(records, tmp_path / "series-1")


@pytest.fixture(scope="module")
def written(records, tmp_path_factory):
    out = tmp_path_factory.mktemp("identify") / "report"
    assert identify(records, "--datasheet", "hs_20_100", "--out", out, "--quiet") == 0
    return out


@pytest.fixture(scope="module")
def document(written):
    return json.loads((written / "parameters.json").read_text())


def test_the_truth_lies_within_twice_the_interval(document):
    truth = TRUTH | {"K": BENCH.loading_stiffness(TRUTH["K"])}
    for name, true in truth.items():
        found = document["parameters"][name]
        low, high = found["interval95"]
        half = (high - low) / 2.0
        assert abs(found["value"] - true) < 2.0 * half
        assert half < 0.1 * true
        assert (found["prototypes"], found["runs"]) == (6, 6 if name == "K" else 18)


def test_the_sheet_has_the_identified_values_and_keeps_the_rest(written, document):
    sheet, before = load_datasheet(written / "identified_sheet.toml"), hs_20_100()
    values = {name: one["value"] for name, one in document["parameters"].items()}
    nominal = sheet.nominal
    assert nominal.stiffness == values["K"]
    assert nominal.input_damping == values["B_in"]
    assert nominal.mesh_damping == values["B_fc"]
    assert nominal.output_damping == values["B_out"]
    assert nominal.input_inertia == before.nominal.input_inertia
    errors = {source.symbol: source for source in sheet.error_sources}
    assert errors["dFp1"].mean == pytest.approx(1e-6 * document["errors_um"]["dFp1"]["mean"])
    assert errors["e13"] == next(one for one in before.error_sources if one.symbol == "e13")


def test_what_the_data_sheet_does_not_know_is_said(document):
    assert any("no error source called 'mine'" in one for one in document["limits"])


def keep(folder, *names):
    """Delete all files but these."""
    for path in folder.iterdir():
        if path.name not in names:
            path.unlink()


def test_any_of_the_files_is_enough(copied, tmp_path, capsys):
    keep(copied, "torsion_loops.csv")
    assert identify(copied, "--out", tmp_path / "out") == 0
    assert capsys.readouterr().out.startswith("K 2")
    assert not (tmp_path / "out" / "identified_sheet.toml").exists()


def test_one_prototype_says_nothing_of_the_scatter(copied, tmp_path, capsys):
    keep(copied, "no_load_output.csv")
    path = copied / "no_load_output.csv"
    header, *rows = path.read_text().splitlines()
    first = [row for row in rows if row.startswith("1,1,")]
    path.write_text("\n".join([header, *first]) + "\n")
    assert identify(copied, "--out", tmp_path / "out", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["parameters"]["B_out"]["std_between_prototypes"] is None
    assert "says nothing of the scatter of B_out" in found["limits"][0]


def test_intervals_by_hand(copied, tmp_path, capsys):
    """The line of a run, the repeats of a prototype, the prototypes of a series."""
    keep(copied, "no_load_output.csv")
    path = copied / "no_load_output.csv"
    header, *rows = path.read_text().splitlines()
    for keys in (["1,1,"], ["1,1,", "1,2,", "1,3,"], [f"{p},1," for p in range(1, 7)]):
        kept = [row for row in rows if row.startswith(tuple(keys))]
        path.write_text("\n".join([header, *kept]) + "\n")
        assert identify(copied, "--out", tmp_path / "out", "--json") == 0
        found = json.loads(capsys.readouterr().out)["parameters"]["B_out"]
        numbers = np.array([row.split(",")[2:] for row in kept], dtype=float)
        x, y = numbers.reshape(len(keys), -1, 2).transpose(2, 0, 1)
        fits = [
            linregress(speed * REVOLUTION_PER_MINUTE, torque)
            for speed, torque in zip(x, y, strict=True)
        ]
        slopes = np.array([fit.slope for fit in fits])
        error, freedom = fits[0].stderr, x.shape[1] - 2
        if len(keys) > 1:
            error, freedom = slopes.std(ddof=1) / len(keys) ** 0.5, len(keys) - 1
        half = student.ppf(0.975, freedom) * error
        expected = [slopes.mean() - half, slopes.mean() + half]
        assert found["interval95"] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("torque", "torsion", "told"),
    [
        (1e-4, 1.0, r"^torsion_loops\.csv: stiffness is 2\..*at least 400 N\.m/rad.*another unit"),
        (-1.0, 1.0, "torsion_loops.csv, lines .*opposite senses"),
        (1.0, -1.0, "torsion_loops.csv, lines .*opposite senses"),
    ],
)
def test_a_wrong_unit_or_sign_in_a_loop_is_told(copied, tmp_path, capsys, torque, torsion, told):
    keep(copied, "torsion_loops.csv")
    path = copied / "torsion_loops.csv"
    header, *rows = path.read_text().splitlines()
    numbers = [[float(one) for one in row.split(",")[2:]] for row in rows]
    keys = [row.rsplit(",", 2)[0] for row in rows]
    changed = [
        f"{key},{t * torque!r},{a * torsion!r}" for key, (t, a) in zip(keys, numbers, strict=True)
    ]
    path.write_text("\n".join([header, *changed]) + "\n")
    assert identify(copied, "--datasheet", "hs_20_100", "--out", tmp_path / "out") == cli.MISTAKE
    assert re.search(told, capsys.readouterr().err.removeprefix("pymoo-hdte: error: "))
    assert not (tmp_path / "out").exists()


def test_hysteresis_of_a_loop_by_hand(copied, tmp_path, capsys):
    keep(copied)
    branches = (np.linspace(0, 40, 41), np.linspace(40, -40, 81)[1:], np.linspace(-40, 0, 41)[1:])
    shifts = (0.0, 5.0, -5.0)
    torque = np.concatenate(branches)
    torsion = np.concatenate([10.0 * b + s for b, s in zip(branches, shifts, strict=True)])
    rows = [f"1,1,{t!r},{a!r}" for t, a in zip(torque.tolist(), torsion.tolist(), strict=True)]
    header = "prototype,repeat,torque_Nm,torsion_arcsec"
    (copied / "torsion_loops.csv").write_text("\n".join([header, *rows]) + "\n")
    assert identify(copied, "--out", tmp_path / "out", "--json") == 0
    (loop,) = json.loads(capsys.readouterr().out)["torsion_loops"]
    assert loop["hysteresis_width_arcsec"] == pytest.approx(10.0, rel=1e-6)
    area = np.trapezoid(torque, torsion * ARCSEC)
    assert loop["lost_energy_J"] == pytest.approx(area, rel=1e-12)
    assert area > 0.0


def test_copies_of_one_prototype_are_suspected(copied, tmp_path, capsys):
    keep(copied, "no_load_output.csv")
    path = copied / "no_load_output.csv"
    header, *rows = path.read_text().splitlines()
    first = [row for row in rows if row.startswith("1,1,")]
    path.write_text("\n".join([header, *first, *(f"2{row[1:]}" for row in first)]) + "\n")
    assert identify(copied, "--out", tmp_path / "out") == 0
    assert "copies of one another" in capsys.readouterr().out


def test_negative_damping_is_said_and_left_out_of_the_sheet(copied, tmp_path, capsys):
    keep(copied, "no_load_output.csv")
    path = copied / "no_load_output.csv"
    header, *rows = path.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    path.write_text("\n".join([header, *(f"{p},{r},{s},{-float(t)}" for p, r, s, t in cells)]))
    arguments = ("--datasheet", "hs_20_100", "--out", tmp_path / "out")
    assert identify(copied, *arguments) == 0
    assert "keeps its value" in capsys.readouterr().out
    sheet = load_datasheet(tmp_path / "out" / "identified_sheet.toml")
    assert sheet.nominal == hs_20_100().nominal


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (keep, "a folder with one of"),
        (lambda folder: (folder / "no_load_bearing.csv").unlink(), "also no_load_bearing.csv"),
        (lambda folder: shutil.rmtree(folder), "series-1"),
        (
            lambda folder: (folder / "torsion_loops.csv").write_text("prototype,repeat\n1,1\n"),
            "torsion_loops.csv, line 1",
        ),
        (
            lambda folder: write_runs(folder / "no_load_complete.csv", {(9, 1): INPUT_RUN}),
            "only runs that stand in",
        ),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(spoil, words, copied, tmp_path, capsys):
    spoil(copied)
    assert identify(copied, "--out", tmp_path / "out", "--quiet") == cli.MISTAKE
    printed = capsys.readouterr().err
    assert words in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()


INPUT_RUN = INPUT_BEARING.record(1.7e-4, np.random.default_rng(1))
