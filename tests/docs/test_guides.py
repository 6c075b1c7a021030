"""Every guide of the documentation runs as a user would run it, and prints what it claims."""

import os
import re
import subprocess
import sys

import pytest
from drawn_pictures import drawn_and_stored
from kept_results import kept
from places import DOCS, ROOT

from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.drive import hs_20_100
from pymoo_hdte.surrogate import TruncatedNormal

GUIDES = {path.stem: path for path in (DOCS / "guides").glob("*.py")}
NOISE = TruncatedNormal(0.0, 1.0)
NUMBER = r"(-?\d+(?:\.\d+)?(?:e[-+]?\d+)?)"


@kept
def output_of(guide):
    """Return what a guide prints in a process of its own, in which a warning is an error.

    At night: the gate runs every guide once, when it builds the documentation.
    """
    done = subprocess.run(
        [
            sys.executable, "-W", "error",
            # pymoo 0.6.2 imports scipy.spatial.ckdtree, a private path of SciPy.
            "-W", "ignore:Please import `cKDTree`:DeprecationWarning",
            GUIDES[guide],
        ],
        env=os.environ | {"MPLBACKEND": "Agg"}, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def numbers_of(guide, pattern):
    """Return the numbers in the place of each # of a line, a list for each such line."""
    # Columns are as wide as their widest number.
    expression = re.escape(pattern).replace(r"\#", NUMBER).replace(r"\ ", " +")
    found = re.findall(expression, output_of(guide))
    assert found, f"{guide} prints no line like {pattern!r}"
    return [[float(one) for one in ([line] if isinstance(line, str) else line)] for line in found]


def texts_of(guide):
    """Return the text of a guide in one line."""
    return " ".join(re.sub(r"^# ?", "", GUIDES[guide].read_text(), flags=re.M).split())


@pytest.mark.nightly
@pytest.mark.parametrize("guide", sorted(GUIDES))
def test_guide_runs_and_its_checks_hold(guide):
    lines = output_of(guide).splitlines()
    assert lines
    assert not [line for line in lines if line.endswith("False")]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("guide", "pattern", "tolerance"),
    [
        ("exact_moments", "closed form #, Gauss-Legendre #", 1e-11),
        ("exact_moments", "recurrence #, rule #", 1e-9),
        ("exact_moments", "exact #, quadrature #", 2e-9),
        ("exact_moments", "mean # and #", 1e-11),
        ("exact_moments", "std  # and #", 1e-11),
        ("steady_state", "by hand  # arcsec\npackage  # arcsec", 1e-3),
        ("steady_state", "harmonic balance      # arcsec\nintegrated from rest  # arcsec", 5e-3),
        ("extend", "difference # N.m, in closed form # N.m", 1e-4),
        ("extend", "steady state #, integrated # arcsec", 5e-3),
        ("extend", "expected # Hz, # Hz counted", 1.0),
        ("robust_study", "smallest mean    # arcsec\nend of the front # arcsec", 1e-4),
        ("drive_data_sheet", "model #, surrogate # arcsec", 0.1),
        ("verdict_score", "score #, by brute force #", 0.6),
        ("verdict_rules", "standard deviation #, ordinary least squares #", 2e-4),
        ("verdict_rules", "evidence #, by integration #", 0.1),
    ],
)  # fmt: skip
def test_two_ways_to_one_number_agree(guide, pattern, tolerance):
    for first, second in numbers_of(guide, pattern):
        assert abs(first - second) <= tolerance


@pytest.mark.nightly
def test_algorithms_of_the_study_find_the_front():
    values = numbers_of("robust_study", "points  IGD #  HV #")
    (best,) = numbers_of("robust_study", "1001 points, hypervolume #")
    assert len(values) == 3
    for igd, hypervolume in values:
        assert igd < 0.02
        assert 0.95 * best[0] < hypervolume < best[0]


@pytest.mark.nightly
def test_members_of_the_family_are_as_the_study_says():
    printed = numbers_of("robust_study", "# variables, # objectives, # points")
    assert [row[:2] for row in printed] == [[4, 2]] * 3 + [[5, 3], [7, 2], [4, 2]]
    # "``pareto_front()`` and ``pareto_set()`` hold 1000 points or more"
    assert min(row[2] for row in printed[:4]) >= 1000


