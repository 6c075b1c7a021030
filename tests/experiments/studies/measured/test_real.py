"""Verdicts on real machines: the stored ones are today's, and they are judged by stated rules."""

from types import SimpleNamespace

import numpy as np
import pytest

from experiments.runner.campaign import Campaign
from experiments.runner.committed import committed_file, read_rows
from experiments.runner.registry import Context
from experiments.runner.result import NOT_SHOWN
from experiments.studies.measured import other_tools, real
from experiments.studies.measured.known_answers import (
    CONFIDENT,
    FALLS_SHORT,
    KNOWN_RIGS,
    PARTLY,
    RIGHT,
    UNKNOWN,
    WRONG,
    KnownRig,
    judged,
)
from experiments.studies.measured.rigs import MEASURED, RIGS
from pymoo_hdte.mechanism import BelievedValue, Input, Mechanism, Port, Record

CHEAP = ("lara8_joint_3",)
JOINT = KnownRig(
    "joint",
    "nowhere",
    "gravity and dry friction",
    "made up",
    (frozenset({"gravity"}), frozenset({"coulomb_friction", "stribeck_friction"})),
    frozenset({"force_offset"}),
)


@pytest.mark.parametrize(
    ("status", "names", "judgement"),
    [
        ("named", ["gravity", "coulomb_friction"], RIGHT),
        ("named", ["stribeck_friction", "gravity", "force_offset"], RIGHT),
        ("named", ["gravity"], PARTLY),
        ("named", ["gravity", "coulomb_friction", "backlash"], PARTLY),
        ("partial", ["gravity", "coulomb_friction"], PARTLY),
        ("class", ["gravity", "coulomb_friction"], PARTLY),
        ("named", ["coulomb_friction"], CONFIDENT),
        ("class", ["backlash"], CONFIDENT),
        ("adequate", [], CONFIDENT),
        ("parameter", ["parameter"], CONFIDENT),
        ("unlisted", [], WRONG),
        ("partial", ["coulomb_friction"], WRONG),
    ],
)
def test_an_answer_is_judged_by_what_is_known(status, names, judgement):
    assert judged(JOINT, status, names) == judgement
    assert judged(KnownRig("a", "b", "none", "nobody"), status, names) == UNKNOWN


def stored(part=""):
    rows = read_rows(committed_file(f"real{part}.csv", real.NAME))
    return [list(row.values()) for row in rows]


def test_every_rig_is_shown_what_falls_short_first(tmp_path):
    result = real.run(Context(1, tmp_path, Campaign(tmp_path)))
    verdicts, allowances, tools, seconds = result.tables
    names = [rig.name for rig in KNOWN_RIGS]
    assert all((RIGS / f"{name}.toml").is_file() for name in names)
    assert [row[0] for row in stored()] == names
    ranks = [FALLS_SHORT.index(row[1]) for row in verdicts.rows]
    assert len(ranks) == len(names)
    assert ranks == sorted(ranks)
    findings = [one for table in result.tables for one in table.findings]
    assert len(findings) == 4
    assert [one.verdict for one in findings].count("Holds") == 3
    # Eight machines are too few to show that none is judged wrongly with confidence.
    assert findings[0].verdict == NOT_SHOWN
    assert {row[0] for row in allowances.rows} == {rig.name for rig in KNOWN_RIGS if rig.effects}
    allowed = {name.replace("_", " ") for rig in KNOWN_RIGS for name in rig.also}
    printed = " ".join(str(row[2]) for row in allowances.rows)
    assert all(name in printed for name in allowed)
    for table, least in ((tools, 4), (seconds, 1)):
        assert {row[0] for row in table.rows} == set(names)
        assert all(sum(row[0] == name for row in table.rows) >= least for name in names)


def test_shortfalls_are_told_and_what_is_right_is_counted():
    rows = [
        ["one", CONFIDENT, "named", "backlash", "gravity"],
        ["two", RIGHT, "named", "gravity", "gravity"],
        ["three", UNKNOWN, "named", "gravity", "none published"],
    ]
    (told,) = real.shortfalls(rows)
    assert "one (confidently wrong): backlash, where gravity is known. Right: 1 of 2" in told
    assert "two" not in told
    assert real.shortfalls(rows[1:]) == ("Right: 1 of 1 whose answer is known.",)
    counted = "1 with no answer known, 1 right"
    assert f"3 machines that others measured: 1 confidently wrong, {counted}." in (
        real._in_one_sentence(rows)
    )
    assert f"2 machines that others measured: {counted}, none confidently wrong." in (
        real._in_one_sentence(rows[1:])
    )


