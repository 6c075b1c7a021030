"""Blind campaigns: what a case hides and nothing else, scores of verdicts, exact intervals."""

import shutil
import sys
import tomllib
from dataclasses import replace
from functools import partial

import numpy as np
import places
import pytest
from planted_features import analysed, known_data, listed, measured
from virtual_rig_cases import BELIEVED as SHARED_DRIVE
from virtual_rig_cases import RIG as SHARED_RIG
from virtual_rig_cases import SHORT

from experiments.__main__ import FAILED, main
from experiments.blind import cases as blind_cases
from experiments.blind import experiment as blind
from experiments.blind import scoring as blind_scoring
from experiments.blind.cases import BELIEVED, OUT_OF_TOLERANCE, RIG, Case, all_cases
from experiments.blind.codes import NAMES, code_of_set, words_of_set
from experiments.blind.data import Outcome, format_outcomes, format_seconds, outcome, read_outcomes
from experiments.blind.limits import size_at
from experiments.blind.scoring import COLUMNS, BlindJob, bias_scores, truly_moved, verdict_scores
from experiments.blind.shortfalls import shortfalls_table
from experiments.blind.tables import _judged_table
from experiments.blind.targets import judge_median, judge_rate, median, rate
from experiments.runner import committed
from experiments.runner.campaign import Campaign, Run
from experiments.runner.committed import committed_file
from experiments.runner.registry import Context
from pymoo_hdte.discrepancy.drive.analysis import DriveFinding
from pymoo_hdte.discrepancy.drive.evidence import Data, start_parameters
from pymoo_hdte.discrepancy.drive.features import measure
from pymoo_hdte.discrepancy.engine.candidate import Layout
from pymoo_hdte.discrepancy.engine.fitting import fit
from pymoo_hdte.discrepancy.engine.hypothesis import Hypothesis
from pymoo_hdte.virtual.hidden_forms import LISTED_FORMS, UNLISTED_FORMS
from pymoo_hdte.virtual.rig import TrueRig

ROOT = 99
ECCENTRIC = Case("single", ("eccentricity",), 1.0, 0, ROOT)


@pytest.fixture
def short(monkeypatch):
    """Campaigns of two fast records."""
    quick = partial(blind_cases.run_campaign, conditions=SHORT)
    monkeypatch.setattr(blind_cases, "run_campaign", quick)


def output_angles(campaign):
    return [record.output_angle for record in campaign.running]


def channels(campaign):
    return [
        np.array([r.input_angle, r.output_angle, r.input_torque, r.output_torque])
        for r in campaign.running
    ]


def test_the_list_holds_what_the_issue_asks_for():
    listed_cases = all_cases()
    assert len({case.key for case in listed_cases}) == len(listed_cases)
    of = {kind: [c for c in listed_cases if c.kind == kind] for kind in
          ("none", "single", "unlisted", "pair", "detection")}  # fmt: skip
    assert len(of["none"]) >= 200
    for name in LISTED_FORMS:
        assert sum(case.names == (name,) for case in of["single"]) >= 20
    assert {case.truth for case in of["unlisted"]} == set(UNLISTED_FORMS)
    assert len(of["unlisted"]) >= 40
    assert listed_cases[-len(of["detection"]) :] == of["detection"]


def test_pairs_are_two_effects_that_one_rig_can_hold():
    for case in (case for case in all_cases(ROOT) if case.kind == "pair"):
        assert len(set(case.names)) == 2
        assert tuple(effect.name for effect in case.effects()) == case.names
        TrueRig(BELIEVED, (0.0, 0.0, 0.0), case.effects())


def test_the_rig_is_that_of_the_shared_campaigns():
    assert BELIEVED == SHARED_DRIVE
    assert RIG == SHARED_RIG


def test_a_case_gives_the_same_bytes_twice_and_another_root_others(short):
    first, second = (channels(ECCENTRIC.run(ECCENTRIC.effects())) for _ in range(2))
    other = replace(ECCENTRIC, root=ROOT + 1)
    third = channels(other.run(other.effects()))
    for one, two, three in zip(first, second, third, strict=True):
        assert one.tobytes() == two.tobytes()
        assert not np.array_equal(one, three)


