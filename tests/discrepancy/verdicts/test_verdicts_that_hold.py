"""Campaigns on which the verdict was once wrong, with what they hide: each has to end right.

For each mend one nightly test takes it out and sees a row go wrong.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest
import verdict_cases as mends
from verdict_cases import case_campaign

from pymoo_hdte.discrepancy import analyse
from pymoo_hdte.effects import effect as effects
from pymoo_hdte.units import ARCSEC

DEVIATIONS = 3.0
"""Standard deviations: of some twenty values one lies outside its 95 % interval by chance."""
COULOMB, DRAG = "coulomb_friction:input", "nonlinear_drag:input"
LINE, ECCENTRICITY = "kinematic_error:mesh@4", "eccentricity:sensor@0.009901"
INERTIA = "load_inertia:output"
WAVES = "mesh_stiffness_variation:mesh@2"
GROWING, IN_NO_LIST = "load_dependent_error:mesh@1", ", in no list"
CUBIC, SOFT = "hardening_stiffness:mesh", "soft_windup:mesh"
OFF = ("stiffness", "input_inertia", "input_damping")


@dataclass(frozen=True)
class Row:
    """What must be said of a campaign.

    Attributes
    ----------
    status : str
    labels : tuple of str
        What is named.
    values : mapping
        True value by label and unknown; of two unknowns that are parts of a line, its amplitude.
    rivals : tuple of str
        What must be offered beside it.
    faults : tuple of str
        Kinds of faulty rows that are hidden; the noise is as stated unless it is among them.
    """

    status: str
    labels: tuple[str, ...] = ()
    values: Mapping[tuple[str, str], float] = field(default_factory=dict)
    rivals: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()


ROWS = {
    "coulomb": Row("named", (COULOMB,), {(COULOMB, "level"): 0.0710}),
    "load-dependent-order": Row("named", (GROWING,)),
    # The same with a library that lacks it.
    f"load-dependent-order{IN_NO_LIST}": Row("unlisted"),
    "nothing-encoder-jump": Row("adequate", faults=("jump",)),
    "nothing-encoder-spikes": Row("adequate", faults=("spike",) * 3),
    "coulomb-gap": Row("named", (COULOMB,), {(COULOMB, "level"): 0.0511}, faults=("gap",)),
    # The misfit hid in the zero of a sensor, at ten times what is stated of it.
    "coulomb-gap-2": Row("named", (COULOMB,), {(COULOMB, "level"): 0.0332}, faults=("gap",)),
    "coulomb-noise-x3": Row("named", (COULOMB,), faults=("noise",)),
    "coulomb-one-load": Row(
        "class", (COULOMB,), {(COULOMB, "level"): 0.0526}, ("coulomb_friction:output",)
    ),
    "cubic-drag": Row("named", (DRAG,), {(DRAG, "level"): 0.01725, (DRAG, "exponent"): 3.0}),
    "drag-coulomb": Row(
        "named",
        (COULOMB, DRAG),
        {(COULOMB, "level"): 0.0627, (DRAG, "level"): 0.0251, (DRAG, "exponent"): 3.0},
    ),
    "hardening-soft-windup": Row("named", (CUBIC, SOFT), {(SOFT, "softening"): 0.30}),
    "kinematic-eccentricity": Row(
        "named",
        (ECCENTRICITY, LINE),
        {(LINE, "amplitude"): 1.52 * ARCSEC, (ECCENTRICITY, "amplitude"): 8.47 * ARCSEC},
    ),
    "load-inertia-servo": Row("named", (INERTIA,)),
    # A zero and a clearance that made the held-out records worse.
    f"order-grows-with-load-a{IN_NO_LIST}": Row("unlisted"),
    f"order-grows-with-load-b{IN_NO_LIST}": Row("unlisted"),
    "order-grows-with-load-a": Row("named", (GROWING,)),
    "order-grows-with-load-b": Row("named", (GROWING,)),
    "load-dependent-friction": Row(
        "named",
        ("load_dependent_friction:input",),
        {("load_dependent_friction:input", "share"): 0.139},
    ),
    # The value of the load's inertia and the effect of its name are one answer.
    "nothing-all-values-off": Row("parameter", (INERTIA, *(f"parameter:{name}" for name in OFF))),
    "stiffness-off": Row("parameter", ("parameter:stiffness",)),
    # The output torque alone seems to grow, by 2.1 deviations of its noise.
    "rig-05": Row("named", ("soft_windup:mesh",)),
    "rig-11": Row("named", (COULOMB, WAVES), {(COULOMB, "level"): 0.0599}),
    "amplitude-off": Row("parameter", ("parameter:error_amplitude_1",)),
}
ROUNDED = 0.005 * ARCSEC
"""The truth of lines is told to this."""


def said(analysis):
    """Return status, labels and rivals of a verdict, in each order that is not told from it."""
    verdict = analysis.verdict
    accepted = () if verdict.accepted is verdict.base else verdict.accepted.candidates
    labels = {one.label for one in accepted}
    rivals = {one.label for other in near(verdict) for one in other.candidates}
    return verdict.status, labels, rivals


def near(verdict):
    """Return the sets that the report calls alike."""
    return [one for one in verdict.alternatives if one in verdict.equivalent]


def member_with(verdict, label):
    """Return the accepted fit, or that of a set that is alike, which has an effect."""
    fits = [verdict.accepted, *(one.fit for one in near(verdict))]
    return next(one for one in fits if label in [each.label for each in one.candidates])


def fitted_value(fitted, label, unknown):
    """Return an unknown of an effect, or the amplitude of its line, with its deviation."""
    ((first, names),) = [
        (place.start, [parameter.name for parameter in candidate.parameters])
        for candidate, place in fitted.places
        if candidate.label == label
    ]
    if unknown in names:
        place = first + names.index(unknown)
        return fitted.values[place], np.sqrt(fitted.covariance[place, place])
    pair = [first + names.index(f"{unknown}_{part}") for part in ("cosine", "sine")]
    size = np.hypot(*fitted.values[pair])
    direction = fitted.values[pair] / size
    return size, np.sqrt(direction @ fitted.covariance[np.ix_(pair, pair)] @ direction)


def base_value(analysis, name):
    """Return a fitted base parameter relative to what is believed, with its deviation."""
    fitted = analysis.verdict.accepted
    place = [parameter.name for parameter in fitted.parameters].index(name)
    believed = analysis.finding.data.base[place].start
    return fitted.values[place] / believed, np.sqrt(fitted.covariance[place, place]) / believed


WRONG = {
    "hardening-soft-windup": "stiffness that rises at a corner is the likelier form",
    f"load-dependent-order{IN_NO_LIST}": "a clearance that varies is plainly named for it",
    f"order-grows-with-load-a{IN_NO_LIST}": "a clearance that varies is named beside others",
}
"""Rows that are wrong today, and what is said there."""


@pytest.mark.nightly
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xfail(strict=True, reason=WRONG[name]))
        if name in WRONG
        else name
        for name in ROWS
    ],
)
def test_the_verdict_is_right(name, monkeypatch):
    check(name, analyse(campaign_of(name, monkeypatch)))


def campaign_of(name, monkeypatch):
    """Return the campaign of a row; of some rows the library does not hold what is hidden."""
    if name.endswith(IN_NO_LIST):
        for effect in ("load_dependent_error", "load_dependent_damping"):
            monkeypatch.delitem(effects._EFFECTS, effect)
    return case_campaign(name.removesuffix(IN_NO_LIST))


def check(name, analysis):
    """Hold a verdict against its row."""
    row, verdict = ROWS[name], analysis.verdict
    status, labels, rivals = said(analysis)
    assert status == row.status
    if row.rivals:
        # Sets that explain the same to the last digits: which of them comes first says nothing.
        assert {*row.labels, *row.rivals} <= labels | rivals
    else:
        assert labels == set(row.labels)
    for (label, unknown), truth in row.values.items():
        value, deviation = fitted_value(member_with(verdict, label), label, unknown)
        rounded = ROUNDED if unknown == "amplitude" else 0.0
        assert abs(value - truth) < DEVIATIONS * deviation + rounded, (label, unknown)
    rows = analysis.finding.rows
    found = [one.kind for one in rows.faults] + ["noise"] * any(one.replaced for one in rows.noise)
    assert found == list(row.faults)
    if name in ALSO:
        ALSO[name](analysis)


def also_of_noise(analysis):
    # The sensors' noise is three times the stated one.
    sensors = [one for one in analysis.finding.rows.noise if one.replaced]
    for one in sensors:
        assert one.used == pytest.approx(3.0 * one.stated, rel=0.15), one.name


def whole_load_inertia(analysis):
    """Return the load's inertia, with what an effect adds, as of `base_value`."""
    fitted = analysis.verdict.accepted
    names = [parameter.name for parameter in fitted.parameters]
    (first,) = (place.start for effect, place in fitted.places if effect.label == INERTIA)
    parts = [names.index("load_inertia"), first]
    believed = analysis.finding.data.base[parts[0]].start
    variance = fitted.covariance[np.ix_(parts, parts)].sum()
    return fitted.values[parts].sum() / believed, np.sqrt(variance) / believed