def test_what_is_right_by_an_allowance_alone_is_said():
    verdict = next(row for row in stored() if row[0] == "silverbox")
    assert verdict[1] == RIGHT
    (counted,) = real.shortfalls([verdict])
    assert counted.startswith("Right: 1 of 1 whose answer is known, with")
    assert "silverbox (force offset)" in counted
    assert "1 right (1 of them with" in real._in_one_sentence([verdict])
    plain = [*verdict[:3], "hardening stiffness", *verdict[4:]]
    assert real.shortfalls([plain]) == ("Right: 1 of 1 whose answer is known.",)


def examined(name, **options):
    rig = next(rig for rig in KNOWN_RIGS if rig.name == name)
    if not (MEASURED / rig.folder).is_dir():
        pytest.skip(f"the measurements are not at {MEASURED / rig.folder}")
    return real.examined(rig, **options)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(rig.name, marks=() if rig.name in CHEAP else pytest.mark.nightly)
        for rig in KNOWN_RIGS
    ],
)
def test_the_stored_verdict_is_what_comes_out(name):
    found = examined(name, tools=False, whole=False).verdict
    (row,) = (row for row in stored() if row[0] == name)
    assert len(found) == len(row) == len(real.VERDICTS)
    words = [column.name for column in real.VERDICTS].index("farthest from a known value")
    assert found[:words] == row[:words]
    # Other processors round otherwise, and a fit ends where a step brings less than it counts.
    for now, before in zip(found[words:], row[words:], strict=True):
        assert (now == before) or float(now) == pytest.approx(float(before), rel=5e-3)


def test_without_the_measurements_a_full_run_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(real, "MEASURED", tmp_path / "nowhere")
    result = real.run(Context(1, tmp_path, Campaign(tmp_path), full=True))
    assert str(tmp_path / "nowhere") in result.answer
    monkeypatch.setattr("experiments.studies.measured.rigs.MEASURED", tmp_path / "nowhere")
    assert real.examined(KNOWN_RIGS[0]) is None


@pytest.fixture(scope="module")
def cubic():
    """Return what other tools get of an oscillator: 2 a + 3 v + 50 q + 400 q^3 = force."""
    time = np.arange(0.0, 40.0, 0.01)
    q = 0.3 * (np.sin(2.1 * time) + np.sin(3.7 * time + 1.0) + np.sin(5.3 * time + 2.0))
    v = np.gradient(q, time)
    force = 2.0 * np.gradient(v, time) + 3.0 * v + 50.0 * q + 400.0 * q**3
    mechanism = Mechanism(
        {"q": BelievedValue(1.0, 1.0)},
        [Port("spring", {"q": 1.0}, BelievedValue(60.0, 0.5))],
        [Input("force", {"q": 1.0})],
    )
    records = [
        Record(role, role, time[rows], {"q": q[rows], "force": force[rows]})
        for role, rows in (("train", slice(2400)), ("held_out", slice(2400, None)))
    ]
    simulated = [SimpleNamespace(record="held_out", rows=(slice(100, 300, 4), slice(600, 800, 4)))]
    return SimpleNamespace(mechanism=mechanism, records=records, cutoff=3.0, simulated=simulated)


def test_least_squares_says_coulomb_friction_whatever_is_there(cubic):
    _, words, names, of_force, _ = other_tools.least_squares(cubic)
    assert names == {"coulomb_friction"}
    assert "sign v" in words
    assert of_force < 0.9


def test_sparse_regression_finds_the_terms_of_a_cubic_spring(cubic):
    pytest.importorskip("pysindy")
    _, words, names, of_force, _ = other_tools.sparse_regression(cubic)
    assert names == {"hardening_stiffness"}
    assert of_force > 0.999
    assert "sin q" not in words


def test_narmax_models_are_simulated_in_our_windows(cubic):
    _, words, names, _, of_motion = other_tools.narmax(cubic)
    assert names is None
    assert (words == "not installed") == (of_motion is None)
    if of_motion is not None:
        assert of_motion > 0.9


def test_a_tool_that_is_not_installed_is_left_out(cubic, monkeypatch):
    monkeypatch.setattr(other_tools, "find_spec", lambda name: None)
    for tool in (other_tools.sparse_regression, other_tools.narmax):
        _, words, names, of_force, of_motion = tool(cubic)
        assert words == "not installed"
        assert names is of_force is of_motion is None