def test_the_twin_differs_only_by_the_effect(short):
    hidden, twin = ECCENTRIC.run(ECCENTRIC.effects()), ECCENTRIC.run(())
    amplitude = ECCENTRIC.effects()[0].parameters["eccentricity"]
    for one, other in zip(channels(hidden), channels(twin), strict=True):
        # An encoder off centre changes what it shows, not how the drive moves.
        assert np.array_equal(one[[0, 2, 3]], other[[0, 2, 3]])
        swing = np.ptp(one[1] - other[1])
        assert swing == pytest.approx(
            2.0 * amplitude, abs=0.45 * amplitude + RIG.angle_quantisation
        )


def test_what_an_effect_moves_is_free_of_noise(short):
    hidden, twin = (ECCENTRIC.run(effects) for effects in (ECCENTRIC.effects(), ()))
    values = ECCENTRIC.effects()[0].parameters
    for one, other, angle in zip(
        channels(hidden), channels(twin), output_angles(twin), strict=True
    ):
        once = np.cos(angle + values["eccentricity_phase"])
        twice = np.cos(2.0 * angle + values["eccentricity_second"])
        moved = values["eccentricity"] * (once + 0.2 * twice)
        assert one[1] - other[1] == pytest.approx(moved, abs=1.001 * RIG.angle_quantisation)


@pytest.mark.parametrize("name", blind_cases.PARAMETERS)
def test_a_parameter_is_out_of_tolerance_and_the_others_are_not(monkeypatch, name):
    monkeypatch.setattr(blind_cases, "run_campaign", lambda true_rig, *rest, **more: true_rig)
    for number in range(5):
        case = Case("parameter", (name,), 1.0, number, ROOT)
        assert case.effects() == ()
        drive = case.run(()).drive
        off = {field: abs(getattr(drive, field) / getattr(BELIEVED, field) - 1.0)
               for field in ("stiffness", "damping", "input_inertia", "input_damping",
                             "output_damping", "load_inertia")}  # fmt: skip
        low, high = OUT_OF_TOLERANCE
        assert low <= off.pop(name) <= high
        assert max(off.values()) <= BELIEVED.tolerance


def analysis_of(case):
    campaign = case.run(case.effects())
    features = measure(campaign, campaign.train, [1.0 / 101.0, 1.0, 2.0, 2.02])
    data = Data(campaign, features, start_parameters(campaign, features))
    return DriveFinding(campaign, data, None, ())


def test_an_encoder_off_centre_moves_its_line_of_the_transmission_error_only(short):
    moved = truly_moved(analysis_of(ECCENTRIC), ECCENTRIC.run(()))
    assert moved[0, 0, 1]
    assert not moved[:, 1:3].any()
    assert not moved[:, 0, 2:].any()


def test_nothing_hidden_moves_nothing(short):
    clean = Case("none", (), 1.0, 0, ROOT)
    assert not truly_moved(analysis_of(clean), clean.run(())).any()


def test_bias_is_in_tolerances_over_mechanical_parameters_and_amplitudes():
    data, _ = measured(rng=np.random.default_rng(1))
    twin = fit(data)
    layout = Layout(twin.parameters)
    moved = twin.values.copy()
    for name, off in (("stiffness", 0.3), ("error_amplitude_1", -0.4), ("error_phase_0", 7.0)):
        moved[layout.index(name)] += off * layout.array("scale")[layout.index(name)]
    verdict = analysed(data, "adequate").verdict
    verdict = analysed(data, "adequate").verdict
    verdict = replace(verdict, base=replace(twin, values=moved))
    scores = bias_scores(verdict, twin)
    assert scores["bias_of_all_before"] == pytest.approx(0.5 / np.sqrt(6 + 3))
    assert scores["bias_of_all_after"] == scores["bias_of_all_before"]
    assert scores["bias_after"] == scores["bias_before"] >= scores["bias_of_all_before"]
    # What no record determines does not count, however far it goes.
    lost = moved.copy()
    lost[layout.index("output_damping")] = np.inf
    far = bias_scores(replace(verdict, base=replace(twin, values=lost)), twin)
    assert far["bias_before"] == scores["bias_before"]
    assert far["bias_of_all_before"] == np.inf
    assert 0.0 < scores["bias_error"] < blind_scoring.DETERMINED


def as_outcome(case, scores):
    row = [scores.get(column, np.nan) for column in COLUMNS]
    return outcome(case, Run(COLUMNS, np.array([row]), 1.0, (1.0,)))