def also_of_all_values_off(analysis):
    pairs = {name: base_value(analysis, name) for name in OFF}
    for name, (value, deviation) in (pairs | {INERTIA: whole_load_inertia(analysis)}).items():
        assert 0.1 < abs(value - 1.0) < 0.25 + DEVIATIONS * deviation, name


def also_of_stiffness(analysis):
    value, deviation = base_value(analysis, "stiffness")
    assert value == pytest.approx(1.25, abs=DEVIATIONS * deviation)
    found = analysis.locate()
    assert found.flagged[:, 0, 0].any()
    assert "transmission error" not in found.trusted
    assert "wherever it was measured" not in found.trusted


def also_of_hardening(analysis):
    # 18.5 % of the stiffness at 40 N.m; of which stiffness, 5 % apart here, is not told.
    value, _ = fitted_value(analysis.verdict.accepted, CUBIC, "coefficient")
    stiffness = analysis.campaign.believed.stiffness
    assert value * (40.0 / stiffness) ** 2 / stiffness == pytest.approx(0.185, rel=0.1)


def also_of_rig_11(analysis):
    # The minimum: noise of 1431 degrees of freedom, beats of orders 2 and 2.02 left none.
    assert analysis.verdict.accepted.chi_square == pytest.approx(1412.1, abs=0.1)


