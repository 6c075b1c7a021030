"""Blind campaigns: what a case hides and nothing else, scores of verdicts, exact intervals."""

import pickle
import shutil
import sys
import tomllib
from collections import Counter
from dataclasses import replace
from functools import cache, partial

import numpy as np
import places
import pytest
from made_verdicts import with_status
from planted_features import analysed, known_data, listed, measured

from experiments.command_line import FAILED, main
from experiments.runner import committed
from experiments.runner.registry import Context
from experiments.studies.blind import campaigns
from experiments.studies.blind import experiment as blind
from experiments.studies.blind import scoring as blind_scoring
from experiments.studies.blind.campaigns import campaign_of, hiding, rows_of, stressed
from experiments.studies.blind.cases import STRESSES, Case, all_cases
from experiments.studies.blind.data import format_outcomes, format_seconds, outcome, read_outcomes
from experiments.studies.blind.experiment import confusion_matrix
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.rig.forms import FORMS, LISTED, UNLISTED
from experiments.studies.blind.rig.runs import Condition
from experiments.studies.blind.rig.session import ARCSEC, SHEET, draw_circumstances
from experiments.studies.blind.runs import RUNS
from experiments.studies.blind.scoring import (
    COLUMNS,
    BlindJob,
    bias_scores,
    coverage_scores,
    truly_moved,
    verdict_scores,
)
from experiments.studies.blind.tables import must_reach_table
from experiments.studies.blind.targets import (
    ALARM,
    ALARM_STRESSES,
    BOTH,
    KINDS,
    NOT_RUN,
    WRONG,
    demands,
    reliability,
)
from experiments.studies.blind.truth import NAMES, PORTS, STATUSES, code_of_set, words_of_set
from pymoo_hdte._runner.campaign import Campaign, Run
from pymoo_hdte._runner.result import MISSED, NOT_SHOWN, SHOWN
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import Data, start_parameters
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._selection.candidate import Layout, out_of_tolerance
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding

ROOT = 99
SHORT = (
    Condition(2000.0, 40.0, 1000.0, 1, "train"),
    Condition(2000.0, 0.0, 1000.0, 1, "held_out"),
)


def case_of(kind, name=None, **further):
    """The first case of a kind that hides an effect of a name alone."""
    cases = (Case(kind, number, ROOT) for number in range(400))
    return next(
        one
        for one in cases
        if (name is None or one.names == (name,))
        and all(getattr(one, key) == value for key, value in further.items())
    )


ECCENTRIC = case_of("single", "eccentricity")
CLEAN = Case("none", 0, ROOT)


@pytest.fixture
def short(monkeypatch):
    """Campaigns of two fast records."""
    quick = partial(draw_circumstances, conditions=SHORT)
    monkeypatch.setattr(campaigns, "draw_circumstances", quick)


def test_any_beginning_of_the_list_has_the_same_mix():
    whole_list = all_cases()
    assert len({one.key for one in whole_list}) == len(whole_list) == 4800
    cases = whole_list[:2400]
    expected = {"single": 1000, "pair": 400, "triple": 100, "none": 300, "unlisted": 200,
                "stressed": 400}  # fmt: skip
    assert Counter(one.kind for one in cases) == expected
    for end in (24, 240, 777, 1801):
        counts = Counter(one.kind for one in cases[:end])
        for kind, count in expected.items():
            assert abs(counts[kind] - count * end / 2400) <= 2.0
    for kind, words in (("single", LISTED), ("unlisted", UNLISTED)):
        whole = Counter(one.names[0] for one in cases if one.kind == kind)
        assert set(whole) == set(words)
        assert max(whole.values()) - min(whole.values()) <= 1
    forms = Counter((one.names[0], one.forms.split(" ")[0]) for one in cases
                    if one.kind == "single")  # fmt: skip
    assert len(forms) >= sum(FORMS.values()) - 4
    stressed_cases = [one for one in cases if one.kind == "stressed"]
    assert Counter(one.stress for one in stressed_cases).most_common()[-1][1] == 66
    for stress in STRESSES:
        nothing = [one for one in stressed_cases if one.stress == stress and not one.names]
        expected = 33 if stress in ALARM_STRESSES else 16
        assert abs(len(nothing) - expected) <= 3
        assert len({one.names for one in stressed_cases if one.stress == stress}) == 19


def test_a_case_goes_to_a_worker_after_it_was_asked_what_it_hides():
    assert ECCENTRIC.names == ("eccentricity",)
    assert pickle.loads(pickle.dumps(BlindJob(ECCENTRIC))) == BlindJob(ECCENTRIC)