def test_a_verdict_survives_the_way_through_numbers():
    data = known_data()
    line, friction = listed(data, "kinematic_error", [3.0]), listed(data, "coulomb_friction")
    base = fit(data)
    chosen = Hypothesis(replace(base, candidates=(line, friction)), 0.0, 1.0)
    alike = Hypothesis(
        replace(base, candidates=(friction, listed(data, "thermal_drift"))), 0.0, 1.0
    )
    verdict = replace(analysed(data).verdict, status="class", chosen=chosen, equivalent=(alike,))
    case = Case("pair", ("thermal_drift", "coulomb_friction"), 1.0, 0, ROOT)
    found = as_outcome(case, verdict_scores(case, verdict))
    assert found.status == "class"
    assert found.chosen == ("kinematic_error:mesh@3", "coulomb_friction:input")
    assert set(found.equivalents) == {"coulomb_friction", "thermal_drift"}
    assert found.both
    assert not as_outcome(case, verdict_scores(case, replace(verdict, equivalent=()))).both


def test_sets_of_names_survive_their_number():
    rng = np.random.default_rng(1)
    for _ in range(50):
        names = set(rng.choice(NAMES, rng.integers(0, len(NAMES)), replace=False).tolist())
        assert set(words_of_set(code_of_set(names))) == names


@pytest.mark.parametrize(
    ("kind", "truth", "status", "chosen", "in_class", "right", "confident", "answer"),
    [
        ("single", "backlash", "named", "backlash:mesh", False, True, False, "backlash"),
        ("single", "backlash", "named", "soft_windup:mesh", False, False, True, "soft_windup"),
        ("single", "backlash", "class", "soft_windup:mesh", True, True, False, "backlash"),
        ("single", "backlash", "class", "soft_windup:mesh", False, False, False, "soft_windup"),
        ("single", "backlash", "parameter", "parameter:base", False, False, True, "parameter"),
        ("single", "backlash", "unlisted", "backlash:mesh", False, False, False, "unlisted"),
        ("single", "backlash", "error", "", False, False, False, "error"),
        ("none", "none", "adequate", "", False, True, False, "adequate"),
        ("none", "none", "named", "backlash:mesh", False, False, True, "backlash"),
        ("unlisted", "load_ripple", "unlisted", "backlash:mesh", False, True, False, "unlisted"),
        ("unlisted", "load_ripple", "adequate", "", False, False, False, "adequate"),
        ("parameter", "stiffness", "parameter", "parameter:stiffness", False, True, False,
         "parameter"),
        ("parameter", "stiffness", "parameter", "parameter:input_damping", False, False, True,
         "parameter"),
        ("pair", "backlash+thermal_drift", "named", "backlash:mesh", False, False, False,
         "backlash"),
        ("pair", "backlash+thermal_drift", "named", "thermal_drift:sensor backlash:mesh", False,
         True, False, "thermal_drift"),
    ],
)  # fmt: skip
def test_verdicts_are_scored_as_the_issue_says(
    kind, truth, status, chosen, in_class, right, confident, answer
):
    names = () if truth == "none" else tuple(truth.split("+"))
    case = Case(kind, names, 1.0, 0, ROOT)
    found = Outcome(case, status, tuple(chosen.split()), truth_in_class=in_class)
    assert found.right_answer == right
    assert found.wrong_confident == confident
    assert found.answer == answer


def test_numbers_of_a_case_give_its_scores():
    numbers = {
        "cells_moved": 8.0, "cells_flagged": 12.0, "cells_both": 7.0, "bias_before": 0.5,
        "bias_after": 0.05, "leading_before": 5.0, "leading_after": 1.4, "leading_floor": 1.0,
    }  # fmt: skip
    found = Outcome(ECCENTRIC, "named", ("eccentricity:sensor",), numbers=numbers)
    assert found.f1 == pytest.approx(14.0 / 20.0)
    assert found.bias_ratio == pytest.approx(0.1)
    assert found.shrinkage("leading") == pytest.approx(0.9)
    assert found.closed("leading", 1.5)
    assert not found.closed("leading", 1.3)
    small = replace(found, numbers=numbers | {"bias_error": 0.6})
    assert small.bias_ratio is None
    failed = Outcome(ECCENTRIC, "error", ())
    assert (failed.f1, failed.bias_ratio, failed.shrinkage("leading")) == (0.0, 1.0, 0.0)
    assert not failed.closed("leading", 1.5)


