"""Sentences of a report's first screen: on validation and what is good enough."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_verdicts import made_verdict

from pymoo_hdte.discrepancy._answers.where.relevance import Relevance, largest_change, relevance
from pymoo_hdte.discrepancy._report.document import sentence
from pymoo_hdte.discrepancy._report.optimum import Choice
from pymoo_hdte.discrepancy._report.tables import EffectRow, effect_rows, hypothesis_rows
from pymoo_hdte.discrepancy._report.write import validation_sentence
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.prediction_error import PredictionError
from pymoo_hdte.discrepancy._verdicts.validation_drive import Validation
from pymoo_hdte.units import ARCSEC

NAMED = SimpleNamespace(
    verdict=SimpleNamespace(accepted=SimpleNamespace(candidates=("something",)))
)
NOTHING = SimpleNamespace(verdict=SimpleNamespace(accepted=SimpleNamespace(candidates=())))
ERRORS = {
    "transmission_error": PredictionError(8.2, 0.43, 0.42, "arcsec"),
    "input_torque": PredictionError(0.21, 0.2, 0.2, "mN.m"),
    "output_torque": PredictionError(19.4, 17.3, 19.8, "mN.m"),
}


def validation(overall=(4.7, 1.02), records=(1.0, 1.0), **after):
    """Return errors on held-out records, with those of channels ``after`` and of two records."""
    channels = {
        name: replace(error, after=after.get(name, error.after)) for name, error in ERRORS.items()
    }
    return Validation(
        records=("run_a", "run_b"),
        channels=channels,
        overall=PredictionError(*overall, 1.0, "standard deviations of the noise"),
        by_record=tuple(PredictionError(1.0, one, 0.4, "arcsec") for one in records),
        orders=np.zeros(1),
        by_order=(),
        dte=np.zeros((3, 2)),
        metrics=None,
        leading="transmission_error",
        worst="run_a",
        overlays=(),
    )


def test_an_error_that_shrinks_everywhere_is_not_called_worse():
    said = validation_sentence(NAMED, validation())
    assert "8.2 arcsec before, 0.43 after" in said
    assert "the correction removes" in said
    assert "orse" not in said
    assert validation().worse == ()


@pytest.mark.parametrize(
    ("changes", "words", "names"),
    [
        ({"overall": (4.7, 4.9)}, "Worse than before: all channels together", ("overall",)),
        ({"output_torque": 23.0}, "Worse than before: output torque 19.4 before, 23 after",
         ("output_torque",)),
        ({"input_torque": 0.23}, "Worse than before: input torque 0.21 before, 0.23 after",
         ("input_torque",)),
        ({"records": (0.5, 1.1)}, "Worse than before: transmission error of run_b.", ("run_b",)),
    ],
)  # fmt: skip
def test_what_gets_worse_is_said(changes, words, names):
    assert words not in validation_sentence(NAMED, validation())
    found = validation(**changes)
    assert words in validation_sentence(NAMED, found)
    assert found.worse == names


def test_an_error_of_thousands_has_no_exponent():
    """It was off by 4.46e+03 mN.m."""
    large = validation()
    large.channels["transmission_error"] = PredictionError(4460.0, 1230.0, 0.42, "arcsec")
    assert "4460 arcsec before, 1230 after" in validation_sentence(NAMED, large)


@pytest.mark.parametrize(
    ("reached", "stays"),
    [((46.8, 5.04), True), ((46.6, 5.04), True), ((46.2, 5.04), False), ((46.8, 4.9), False)],
)
def test_the_old_design_stays_where_the_new_optimum_is_better_in_nothing(reached, stays):
    """A new optimum of 46.8 and 5.04 was praised beside an old design of 46.6 and 5.04."""
    delivered, factors = np.array([46.6, 5.04]), np.ones(4)
    none = np.zeros(4, dtype=bool)
    choice = Choice(
        "balanced", factors, factors, none, none, 0.0, delivered, delivered, np.array(reached)
    )
    assert choice.stays == stays


def test_an_error_within_the_noise_is_not_called_worse():
    assert validation(output_torque=21.0, input_torque=0.21).worse == ()


def test_without_an_effect_or_a_record_nothing_is_claimed():
    assert validation_sentence(NOTHING, validation()).startswith("Nothing was added.")
    assert validation_sentence(NAMED, None).startswith("No record was held out")


@given(st.floats(0.0, 1e3), st.floats(0.0, 1e3), st.floats(1e-3, 1e3))
def test_worse_is_larger_by_more_than_the_rule_says(before, after, floor):
    error = PredictionError(before, after, floor, "arcsec", RULES)
    assert error.worse == (after - before > 0.05 * floor and after > 1.1 * floor)
    assert not (error.worse and error.shrinkage is not None and error.shrinkage > 0.0)


def matters(error=0.2, torque=0.01, enough=(1.0, 0.05), whole=True):
    """Return the relevance of changes in arcsec and N.m against what is good enough."""
    limit = None if enough[0] is None else enough[0] * ARCSEC
    return Relevance(error * ARCSEC, torque, limit, enough[1], whole)


def test_an_effect_below_what_is_good_enough_is_real_and_irrelevant():
    said = matters().sentence
    assert said.startswith("Real and irrelevant at the stated size")
    assert "transmission error by at most 0.2 arcsec (1 arcsec is good enough)" in said
    assert "torques by at most 0.01 N.m (0.05 N.m is good enough)" in said
    assert "not counted" not in said
    assert "residual is not counted" in matters(whole=False).sentence


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"error": 2.0}, "transmission error by up to 2 arcsec (1 arcsec is good enough)"),
        ({"torque": 0.1}, "torques by up to 0.1 N.m (0.05 N.m is good enough)"),
    ],
)
def test_an_effect_above_it_is_not(changes, words):
    found = matters(**changes)
    assert not found.irrelevant
    assert "irrelevant" not in found.sentence
    assert found.sentence == f"It changes {'' if 'torques' in words else 'the '}{words}."


def test_only_what_the_campaign_states_is_compared():
    found = matters(torque=5.0, enough=(1.0, None))
    assert found.irrelevant
    assert "torque" not in found.sentence
    assert matters(error=50.0, enough=(None, 0.05)).irrelevant
    assert not matters(enough=(None, None)).irrelevant


@given(*[st.floats(1e-3, 1e3)] * 4)
def test_irrelevant_is_below_both(error, torque, most_error, most_torque):
    found = matters(error, torque, (most_error, most_torque))
    below = error * ARCSEC < most_error * ARCSEC and torque < most_torque
    assert found.irrelevant == below
    assert ("irrelevant" in found.sentence) == below
    assert found.as_dict()["irrelevant"] == below


def finding(enough, status="named", more=False):
    return SimpleNamespace(
        campaign=SimpleNamespace(good_enough_error=enough[0], good_enough_torque=enough[1]),
        verdict=SimpleNamespace(status=status, leaves_more_than_noise=more),
    )


def changed(named=True):
    """A change of mean and two lines in the second of two records."""
    change = np.zeros((2, 4, 3), dtype=complex)
    change[1, 0] = 1.0, 2.0j, -3.0
    change[1, 1] = 0.1, 0.0, 0.0
    change[0, 2] = np.nan, 0.2, 0.0
    change[0, 3] = np.nan, 50.0, 0.0
    return SimpleNamespace(change=change, named=named)


def test_the_largest_change_is_that_of_mean_and_lines_together():
    assert largest_change(changed()).tolist() == pytest.approx([6.0, 0.1, 0.2, 50.0])
    found = relevance(finding((7.0, 0.3)), changed())
    assert (found.error, found.torque) == pytest.approx((6.0, 0.2))
    assert found.irrelevant
    assert found.whole


@given(st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5))
def test_no_signal_exceeds_the_largest_change(parts):
    change = np.zeros((1, 4, 3), dtype=complex)
    change[0, 0] = parts[0], complex(*parts[1:3]), complex(*parts[3:5])
    angle = np.linspace(0.0, 60.0, 2000)
    waves = change[0, 0, 1:, None] * np.exp(1j * np.outer([1.0, 2.02], angle))
    signal = parts[0] + waves.sum(axis=0).real
    found = largest_change(SimpleNamespace(change=change))
    assert np.abs(signal).max() <= found[0] * (1.0 + 1e-9) + 1e-12


def test_nothing_named_or_nothing_stated_is_not_compared():
    assert relevance(finding((7.0, 0.3)), changed(named=False)) is None
    assert relevance(finding((None, None)), changed()) is None


@pytest.mark.parametrize(("status", "more"), [("partial", False), ("named", True)])
def test_what_is_left_is_not_counted_as_irrelevant(status, more):
    assert not relevance(finding((7.0, 0.3), status, more), changed()).whole


def test_a_believed_value_is_told_without_the_name_of_an_effect():
    value = {"value": 1.1, "interval95": [1.0, 1.2], "unit": "N.m"}
    (believed,), (effect,) = (
        effect_rows([{"name": name, "port": port, "order": None, "parameters": {number: value}}])
        for name, port, number in (
            ("parameter", "input_inertia", "input_inertia"),
            ("coulomb_friction", "input", "level"),
        )
    )
    assert (believed.effect, believed.parameter) == ("", "input inertia")
    assert (effect.effect, effect.parameter) == ("coulomb friction (input)", "level")


def test_a_line_of_the_error_is_told_by_its_order():
    """Of orders 1, 2 and 2.02 the second was called amplitude 1."""
    value = {"value": 1e-5, "interval95": [9e-6, 1.1e-5], "unit": "rad"}
    numbers = {"error_amplitude_1": value}
    effect = {"name": "parameter", "port": "mesh", "order": None, "parameters": numbers}
    (row,) = effect_rows([effect], (1.0, 2.0, 2.02))
    assert row.parameter == "error amplitude of order 2"


@pytest.mark.parametrize(("share", "told"), [(0.0, False), (0.6, True)])
def test_an_effect_that_explains_less_than_half_is_not_called_near(share, told):
    """A frequency that is fixed was said to be nearest to a friction that explained 0 %."""
    chosen = SimpleNamespace(
        candidates=(SimpleNamespace(sentence="Dry friction.", released=""),),
        listed=True,
        explained=share,
        label="coulomb_friction:input",
    )
    verdict = made_verdict("unlisted", None, chosen)
    assert ("coulomb friction" in sentence(verdict)) == told


@pytest.mark.parametrize(
    ("sets", "words"),
    [
        (
            (("soft_windup", "stiffness"), ("backlash", "stiffness"), ("play", "stiffness")),
            "distinguish soft windup (mesh) from backlash (mesh) or from play (mesh).",
        ),
        # A set may have one effect twice.
        (
            (("soft_windup", "soft_windup", "stiffness"), ("soft_windup", "play", "stiffness")),
            "distinguish soft windup (mesh) from play (mesh).",
        ),
        # Where nothing is shared all is said.
        (
            (("soft_windup",), ("backlash", "stiffness")),
            "from backlash (mesh) and stiffness (out of tolerance).",
        ),
        # What is a part of the first alone is in the class for its caveats.
        ((("play", "windup"), ("windup",)), "from windup (mesh) alone, with caveats."),
    ],
)
def test_what_all_members_of_a_class_share_is_said_once(sets, words):
    """Three values out of tolerance beside three laws were told three times on the first screen."""

    def one(name):
        label = f"parameter:{name}" if name == "stiffness" else f"{name}:mesh"
        return SimpleNamespace(label=label, sentence=f"The {name} is off.", released="")

    def together(names):
        candidates = [one(name) for name in names]
        label = "+".join(each.label for each in candidates)
        return SimpleNamespace(candidates=candidates, label=label, listed=True)

    first, *others = map(together, sets)
    verdict = SimpleNamespace(status="class", chosen=first, equivalent=others, reasons=())
    assert sentence(verdict).endswith(words)


@pytest.mark.parametrize(
    ("parameter", "lower", "told"),
    [
        ("amplitude", -1.0, True),
        ("second amplitude", -1.0, False),
        ("second amplitude", 1.0, True),
        ("third phase", 1.0, False),
    ],
)
def test_a_harmonic_that_may_be_nothing_is_not_on_the_first_screen(parameter, lower, told):
    assert EffectRow("ripple", parameter, 2.0, lower, 3.0, "N.m").is_headline == told


@pytest.mark.parametrize("of_class", [True, False])
def test_what_is_less_likely_at_another_order_was_not_rejected(of_class):
    """Of the chosen effect, or of a member of its class, which has each set of names once."""

    def fitted(name, order):
        names = frozenset({(name, "mesh")})
        line = SimpleNamespace(name="error_amplitude_1")
        fit = SimpleNamespace(chi_square=1.0, parameters=[line], bound_sides=[1.0], n_base=1)
        label = f"{name}:mesh@{order}"
        return SimpleNamespace(
            names=names, label=label, fit=fit, explained=1.0, bic=0.0, listed=True
        )

    chosen, member = fitted("mesh_stiffness_variation", 1), fitted("clearance_variation", 2)
    twin = fitted("clearance_variation" if of_class else "mesh_stiffness_variation", 3)
    other = fitted("load_shaft", 3)
    verdict = made_verdict("class", None, chosen, (member, twin, other), (member,))
    rows = hypothesis_rows(verdict, (1.0, 2.0))
    roles = ["chosen", "indistinguishable", "less likely form", "rejected"]
    assert [row.role for row in rows] == roles
    assert rows[0].at_bounds == "error amplitude of order 2"
