"""The experiments themselves, small: numbers against other ways to get them, and same bytes."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from experiments.command_line import main
from experiments.paper.scatter import dte_samples, exact_moments
from experiments.published_values import TABLE_6, TABLE_9
from pymoo_hdte._comparing import paired
from pymoo_hdte._comparing.runs import ALGORITHMS, OptimisationRun, robust_problem
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte.decision import deviation_degree

SMALL = {"population": 20, "generations": 5, "final_size": 8}


SMALL_RUNS = f"""
import sys
from functools import partial
from experiments.command_line import main
from pymoo_hdte._comparing import paired
paired.OptimisationRun = partial(paired.OptimisationRun, **{SMALL})
sys.exit(main())
"""
"""``python -m experiments`` with optimisations of a hundredth of the evaluations."""
EXTENTS = [["-c", SMALL_RUNS], ["-m", "experiments"]]


def run_experiments(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def steady_files(out: Path) -> dict[str, bytes]:
    """Every file that must not depend on how long things took."""
    return {
        str(path.relative_to(out)): path.read_bytes()
        for path in out.rglob("*")
        if path.is_file() and "times" not in path.parts and path.suffix != ".html"
    }


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_a_run_gives_a_sorted_non_dominated_set_of_at_most_the_final_size(algorithm):
    run = OptimisationRun("calibrated", algorithm, seed=3, **SMALL).execute()
    mean, std = run.values[:, -2:].T
    assert 1 <= len(run.values) <= SMALL["final_size"]
    assert np.all(np.diff(mean) > 0)
    assert np.all(np.diff(std) < 0)
    assert run.columns == ("K", "J_in", "B_in", "B_fc", "mean_dte_arcsec", "std_dte_arcsec")


def test_objectives_of_a_run_are_those_of_its_designs(tmp_path):
    jobs = [OptimisationRun("resonant", "AMP-MOPSO", seed, **SMALL) for seed in (1, 2, 3)]
    for run in Campaign(tmp_path).run(jobs, "small"):
        F = robust_problem("resonant").evaluate(run.values[:, :4])
        np.testing.assert_allclose(F, run.values[:, 4:], rtol=1e-13)


def test_quadrature_moments_are_the_problem_s_exact_moments():
    problem = robust_problem("calibrated")
    expected = problem.moments(problem.nominal[None])
    np.testing.assert_allclose(
        exact_moments(problem, problem.nominal, 0.05), np.ravel(expected), rtol=1e-10
    )


@pytest.mark.parametrize("tolerance", [0.05, 0.35])
def test_samples_agree_with_quadrature_within_four_standard_errors(tolerance):
    problem = robust_problem("calibrated")
    exact = exact_moments(problem, problem.nominal, tolerance)
    values = dte_samples(problem, problem.nominal, tolerance, 40_000, seed=11)
    error = exact.std_arcsec / np.sqrt(len(values))
    assert abs(values.mean() - exact.mean_arcsec) < 4 * error
    assert abs(values.std() - exact.std_arcsec) < 4 * error


def test_deviation_degrees_of_the_prototypes_come_out_to_the_printed_digit():
    measured = [prototype.design for prototype in TABLE_6.values()]
    degrees = deviation_degree(measured, TABLE_9["accuracy_first"])
    assert np.round(degrees, 3).tolist() == [p.deviation_degree for p in TABLE_6.values()]


def test_a_run_of_the_same_seed_gives_the_same_bytes():
    one, two = (OptimisationRun("calibrated", "AMP-MOPSO", 5, **SMALL).execute() for _ in "ab")
    assert one.values.tobytes() == two.values.tobytes()


@pytest.mark.nightly
def test_repetition_does_not_change_a_byte(tmp_path, monkeypatch):
    monkeypatch.setattr(paired, "OptimisationRun", partial(OptimisationRun, **SMALL))
    for out in ("one", "two"):
        arguments = ("table7", "--seeds", "1", "--workers", "1", "--out", str(tmp_path / out))
        assert main(arguments) == 0
    one, two = (steady_files(tmp_path / out) for out in ("one", "two"))
    assert one == two
    assert {"table7/quality.csv", "table7/fronts_calibrated.png", "table7/result.json"} <= set(one)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("extent", "seeds"), [(["-c", SMALL_RUNS], "1"), (["-m", "experiments"], "2")]
)
def test_workers_and_repetition_do_not_change_a_byte(extent, seeds, tmp_path):
    for out, workers in (("one", "1"), ("two", "2")):
        arguments = ("table7", "--seeds", seeds, "--workers", workers, "--out", str(tmp_path / out))
        assert run_experiments(*extent, *arguments).returncode == 0
    one, two = (steady_files(tmp_path / out) for out in ("one", "two"))
    assert one == two
    assert {"table7/quality.csv", "table7/fronts_calibrated.png", "table7/result.json"} <= set(one)


@pytest.mark.nightly
@pytest.mark.parametrize("extent", EXTENTS)
def test_ctrl_c_leaves_a_readable_report_and_code_130(extent, tmp_path):
    arguments = ["table7", "--workers", "2", "--out", str(tmp_path)]
    command = [sys.executable, *extent, *arguments]
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A shell starts background jobs that ignore Ctrl-C, and the suite may be one.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    while not list(tmp_path.glob("runs/*/*.csv")) and process.poll() is None:
        time.sleep(0.05)
    # A terminal sends Ctrl-C to the workers as well.
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert "Interrupted during table7" in errors
    assert "Traceback" not in errors
    assert "Interrupted during table7" in (tmp_path / "index.html").read_text()