@pytest.mark.parametrize("n", [5, 20, 200])
def test_intervals_of_a_rate_are_exact(n):
    none, every = rate([False] * n), rate([True] * n)
    assert none.high == pytest.approx(1.0 - 0.025 ** (1.0 / n))
    assert none.low == 0.0
    assert every.low == pytest.approx(0.025 ** (1.0 / n))


def test_the_interval_of_a_median_lies_between_order_statistics():
    # P(at most 2 of 12 below the median) = (1 + 12 + 66) / 2^12 = 1.9 %, at most 3: 7.3 %.
    found = median([*np.arange(12.0), None])
    assert (found.value, found.low, found.high, found.n) == (5.5, 2.0, 9.0, 12)
    few = median([1.0, 2.0, 3.0])
    assert (few.low, few.high) == (-np.inf, np.inf)


def test_a_demand_is_missed_only_where_an_exact_test_rejects_it():
    for hits, verdict in ((20, "met"), (19, "met"), (17, "within chance"), (15, "missed")):
        judged = judge_rate("", "", [True] * hits + [False] * (20 - hits), 0.95)
        assert judged.verdict == verdict
        # The tail of the binomial distribution, summed by hand.
        tail = sum(_binomial(20, k, 0.95) for k in range(hits + 1))
        assert judged.p_value == pytest.approx(tail)
        assert judged.met == (tail >= 0.01)
    above = judge_median("", "", [1.0] * 9 + [3.0], 2.0)
    assert above.p_value == pytest.approx(11.0 / 2.0**10)
    assert above.verdict == "within chance"
    assert judge_median("", "", [1.0] * 20, 2.0).verdict == "missed"
    assert judge_median("", "", [1.0] * 20, 2.0, at_least=False).verdict == "met"


def test_a_demand_within_chance_is_neither_said_to_hold_nor_to_fail():
    demands = [
        judge_rate("met", "", [True] * 20, 0.95),
        judge_rate("within", "", [True] * 18 + [False] * 2, 0.95),
        judge_rate("missed", "", [False] * 20, 0.95),
        judge_rate("not run", "", [], 0.95),
    ]
    table = _judged_table("must_reach", "Must reach", demands, "")
    assert [row[-1] for row in table.rows] == ["met", "within chance", "missed", "not run"]
    assert [finding.agrees for finding in table.findings] == [True, False]


def _binomial(n, k, p):
    ways = np.prod([(n - i) / (i + 1) for i in range(k)])
    return ways * p**k * (1.0 - p) ** (n - k)


def detection(size, hits, n):
    cases_of = [Case("detection", ("backlash",), size, number, ROOT) for number in range(n)]
    return [
        Outcome(case, "named" if k < hits else "adequate", ("backlash:mesh",) if k < hits else ())
        for k, case in enumerate(cases_of)
    ]


def test_a_detection_limit_lies_between_the_sizes_tried():
    outcomes = [*detection(0.1, 0, 6), *detection(0.4, 6, 6)]
    assert size_at(outcomes, "backlash", 0.5) == pytest.approx(0.2)
    assert size_at(outcomes, "backlash", 0.95) == pytest.approx(0.1 * 4.0**0.95)
    assert size_at(outcomes, "hysteresis", 0.5) is None
    assert size_at(detection(0.1, 6, 6), "backlash", 0.5) is None
    # Two neighbours out of order share their mean, 5 of 12.
    mixed = [*detection(0.1, 0, 6), *detection(0.2, 3, 6), *detection(0.4, 2, 6)]
    assert size_at(mixed, "backlash", 0.5) is None


MADE_UP = [
    Case("none", (), 1.0, 0, ROOT),
    ECCENTRIC,
    Case("unlisted", ("load_ripple",), 1.0, 0, ROOT),
    Case("pair", ("backlash", "torque_ripple"), 1.0, 0, ROOT),
    Case("parameter", ("stiffness",), 1.0, 0, ROOT),
    Case("detection", ("eccentricity",), 0.1, 0, ROOT),
]


def made_up_score(case, tools):
    if case.kind == "unlisted":
        raise ArithmeticError("a step too far")
    scores = dict(zip(COLUMNS, np.linspace(1.0, 2.0, len(COLUMNS)), strict=True))
    scores |= {"status": 1.0, "first": 3.0, "first_port": 1.0, "second": np.nan}
    scores |= {"equivalents": 5.0, "truth_in_class": 0.0}
    scores |= dict.fromkeys(blind_scoring.RIVALS, 2.0)
    return scores, (1.0, 2.0, 3.0, 4.0)


