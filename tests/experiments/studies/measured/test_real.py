"""Verdicts on real machines: the stored ones are today's, and they are judged by stated rules."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from experiments.runner.committed import committed_file, read_rows
from experiments.runner.registry import Context
from experiments.studies.measured import mujoco_study, other_tools, real
from experiments.studies.measured.first_verdict import LOGS, corrected
from experiments.studies.measured.known_answers import (
    CONFIDENT,
    FALLS_SHORT,
    KNOWN_RIGS,
    NOT_FOUND,
    PARTLY,
    RIGHT,
    UNKNOWN,
    WRONG,
    KnownRig,
    judged,
)
from experiments.studies.measured.rigs import RIGS, SHARED
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte.effects.friction import CoulombFriction
from pymoo_hdte.mechanism import BelievedValue, Input, LawAt, Mechanism, Port, Record
from pymoo_hdte.mechanism.simulation import simulate_mechanism

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
        ("named", ["gravity"], CONFIDENT),
        ("named", ["gravity", "coulomb_friction", "backlash"], CONFIDENT),
        ("partial", ["gravity", "coulomb_friction"], PARTLY),
        ("class", ["gravity", "coulomb_friction"], PARTLY),
        ("named", ["coulomb_friction"], CONFIDENT),
        ("class", ["backlash"], CONFIDENT),
        ("adequate", [], CONFIDENT),
        ("parameter", ["parameter"], CONFIDENT),
        ("unlisted", [], NOT_FOUND),
        ("partial", ["coulomb_friction"], WRONG),
    ],
)
def test_an_answer_is_judged_by_what_is_known(status, names, judgement):
    assert judged(JOINT, status, names) == judgement
    assert judged(KnownRig("a", "b", "none", "nobody"), status, names) == UNKNOWN


def test_where_no_effect_is_known_a_plain_verdict_may_name_what_is_plausible_alone():
    rig = KnownRig("a", "b", "a late torque", "nobody", also=frozenset({"gravity"}))
    assert judged(rig, "named", ["gravity"]) == UNKNOWN
    assert judged(rig, "partial", ["backlash"]) == UNKNOWN
    assert judged(rig, "named", ["gravity", "backlash"]) == CONFIDENT


def test_what_is_known_of_the_logs_that_went_wrong_is_their_stated_truth():
    path = SHARED / "cases" / "real" / "truth.json"
    if not path.is_file():
        pytest.skip(f"the logs are not at {path.parent}")
    stated = json.loads(path.read_text())
    rigs = {rig.folder.removeprefix("cases/real/"): rig for rig in KNOWN_RIGS}
    assert set(stated) <= set(rigs)
    for folder, truth in stated.items():
        main, also = rigs[folder].effects, set(truth.get("also", ()))
        every = [{name} for name in truth.get("all", ())]
        every += [set(truth["any"])] if "any" in truth else []
        if "absent" not in truth:
            assert [set(effects) for effects in main] == every
            assert rigs[folder].also == also


def stored(part=""):
    rows = read_rows(committed_file(f"real{part}.csv", real.NAME))
    return [list(row.values()) for row in rows]


def test_every_rig_is_shown_what_falls_short_first(tmp_path):
    result = real.run(Context(1, tmp_path, Campaign(tmp_path)))
    verdicts, held_out, first, allowances, tools, seconds = result.tables
    names = [rig.name for rig in KNOWN_RIGS]
    described = [SHARED / rig.folder / "rig.toml" for rig in KNOWN_RIGS]
    for name, beside in zip(names, described, strict=True):
        assert "cases" in beside.parts or (RIGS / f"{name}.toml").is_file()
    assert [row[0] for row in stored()] == names
    ranks = [FALLS_SHORT.index(row[1]) for row in verdicts.rows]
    assert len(ranks) == len(names)
    assert ranks == sorted(ranks)
    ratio = [column.name for column in held_out.columns].index(real.RATIO.name)
    ratios = [row[ratio] for row in held_out.rows]
    assert {row[0] for row in held_out.rows} == set(names)
    assert ratios == sorted(ratios, reverse=True)
    (keeps_up,) = held_out.findings
    assert keeps_up.agrees == (ratios[0] <= real.MOST)
    assert (f"on: {held_out.rows[0][0]}" in keeps_up.sentence) == (ratios[0] > real.MOST)
    assert [row[0] for row in first.rows] == [log.rig for log in LOGS]
    assert {row[0] for row in allowances.rows} == {rig.name for rig in KNOWN_RIGS if rig.effects}
    allowed = {name.replace("_", " ") for rig in KNOWN_RIGS if rig.effects for name in rig.also}
    printed = " ".join(str(row[2]) for row in allowances.rows)
    assert all(name in printed for name in allowed)
    for table, least in ((tools, 4), (seconds, 1)):
        counts = {name: sum(row[0] == name for row in table.rows) for name in names}
        swings = counts.pop("filmed_pendulum")  # without a force that a tool could predict
        assert swings >= 1
        assert min(counts.values()) >= least
    asked = {row[0] for row in tools.rows if row[1] == other_tools.SYSID}
    (tool,) = (tool for tool in other_tools.TOOLS if tool.name == other_tools.SYSID)
    assert asked == set(tool.rigs)


@pytest.mark.parametrize(
    ("ours", "theirs", "agrees"),
    [("0.9", "0.8", True), ("0.8", "0.9", False), ("below -10", "0.1", False)],
)
def test_our_simulation_stands_beside_that_of_mujoco(ours, theirs, agrees):
    rows = [["a rig", tool, "", "", "", "", r2] for tool, r2 in ((real.TOOL, ours), ("x", "1.0"))]
    assert real._no_worse_than_mujoco(rows) == ()
    (finding,) = real._no_worse_than_mujoco(
        [*rows, ["a rig", other_tools.SYSID, *rows[0][2:6], theirs]]
    )
    assert finding.agrees == agrees
    assert f"a rig {ours} and {theirs}" in finding.sentence


def test_a_tool_that_is_not_installed_keeps_its_stored_rows(tmp_path, monkeypatch):
    rig = KNOWN_RIGS[0].name
    there = other_tools.Tool("there", "", lambda finding: other_tools.Answer("new"))
    gone = other_tools.Tool("gone", "no-such-package", lambda finding: 1 / 0)
    assert (there.version, gone.version) == ("", None)
    old = [[rig, name, "1.0", "", f"old {name}", "", ""] for name in ("there", "gone")]
    took = [[rig, name, "7", "a machine"] for name in ("there", "gone")]
    new = real.Examined(["verdict"], [[rig, "there", "", "", "new", "", ""]], [])
    monkeypatch.setattr(real, "KNOWN_RIGS", KNOWN_RIGS[:1])
    monkeypatch.setattr(real, "TOOLS", (there, gone))
    monkeypatch.setattr(real, "LOGS", ())
    monkeypatch.setattr(real, "examined", lambda rig: new)
    monkeypatch.setattr(real, "_committed", lambda: ([], old, [], took))
    _, tools, _, seconds = real._examined(Context(1, tmp_path, Campaign(tmp_path), full=True))
    assert [(row[1], row[4]) for row in tools] == [("there", "new"), ("gone", "old gone")]
    assert seconds == [took[1]]


def test_a_draft_is_corrected_line_by_line_and_what_is_not_there_is_refused():
    draft = ["a = 1", "b = 2", "b = 2"]
    assert corrected(draft, [("a = 1", "a = 3")]) == ["a = 3", "b = 2", "b = 2"]
    assert draft[0] == "a = 1"
    for wrong in ("c = 1", "b = 2"):
        with pytest.raises(ValueError, match=wrong):
            corrected(draft, [(wrong, "d = 1")])


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
    assert f"3 sets of records: 1 confidently wrong, {counted}." in (real._in_one_sentence(rows))
    assert f"2 sets of records: {counted}, none confidently wrong." in (
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
    if not (SHARED / rig.folder).is_dir():
        pytest.skip(f"the measurements are not at {SHARED / rig.folder}")
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
    assert len(found) == len(row) == len(real.STORED)
    words = [column.name for column in real.STORED].index("off")
    assert found[:words] == row[:words]
    # Other processors round otherwise, and a fit ends where a step brings less than it counts.
    for now, before in zip(found[words:], row[words:], strict=True):
        assert (now == before) or float(now) == pytest.approx(float(before), rel=5e-3)


def test_without_the_measurements_a_full_run_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(real, "MEASURED", tmp_path / "nowhere")
    result = real.run(Context(1, tmp_path, Campaign(tmp_path), full=True))
    assert str(tmp_path / "nowhere") in result.answer
    monkeypatch.setattr("experiments.studies.measured.rigs.SHARED", tmp_path / "nowhere")
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
    return SimpleNamespace(
        mechanism=mechanism,
        records=records,
        cutoff=3.0,
        simulated=simulated,
        data=SimpleNamespace(known=()),
    )


def test_least_squares_says_coulomb_friction_whatever_is_there(cubic):
    answer = other_tools.least_squares(cubic)
    assert answer.names == {"coulomb_friction"}
    assert "sign v" in answer.words
    assert answer.of_force < 0.9


def test_rows_at_rest_count_for_no_tool():
    # A motor moves, rests under a force that its friction holds, and moves on.
    time = np.arange(0.0, 30.0, 0.01)
    moves = (time < 10.0) | (time > 20.0)
    q = 0.5 * np.where(moves, np.cos(2.0 * np.pi * 0.5 * time), 1.0)
    v = np.where(moves, -0.5 * np.pi * np.sin(np.pi * time), 0.0)
    a = np.where(moves, -0.5 * np.pi**2 * np.cos(np.pi * time), 0.0)
    force = 2.0 * a + 3.0 * v + np.where(moves, 0.0, 5.0)
    mechanism = Mechanism(
        {"q": BelievedValue(1.0, 1.0)},
        [Port("bearing", {"q": 1.0}, damping=BelievedValue(2.0, 1.0))],
        [Input("force", {"q": 1.0})],
    )
    record = Record("all", "train", time, {"q": q, "force": force}, noise={"q": 1e-6})
    finding = SimpleNamespace(
        mechanism=mechanism, records=[record], cutoff=3.0, data=SimpleNamespace(known=())
    )
    terms = other_tools.terms_of(finding, "train", ["a", "v"])
    assert terms.rows < 0.7 * len(time)
    values = np.linalg.lstsq(terms.columns, terms.force, rcond=None)[0]
    assert values == pytest.approx([2.0, 3.0], rel=0.02)
    assert terms.explained(values) > 0.99


def test_sparse_regression_finds_the_terms_of_a_cubic_spring(cubic):
    pytest.importorskip("pysindy")
    answer = other_tools.sparse_regression(cubic)
    assert answer.names == {"hardening_stiffness"}
    assert answer.of_force > 0.999
    assert "sin q" not in answer.words


def test_narmax_models_are_simulated_in_our_windows(cubic):
    pytest.importorskip("sysidentpy")
    answer = other_tools.narmax(cubic)
    assert answer.names is None
    assert answer.of_motion > 0.9


def test_mujoco_fits_a_joint_whose_torque_comes_late():
    if not mujoco_study.installed():
        pytest.skip("mujoco with its extra sysid is not installed")
    # The angle follows from the torque 20 ms before, by our own integrator.
    truth = {"armature": 0.5, "damping": 2.0, "frictionloss": 1.5, "delay": 0.02}
    step, late = 0.005, 4
    time = step * np.arange(1600)
    torque = 9.0 * np.sin(2.1 * time) + 6.0 * np.sin(5.3 * time + 1.0)
    acting = np.concatenate([np.full(late, torque[0]), torque[:-late]])

    def joint(inertia, damping):
        bearing = Port("bearing", {"q": 1.0}, damping=damping)
        return Mechanism({"q": inertia}, [bearing], [Input("torque", {"q": 1.0})], angles=["q"])

    true = joint(BelievedValue(0.5), BelievedValue(2.0))
    friction = LawAt("coulomb_friction", "bearing", CoulombFriction(1.5))
    still = Record("all", "train", time, {"q": 0.0 * time, "torque": acting})
    angle = simulate_mechanism(true, still, (friction,)).position["q"]
    records = [
        Record(role, role, time[rows], {"q": angle[rows], "torque": torque[rows]})
        for role, rows in (("train", slice(0, 1000)), ("held_out", slice(1000, None)))
    ]
    guess = joint(BelievedValue(0.7, 0.9), BelievedValue(1.4, 0.9))
    windows = (slice(100, 301), slice(300, 501))
    simulated = [
        SimpleNamespace(record="held_out", rows=windows, extent=SimpleNamespace(length=1.0))
    ]
    finding = SimpleNamespace(mechanism=guess, records=records, cutoff=20.0, simulated=simulated)
    study = mujoco_study.JointStudy(finding)
    values = study.fitted()
    assert values == pytest.approx(truth, rel=0.1)
    measured, predicted = study.held_out(values)
    assert len(measured) == 400
    assert np.std(measured - predicted) < 0.05 * np.std(measured)