def test_several_effects_differ_and_one_bench_can_have_them():
    for case in all_cases(ROOT)[:240]:
        if case.kind in ("pair", "triple"):
            assert len(set(case.names)) == {"pair": 2, "triple": 3}[case.kind]
            assert set(case.names) <= set(LISTED)


@cache
def rows(case, twin=False):
    hidden = hiding(case)
    return rows_of(hidden, hidden.twin if twin else hidden.session)[0]


@pytest.mark.slow
@pytest.mark.parametrize("stress", [pytest.param(None, marks=pytest.mark.nightly), "outliers"])
def test_a_case_gives_the_same_bytes_twice_and_another_root_others(short, stress):
    case = case_of("stressed", stress=stress) if stress else ECCENTRIC
    first, second = (rows_of(one, one.session)[0] for one in (hiding(case), hiding(case)))
    one = hiding(replace(case, root=ROOT + 1))
    third = rows_of(one, one.session)[0]
    for a, b, c in zip(first, second, third, strict=True):
        assert a.tobytes() == b.tobytes()
        assert not np.array_equal(a, c)


def test_the_twin_differs_only_by_the_effect(short):
    hidden = hiding(ECCENTRIC)
    pairs = zip(*(rows_of(hidden, one)[0] for one in (hidden.session, hidden.twin)), strict=True)
    amplitude = hidden.effects[0].size
    for one, other in pairs:
        # An encoder off centre changes what it shows, not how the drive moves.
        assert np.array_equal(one[[0, 2, 3]], other[[0, 2, 3]])
        swing = np.ptp(one[1] - other[1])
        assert swing == pytest.approx(2.0 * amplitude, abs=0.5 * amplitude + SHEET.angle_step)


@pytest.mark.parametrize("stress", ["parameters", "amplitudes", "one_load", "half"])
def test_a_stress_changes_what_it_says_and_nothing_else(stress):
    about = draw_circumstances(np.random.default_rng(1))
    other = stressed(about, stress, np.random.default_rng(2))
    off = [getattr(other.machine, name) / getattr(SHEET, name) - 1.0
           for name in ("stiffness", "input_inertia", "input_damping", "load_inertia")]  # fmt: skip
    wrong = np.array(other.machine.amplitudes) / np.array(SHEET.amplitudes) - 1.0
    assert (np.abs(off).min() > 0.14) == (stress == "parameters")
    assert (np.abs(wrong).max() > 0.4) == (stress == "amplitudes")
    loads = {one.load for one in other.conditions}
    assert (loads == {20.0}) == (stress == "one_load")
    assert np.ptp(other.loads - [one.load for one in other.conditions]) < 3.0
    roles = Counter(one.role for one in other.conditions)
    assert roles == ({"train": 7, "held_out": 3} if stress == "half" else
                     {"train": 13, "held_out": 6})  # fmt: skip


def test_faulty_rows_and_other_noise_are_in_what_is_read(short):
    case = case_of("stressed", stress="outliers")
    hidden = hiding(case)
    faulty = rows_of(hidden, hidden.session)[0]
    plain = rows_of(replace(hidden, case=replace(case, kind="single")), hidden.session)
    assert len(faulty) == len(plain[0])
    jumps = [np.abs(np.diff(row[1] - row[0] / 101.0)).max() / ARCSEC for row in faulty]
    torques = [np.abs(row[2] - np.median(row[2])).max() / SHEET.input_noise for row in faulty]
    loads = [np.abs(row[3] - np.median(row[3])).max() / SHEET.output_noise for row in faulty]
    assert max(max(jumps) / 15.0, max(torques) / 20.0, max(loads) / 20.0) > 1.0


def analysis_of(case):
    hidden = hiding(case)
    campaign = campaign_of(hidden, hidden.session)
    features = measure(campaign, campaign.train, [1.0 / 101.0, 1.0, 2.0, 2.02])
    data = Data(campaign, features, start_parameters(campaign, features))
    return DriveFinding(campaign, data, None, ()), campaign_of(hidden, hidden.twin)


def test_an_encoder_off_centre_moves_its_line_of_the_transmission_error_only(short):
    moved = truly_moved(*analysis_of(ECCENTRIC))
    assert moved[0, 0, 1]
    assert not moved[:, 1:3].any()
    assert not moved[:, 0, 3:].any()