def test_a_campaign_outlives_a_defect_resumes_and_leaves_what_the_report_reads(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(blind, "all_cases", lambda: MADE_UP)
    monkeypatch.setattr(blind_scoring, "score", made_up_score)
    monkeypatch.setattr(blind_scoring, "other_tools", dict)
    # No rival is asked, so none need be installed.
    monkeypatch.setattr(blind, "require", lambda *_: None)
    context = Context(1, tmp_path, Campaign(tmp_path), full=True)
    first = blind.run(context)
    assert "a step too far" in capsys.readouterr().err
    # A second run finds every case on disk.
    monkeypatch.setattr(blind_scoring, "score", None)
    assert blind.run(context).tables == first.tables
    files = tmp_path / "blind" / "blind.csv", tmp_path / "times" / "blind" / "blind_seconds.csv"
    found = read_outcomes(*files)
    assert [one.case for one in found] == MADE_UP
    assert [one.status for one in found] == ["named", "named", "error", *["named"] * 3]
    assert found[1].seconds == (1.0, 2.0, 3.0, 4.0)
    for file in files:
        shutil.copy(file, tmp_path)
    monkeypatch.setattr(committed, "DATA", tmp_path)
    quick = blind.run(replace(context, full=False))
    for table, other in zip(quick.tables, first.tables, strict=True):
        assert [row[0] for row in table.rows] == [row[0] for row in other.rows]
    assert blind.run(replace(context, full=False)).tables == quick.tables


def test_outcomes_survive_their_csv(tmp_path):
    kept = [
        as_outcome(case, made_up_score(case, {})[0]) for case in MADE_UP if case.kind != "unlisted"
    ]
    paths = tmp_path / "outcomes.csv", tmp_path / "seconds.csv"
    paths[0].write_text(format_outcomes(kept), encoding="utf-8")
    paths[1].write_text(format_seconds(kept), encoding="utf-8")
    for read, one in zip(read_outcomes(*paths), kept, strict=True):
        assert replace(read, numbers={}) == replace(one, numbers={})
        assert read.numbers == pytest.approx(one.numbers, rel=1e-5)


def test_a_job_names_itself_by_all_that_it_does():
    keys = {BlindJob(case).key for case in [*all_cases(), *all_cases(ROOT)]}
    assert len(keys) == 2 * len(all_cases())


def test_the_committed_outcomes_are_those_of_the_committed_cases():
    files = (committed_file(name, "blind") for name in (blind.OUTCOMES, blind.SECONDS))
    found = read_outcomes(*files)
    # Detection limits come last, and may be missing.
    assert [one.case for one in found] == all_cases()[: len(found)]
    assert {one.case.kind for one in found} >= {"none", "single", "unlisted", "pair"}


@pytest.mark.parametrize(("moved", "words"), [(2.0, "by 4.0 standard"), (0.65, "by 1.3 standard")])
def test_how_far_a_ripple_moves_the_base_is_measured(moved, words):
    ripple = Case("single", ("torque_ripple",), 1.0, 0, ROOT)
    biases = {"bias_before": moved, "bias_after": moved, "bias_error": 0.5}
    cells = {"cells_moved": 1.0, "cells_flagged": 1.0, "cells_both": 1.0}
    counts = Outcome(ripple, "named", ("torque_ripple:input",), numbers=biases | cells)
    # Neither a case whose bias is within its error nor a failure counts.
    idle = replace(counts, numbers=cells | {**biases, "bias_before": 0.1, "bias_after": 0.1})
    failed = replace(counts, status="error", numbers={})
    note = shortfalls_table([counts, counts, idle, idle, idle, failed]).note
    assert f"torque ripple: in the median of the cases that count it moves the base {words}" in note


def test_without_the_extra_a_full_campaign_ends_with_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pysindy", None)
    arguments = ["blind", "--full", "--workers", "1", "--out", str(tmp_path)]
    assert main(arguments) == FAILED
    title, blank, message = capsys.readouterr().err.splitlines()
    assert title.startswith("blind: ")
    assert (blank, message) == ("", "blind: pysindy is not installed: pip install '.[blind]'")
    assert list(tmp_path.iterdir()) == []
    # The extra that the line names is one that brings it.
    project = tomllib.loads((places.ROOT / "pyproject.toml").read_text())
    (needed,) = project["project"]["optional-dependencies"]["blind"]
    assert needed.startswith("pysindy")