@pytest.mark.nightly
def test_the_invented_drive_does_what_its_guide_says():
    assert "ratio 80\n" in output_of("drive_data_sheet")
    assert "wrong.toml, line 18: nominal.stiffness is 11000.0, allowed: " in output_of(
        "drive_data_sheet"
    )
    (third,), (fifth,) = (
        numbers_of("drive_data_sheet", f"order {order}: RMSE # arcsec") for order in (3, 5)
    )
    assert fifth[0] < 0.5 * third[0]
    (((before, _),), ((after, _),)) = (
        numbers_of("drive_data_sheet", f"{name} mean #, std # arcsec")
        for name in ("nominal ", "balanced")
    )
    assert after < before


@pytest.mark.nightly
def test_own_problems_meet_their_closed_forms():
    ((n, length),) = numbers_of("own_problem", "# solutions, median length #")
    assert n == 100
    assert length == pytest.approx(1.0, abs=0.01)
    said = "TimeBasedTermination does not say how many generations a run has"
    assert said in output_of("own_problem")
    assert "stop by ('n_gen', n) or ('n_eval', n)" in output_of("own_problem")


@pytest.mark.nightly
def test_parts_of_the_swarm_differ_as_the_guide_says():
    line = r"(.+?) +median IGD of 11 seeds (.+), from (.+) to (.+)"
    printed = re.findall(line, output_of("extend"))
    found = {name: [float(value) for value in values] for name, *values in printed}
    assert len(found) == 5
    median, low, _ = found.pop("random truncation")
    medians, _, highest = zip(*found.values(), strict=True)
    assert low > 1.5 * max(highest)
    assert median > 3.0 * max(medians)


@pytest.mark.nightly
def test_tongue_of_instability_lies_where_mathieu_has_it():
    ((low, high),) = numbers_of("steady_state", "unstable from # to #,")
    assert low == pytest.approx(0.95, abs=0.005)
    assert high == pytest.approx(1.05, abs=0.005)


@pytest.mark.nightly
def test_verdicts_of_the_guide():
    text = output_of("verdict_rules")
    assert re.search(r"friction 0 N\.m: .* adequate\n", text)
    assert re.search(r"friction 0\.3 N\.m: .* named\n", text)
    assert re.search(r"^\* coulomb_friction:bearing ", text, flags=re.M)


@pytest.mark.parametrize(
    ("guide", "words", "value", "stated"),
    [
        ("verdict_rules", "four standard deviations", RULES.false_alarm_deviations, 4.0),
        ("verdict_rules", "a distance of 10", RULES.evidence_distance, 10.0),
        ("verdict_rules", "removes at least half of the power", RULES.main_share, 0.5),
        ("exact_moments", "128 nodes and more", len(NOISE.quadrature(0)[0]), 128),
        ("robust_study", "101 turns of a motor", hs_20_100().ratio, 101.0),
    ],
)  # fmt: skip
def test_text_states_what_the_code_has(guide, words, value, stated):
    assert words in texts_of(guide)
    assert value == stated


def test_site_shows_every_guide():
    front, order = (
        (DOCS / name).read_text(encoding="utf-8")
        for name in ("index.md", "_extensions/guide_order.py")
    )
    assert len(GUIDES) >= 7
    for name in GUIDES:
        assert f"(auto_guides/{name})" in front
        assert f'"{name}.py"' in order


def test_gate_builds_the_site_as_its_front_page_says():
    front, gate = (path.read_text() for path in (DOCS / "index.md", ROOT / ".ci" / "run"))
    for command in re.findall(r"^(?:pip|python) .*docs.*", front, flags=re.M):
        assert f".venv/bin/{command}\n" in gate


@pytest.mark.nightly
def test_picture_of_the_rooms_is_that_of_the_imports(tmp_path):
    """Every arrow of the picture on the architecture page is an import, and none is missing."""
    drawn, stored = drawn_and_stored(DOCS / "rooms_picture.py", tmp_path)
    assert drawn.text["Description"] == stored.text["Description"]