def test_nothing_hidden_moves_nothing(short):
    assert not truly_moved(*analysis_of(CLEAN)).any()


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
    drift = listed(data, "thermal_drift")
    alike = Hypothesis(replace(base, candidates=(friction, drift)), 0.0, 1.0)
    verdict = with_status(analysed(data).verdict, "class", chosen=chosen, equivalent=(alike,))
    pairs = (one for one in all_cases(ROOT) if one.kind == "pair")
    case = next(one for one in pairs if set(one.names) == {"thermal_drift", "coulomb_friction"})
    found = as_outcome(case, verdict_scores(case, verdict))
    assert found.status == "class"
    assert found.chosen == ("kinematic_error:mesh@3", "coulomb_friction:input")
    assert set(found.equivalents) == {"coulomb_friction", "thermal_drift"}
    assert found.members == 2
    assert found.all_named
    assert found.probability is None
    alone = as_outcome(case, verdict_scores(case, replace(verdict, equivalent=())))
    assert not alone.all_named


def test_all_that_is_named_is_kept():
    """Several base parameters beside effects, the last of which must not be lost."""
    data = known_data()
    base = fit(data)
    freed = [out_of_tolerance(name, name) for name in
             ("stiffness", "input_damping", "load_inertia", "error_amplitude_2")]  # fmt: skip
    candidates = (*freed, listed(data, "thermal_drift"))
    chosen = Hypothesis(replace(base, candidates=candidates), 0.0, 1.0)
    verdict = with_status(analysed(data).verdict, "named", chosen=chosen, equivalent=())
    found = as_outcome(ECCENTRIC, verdict_scores(ECCENTRIC, verdict))
    assert found.chosen == tuple(one.label for one in candidates)
    expected = ("parameter", "parameter", "load_inertia", "parameter", "thermal_drift")
    assert found.names == expected


def test_all_that_a_verdict_may_say_has_a_code():
    assert set(LISTED) | set(UNLISTED) | {"parameter", "encoder_line", "partial"} <= set(NAMES)
    assert {"partial", "unlisted", "error"} <= set(STATUSES)
    assert {"error_amplitude_2", "stiffness", "sensor"} <= set(PORTS)
    assert len(NAMES) < 53


def test_sets_of_names_survive_their_number():
    rng = np.random.default_rng(1)
    for _ in range(50):
        names = set(rng.choice(NAMES, rng.integers(0, len(NAMES)), replace=False).tolist())
        assert set(words_of_set(code_of_set(names))) == names


FRICTION = case_of("single", "position_dependent_friction")
STIFF = case_of("stressed", stress="parameters", names=())
PAIR = next(one for one in all_cases(ROOT) if one.kind == "pair")
FIRST, SECOND = PAIR.names
BENCH = case_of("unlisted", "load_ripple")
WARM = case_of("unlisted", "warming_friction")
DAMPED = case_of("single", "damping_reference")


@pytest.mark.parametrize(
    ("case", "status", "chosen", "members", "right", "confident", "answer"),
    [
        (ECCENTRIC, "named", "eccentricity:sensor", 0, True, False, "eccentricity"),
        (ECCENTRIC, "named", "soft_windup:mesh", 0, False, True, "soft_windup"),
        (ECCENTRIC, "named", "eccentricity:sensor backlash:mesh", 0, True, True, "eccentricity"),
        (ECCENTRIC, "partial", "eccentricity:sensor", 0, True, False, "eccentricity"),
        (ECCENTRIC, "partial", "eccentricity:sensor backlash:mesh", 0, False, False,
         "eccentricity"),
        (ECCENTRIC, "class", "soft_windup:mesh", 3, True, False, "eccentricity"),
        (ECCENTRIC, "class", "eccentricity:sensor", 4, False, False, "eccentricity"),
        (ECCENTRIC, "parameter", "parameter:stiffness", 0, False, True, "parameter"),
        (ECCENTRIC, "unlisted", "backlash:mesh", 0, False, False, "unlisted"),
        (ECCENTRIC, "error", "", 0, False, False, "error"),
        # What an effect contains may be named beside it, not instead of it.
        (FRICTION, "named", "position_dependent_friction:input@1 coulomb_friction:input", 0, True,
         False, "position_dependent_friction"),
        (FRICTION, "named", "coulomb_friction:input", 0, False, True, "coulomb_friction"),
        # One physical effect of two names.
        (DAMPED, "parameter", "parameter:damping", 0, True, False, "damping_reference"),
        (DAMPED, "parameter", "parameter:stiffness", 0, False, True, "parameter"),
        (CLEAN, "adequate", "", 0, True, False, "adequate"),
        (CLEAN, "named", "backlash:mesh", 0, False, True, "backlash"),
        (BENCH, "unlisted", "backlash:mesh", 0, True, False, "unlisted"),
        (BENCH, "adequate", "", 0, False, False, "adequate"),
        (BENCH, "partial", "backlash:mesh", 0, False, False, "backlash"),
        (BENCH, "named", "backlash:mesh", 0, False, True, "backlash"),
        (WARM, "partial", "coulomb_friction:input", 0, True, False, "coulomb_friction"),
        (STIFF, "parameter", "parameter:input_inertia", 0, True, False, "parameter"),
        (STIFF, "named", "load_inertia:output parameter:stiffness", 0, False, False,
         "load_inertia"),
        (STIFF, "named", "nonlinear_drag:input", 0, False, True, "nonlinear_drag"),
        (PAIR, "named", f"{FIRST}:x", 0, False, False, FIRST),
        (PAIR, "named", f"{SECOND}:x {FIRST}:x", 0, True, False, SECOND),
        (PAIR, "partial", f"{SECOND}:x {FIRST}:x", 0, False, False, SECOND),
    ],
)  # fmt: skip
def test_verdicts_are_scored_as_the_issue_says(
    case, status, chosen, members, right, confident, answer
):
    found = Outcome(case, status, tuple(chosen.split()), (), members, status == "class")
    assert found.right_answer == right
    assert found.wrong_confident == confident
    assert found.answer == answer


