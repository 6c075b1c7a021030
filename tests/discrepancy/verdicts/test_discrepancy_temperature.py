"""Friction that falls as the drive warms up: named where records have temperatures that show it."""

from dataclasses import replace

import numpy as np
import pytest
from kept_results import kept
from quick_campaigns import CONDITIONS
from small_campaigns import small_campaign
from virtual_rig_cases import BELIEVED, RIG

from experiments.studies.virtual_rig.rig import draw_rig, run_campaign
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import analyse, read_campaign, write_campaign
from pymoo_hdte.discrepancy._evidence.order_lines.candidates import drive_candidates
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import training_data
from pymoo_hdte.discrepancy._evidence.order_lines.features import measure
from pymoo_hdte.discrepancy._evidence.order_lines.sizes import port_sizes, scales_of
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._selection.rules import RULES
from pymoo_hdte.discrepancy._verdicts.drive import expected_orders
from pymoo_hdte.drive import LawAtPort
from pymoo_hdte.effects.law import PortState
from pymoo_hdte.effects.temperature_friction import TemperatureFriction

NAME, RATE, MIDDLE = "temperature_dependent_friction", 0.03, 303.0


@kept
def warm_campaign():
    """Return a session whose bearings lose 3 % of their viscous friction per kelvin.

    The virtual rig integrates its own equations with another input damping in every record.
    """
    rig = draw_rig(BELIEVED, (), np.random.default_rng(5))
    temperatures = np.random.default_rng(1).uniform(-7.5, 7.5, len(CONDITIONS)) + MIDDLE
    parts = []
    for condition, temperature in zip(CONDITIONS, temperatures, strict=True):
        damping = rig.drive.input_damping * np.exp(-RATE * (temperature - MIDDLE))
        warm = replace(rig, drive=replace(rig.drive, input_damping=float(damping)))
        # One seed, as all records of a session share the errors of the torque sensors.
        noise = np.random.default_rng([5, 1])
        parts.append(run_campaign(warm, BELIEVED, RIG, noise, (condition,)))
    running = tuple(
        replace(part.running[0], elapsed=100.0 * place, temperature=float(temperature))
        for place, (part, temperature) in enumerate(zip(parts, temperatures, strict=True))
    )
    return replace(parts[0], running=running)


def base_of(campaign):
    data = training_data(campaign, measure(campaign, campaign.train, expected_orders(campaign)))
    return data, fit(data)


def sought(campaign):
    """Return the labels of the candidates of a campaign."""
    data, base = base_of(campaign)
    orders = data.features.orders.tolist()
    sizes = port_sizes(campaign.believed, orders, [], scales_of(data, base))
    return [one.label for one in drive_candidates(sizes)]


@pytest.mark.nightly
def test_it_is_named_with_its_rate():
    verdict = analyse(warm_campaign()).verdict
    assert (verdict.status, verdict.chosen.label) == ("named", f"{NAME}:input")
    (standing,) = verdict.accepted.effects
    # The rate is that of the believed damping, which is off by up to a tenth.
    assert standing.law.rate == pytest.approx(RATE, rel=0.15)
    assert verdict.accepted.chi_square < 1.15 * verdict.degrees_of_freedom < verdict.base.chi_square


@pytest.mark.nightly
def test_a_drive_that_is_believed_to_have_it_misses_it_no_more():
    campaign = warm_campaign()
    law = TemperatureFriction(BELIEVED.input_damping, RATE, MIDDLE)
    friction = LawAtPort(NAME, "input", law)
    holding = replace(campaign, believed=replace(campaign.believed, effects=(friction,)))
    before, after = (base_of(one)[1].chi_square for one in (campaign, holding))
    assert after < 0.2 * before
    # Where no record has a temperature, it is the reference, and the effect is none.
    cold = [
        replace(one, running=tuple(replace(each, temperature=None) for each in one.running))
        for one in (campaign, holding)
    ]
    assert base_of(cold[0])[1].chi_square == pytest.approx(base_of(cold[1])[1].chi_square)


@pytest.mark.slow
def test_it_is_sought_only_where_all_records_have_temperatures_that_spread():
    campaign = warm_campaign()
    label = f"{NAME}:input"
    assert label in sought(campaign)
    first, *others = campaign.running
    unknown = replace(first, temperature=None)
    assert label not in sought(replace(campaign, running=(unknown, *others)))
    spread = RULES.least_temperature_spread
    for share, there in ((0.99, False), (1.01, True)):
        ends = np.linspace(MIDDLE, MIDDLE + share * spread, len(campaign.train))
        temperatures = dict(zip([one.name for one in campaign.train], ends, strict=True))
        running = tuple(
            replace(one, temperature=float(temperatures.get(one.name, MIDDLE + 50.0)))
            for one in campaign.running
        )
        assert (label in sought(replace(campaign, running=running))) == there


def test_the_law_is_the_change_from_the_reference():
    speed, temperature = np.array([[3.0, -2.0]]), np.array([[300.0], [310.0], [np.nan]])
    law = TemperatureFriction(2.0, 0.05, 300.0)
    state = PortState(speed, speed, lambda order: speed, np.ones(1), temperature=temperature)
    response = law.respond(state)
    expected = np.array([[0.0], [np.exp(-0.5) - 1.0], [0.0]]) * 2.0
    assert response.torque == pytest.approx(expected * speed)
    assert response.damping == pytest.approx(expected)
    assert not law.respond(PortState(speed, speed, lambda order: speed, np.ones(1))).torque.any()
    with pytest.raises(InvalidInput, match="reference is 0"):
        TemperatureFriction(2.0, 0.05, 0.0)


# --- in files -----------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    campaign = small_campaign()
    first, *others = campaign.running
    write_campaign(
        replace(campaign, running=(replace(first, temperature=295.65), *others)), tmp_path / "rig"
    )
    return tmp_path / "rig"


def test_a_record_has_it_in_degrees_celsius(folder):
    assert "temperature_C = 22.5\n" in (folder / "campaign.toml").read_text()
    first, second, _ = read_campaign(folder).running
    assert first.temperature == pytest.approx(295.65)
    assert second.temperature is None


COLUMN = """[table]
channels.temperature = {{ column = "output_torque_Nm", unit = "{unit}" }}

[rig]"""


def test_a_column_counts_by_its_mean(folder):
    """The load of 20 N.m stands in for a temperature here, which in kelvin would be no drive's."""
    file = folder / "campaign.toml"
    text = file.read_text().replace("temperature_C = 22.5\n", "")
    file.write_text(text.replace("[rig]", COLUMN.format(unit="C")))
    for record in read_campaign(folder).running:
        assert record.temperature == pytest.approx(273.15 + np.mean(record.output_torque))
    file.write_text(text.replace("[rig]", COLUMN.format(unit="K")))
    with pytest.raises(InvalidInput, match=r"temperature is '\d+\.?\d* K'"):
        read_campaign(folder)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[rig]", COLUMN.format(unit="C"), r"temperature_C is 22\.5, allowed: absent beside"),
        ("temperature_C = 22.5", "temperature_C = -300.0", r"temperature_C is -300"),
        ("temperature_C = 22.5", "temperature_F = 72.5", r"temperature_F"),
        ("[rig]", COLUMN.format(unit="F"), r"temperature\.unit is 'F'"),
    ],
)
def test_a_wrong_temperature_is_refused_by_its_field(old, new, words, folder):
    file = folder / "campaign.toml"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InvalidInput, match=words):
        read_campaign(folder)