def also_of_the_amplitude(analysis):
    value, deviation = base_value(analysis, "error_amplitude_1")
    assert value == pytest.approx(1.6, abs=DEVIATIONS * deviation)
    (candidate,) = analysis.verdict.accepted.candidates
    assert "amplitude of order 2 of the static error" in candidate.sentence


ALSO: dict[str, Callable] = {
    "coulomb-noise-x3": also_of_noise,
    "nothing-all-values-off": also_of_all_values_off,
    "stiffness-off": also_of_stiffness,
    "hardening-soft-windup": also_of_hardening,
    "rig-11": also_of_rig_11,
    "amplitude-off": also_of_the_amplitude,
}


CONVERGES_ANYHOW = pytest.mark.xfail(
    strict=True, reason="likely sets are fitted so often that single steps end at the minimum"
)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "mend"),
    [
        pytest.param("coulomb-one-load", mends.one_step, marks=CONVERGES_ANYHOW),
        ("coulomb-gap", mends.rows_are_believed),
        ("coulomb-noise-x3", mends.rows_are_believed),
        ("nothing-encoder-spikes", mends.rows_are_believed),
        ("nothing-encoder-jump", mends.rows_are_believed),
        ("cubic-drag", mends.quadratic_drag_only),
        ("drag-coulomb", mends.one_effect_at_a_port),
        ("hardening-soft-windup", mends.one_effect_at_a_port),
        ("load-dependent-friction", mends.no_friction_that_grows_with_load),
        ("stiffness-off", mends.freed_values_are_believed),
        ("amplitude-off", mends.amplitudes_are_never_wrong),
        pytest.param("rig-11", mends.one_step, marks=CONVERGES_ANYHOW),
    ],
    ids=lambda one: one if isinstance(one, str) else one.__name__,
)
def test_without_its_mend_the_verdict_is_wrong(name, mend, monkeypatch):
    campaign = campaign_of(name, monkeypatch)
    mend(monkeypatch)
    with pytest.raises(AssertionError) as wrong:
        check(name, analyse(campaign))
    print(wrong.value)