def test_two_of_a_triple_may_be_partial_but_not_beside_a_wrong_name():
    triple = next(one for one in all_cases(ROOT) if one.kind == "triple")
    labels = [f"{name}:x" for name in triple.names]
    wrong = next(name for name in LISTED if name not in triple.names and "coulomb" not in name)
    for status in ("named", "partial"):
        assert Outcome(triple, status, tuple(labels[:2])).two_named
        assert not Outcome(triple, status, tuple(labels[:1])).two_named
        assert not Outcome(triple, status, (*labels[:2], f"{wrong}:x")).two_named


def test_alarms_under_stress_count_where_only_noise_or_rows_are_wrong():
    kinds = {stress: case_of("stressed", stress=stress, names=()) for stress in STRESSES}
    alarms = [Outcome(case, "named", ("backlash:mesh",)) for case in kinds.values()]
    judged = {(one.what, one.cases): one for one in demands(alarms)}
    (counted,) = [one for (what, words), one in judged.items()
                  if what == "alarm" and "misstated" in words]  # fmt: skip
    assert (counted.measured.n, counted.measured.value) == (2, 1.0)


def test_what_is_said_with_a_probability_is_compared_with_what_is_true():
    right = Outcome(ECCENTRIC, "named", ("eccentricity:sensor",), probability=0.97)
    wrong = Outcome(ECCENTRIC, "named", ("backlash:mesh",), probability=0.96)
    sure = Outcome(CLEAN, "adequate", (), probability=1.0)
    silent = replace(wrong, probability=None)
    found = reliability([right, right, right, wrong, sure, silent])
    assert [one.n for _, one in found] == [4, 1]
    assert [one.value for _, one in found] == [0.75, 1.0]
    assert [said for said, _ in found] == pytest.approx([0.9675, 1.0])


def test_an_interval_covers_a_value_that_the_hidden_form_has():
    data = known_data()
    friction = listed(data, "coulomb_friction")
    base = fit(data)
    fitted = fit(data, (friction,))
    verdict = with_status(analysed(data).verdict, "named", chosen=Hypothesis(fitted, 0.0, 1.0))
    level = float(fitted.values[-1])
    spread = float(np.sqrt(fitted.covariance[-1, -1]))
    assert len(base.values) == len(fitted.values) - 1
    for off, covered in ((1.9, 1.0), (2.1, 0.0)):
        true = {("coulomb_friction", "level"): level + off * spread}
        found = coverage_scores(_Hidden(true), verdict)
        assert found == {"quantities": 1.0, "quantities_covered": covered}
    none = coverage_scores(_Hidden({("backlash", "half_width"): 1.0}), verdict)
    assert none["quantities"] == 0.0


class _Hidden:
    def __init__(self, quantities):
        self.quantities = quantities


def test_an_answer_that_the_bench_never_hides_has_its_place_in_the_confusion_matrix():
    """The picture of a block of cases failed at such an effect."""
    outcomes = [
        Outcome(CLEAN, "named", ("changed_static_error:mesh",)),
        Outcome(ECCENTRIC, "named", ("eccentricity:sensor",)),
    ]
    (axis,) = confusion_matrix(outcomes).axes
    answers = [one.get_text() for one in axis.get_xticklabels()]
    places = {answers[round(one.get_position()[0])] for one in axis.texts}
    assert places == {"changed static error", "eccentricity"}


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


def test_every_demand_that_was_run_is_found_and_three_cases_show_nothing():
    triples = [one for one in all_cases(ROOT) if one.kind == "triple"][:3]
    pairs = [one for one in all_cases(ROOT) if one.kind == "pair"][:12]
    outcomes = [Outcome(one, "unlisted", ()) for one in (*triples, *pairs)]
    judged = list(demands(outcomes))
    verdicts = {(one.what, one.cases): one.verdict for one in judged}
    assert verdicts[WRONG, KINDS["triple"]] == NOT_SHOWN
    assert verdicts[BOTH, KINDS["pair"]] == MISSED
    assert verdicts[ALARM, KINDS["none"]] == NOT_RUN
    table = must_reach_table(outcomes)
    ran = [one for one in judged if one.measured.n]
    assert sorted(one.verdict for one in table.findings) == sorted(one.verdict for one in ran)
    assert SHOWN not in verdicts.values()


MADE_UP = all_cases(ROOT)[:16]


def made_up_score(case, tools):
    if case.kind == "unlisted":
        raise ArithmeticError("a step too far")
    scores = dict(zip(COLUMNS, np.linspace(1.0, 2.0, len(COLUMNS)), strict=True))
    scores |= dict.fromkeys(blind_scoring.PLACES, np.nan)
    scores |= {"status": 1.0, "chosen_1": 3.0, "chosen_1_port": 1.0}
    scores |= {"equivalents": 5.0, "members": 2.0, "truth_in_class": 0.0, "probability": 0.9}
    scores |= dict.fromkeys(blind_scoring.RIVALS, 2.0)
    return scores, (1.0, 2.0, 3.0, 4.0)


@pytest.mark.slow
def test_a_campaign_outlives_a_defect_resumes_and_leaves_what_the_report_reads(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(blind, "all_cases", lambda: all_cases(ROOT))
    monkeypatch.setattr(blind_scoring, "score", made_up_score)
    monkeypatch.setattr(blind_scoring, "other_tools", dict)
    # No rival is asked, so none need be installed.
    monkeypatch.setattr(blind, "require", lambda *_: None)
    context = Context(1, tmp_path, Campaign(tmp_path), full=True, cases=range(1, len(MADE_UP) + 1))
    first = blind.run(context)
    assert f"Cases 1 to 16 of the {len(all_cases())} " in " ".join(first.paragraphs)
    assert "a step too far" in capsys.readouterr().err
    # A second run finds every case on disk.
    monkeypatch.setattr(blind_scoring, "score", None)
    assert blind.run(context).tables == first.tables
    files = tmp_path / "blind" / "blind.csv", tmp_path / "times" / "blind" / "blind_seconds.csv"
    found = read_outcomes(*files)
    assert [one.case for one in found] == MADE_UP
    assert {one.status for one in found if one.case.kind != "unlisted"} == {"named"}
    assert {one.status for one in found if one.case.kind == "unlisted"} == {"error"}
    assert found[1].seconds == (1.0, 2.0, 3.0, 4.0)
    for file in (*files, tmp_path / "blind" / RUNS):
        shutil.copy(file, tmp_path)
    monkeypatch.setattr(committed, "DATA", tmp_path)
    quick = blind.run(replace(context, full=False))
    for table, other in zip(quick.tables, first.tables, strict=True):
        assert [row[0] for row in table.rows] == [row[0] for row in other.rows]
    assert blind.run(replace(context, full=False)).tables == quick.tables


def test_without_its_committed_outcome_there_is_no_report(tmp_path, monkeypatch):
    monkeypatch.setattr(committed, "DATA", tmp_path)
    with pytest.raises(FileNotFoundError, match="blind --full"):
        blind.run(Context(1, tmp_path, Campaign(tmp_path)))


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


def test_only_a_full_run_that_can_be_limited_takes_a_number_of_cases(tmp_path, capsys):
    for wrong in (["blind", "--cases", "3"], ["table5", "--full", "--cases", "3"]):
        with pytest.raises(SystemExit):
            main([*wrong, "--out", str(tmp_path)])
        capsys.readouterr()


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
