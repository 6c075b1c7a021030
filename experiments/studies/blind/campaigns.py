"""The campaign of a case and its twin, as the workflow reads them from a folder."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.studies.blind.cases import Case
from experiments.studies.blind.rig.campaign import Shown, made_visible, restricted, shown
from experiments.studies.blind.rig.files import write_campaign_folder
from experiments.studies.blind.rig.hidden import Drawn
from experiments.studies.blind.rig.machine import Matrix
from experiments.studies.blind.rig.nuisances import Nuisances, bench_with
from experiments.studies.blind.rig.sensors import Sensors
from experiments.studies.blind.rig.session import ARCSEC, SHEET, Circumstances, draw_circumstances
from pymoo_hdte.discrepancy import Campaign, read_campaign

IDEAL = Nuisances()
"""A bench without any nuisance."""


@dataclass(frozen=True, eq=False)
class Hiding:
    """The session of a case.

    Attributes
    ----------
    case : Case
    about : Circumstances
        Under the stress of the case.
    effects : tuple of Drawn
        At the sizes that are hidden.
    session, twin : Shown
        What sensors without noise show with the effects and without them, on the same bench.
    nuisances : Nuisances
        That the bench has.
    """

    case: Case
    about: Circumstances
    effects: tuple[Drawn, ...]
    session: Shown
    twin: Shown
    nuisances: Nuisances = IDEAL

    @property
    def quantities(self) -> Mapping[tuple[str, str], float]:
        """True values by name of the effect and of the unknown, SI."""
        return {
            (effect.name, name): value
            for effect in self.effects
            for name, value in effect.hidden.quantities.items()
        }


def hiding(case: Case, nuisances: Nuisances = IDEAL) -> Hiding:
    """Run the session of a case: each effect at a size at which it alone is visible.

    Sizes are those of the ideal bench, so that benches with and without nuisances hide the same. A
    shaft that twists is left out beside an effect that has a third body too.
    """
    about = draw_circumstances(case.generator("session"))
    about = stressed(about, case.stress, case.generator("stress"))
    twin = shown(about, ())
    rng, effects, session = case.generator("sizes"), [], twin
    for drawn in case.drawn:
        effect, session = made_visible(about, drawn, twin, rng)
        effects.append(effect)
    if len(effects) > 1:
        session = shown(about, effects)
    if any(effect.hidden.third is not None for effect in effects):
        nuisances = replace(nuisances, shaft_stiffness=0.0, shaft_damping=0.0)
    if nuisances.groups:
        about = bench_with(about, nuisances, lambda group: case.generator(f"nuisance {group}"))
        twin = shown(about, ())
        session = shown(about, effects) if effects else twin
    return Hiding(case, about, tuple(effects), session, twin, nuisances)


def rows_of(hidden: Hiding, session: Shown) -> tuple[list[Matrix], Matrix]:
    """Return rows (4, n) of the records and (2, k) of the sweep, with the noise of the case."""
    about, case = hidden.about, hidden.case
    sensors = true_noise(about.sensors, case.stress, case.generator("misstated"))
    rng = case.generator("noise")
    rows = [
        sensors.sampled(one, about.machine.ratio, condition.averaged, rng)
        for one, condition in zip(session.records, about.conditions, strict=True)
    ]
    noise = np.array([sensors.torsion_noise, sensors.output_noise])
    torsion = session.torsion + noise[:, None] * rng.standard_normal(session.torsion.shape)
    return with_faults(rows, case.stress, case.generator("faults")), torsion


def campaign_of(hidden: Hiding, session: Shown) -> Campaign:
    """Write the campaign of a session into a folder of its own, and read it."""
    rows, torsion = rows_of(hidden, session)
    with tempfile.TemporaryDirectory() as folder:
        title = f"blind case {hidden.case.kind} {hidden.case.number}"
        write_campaign_folder(Path(folder), title, hidden.about, rows, torsion)
        return read_campaign(folder)


NOISE_FACTORS = (0.5, 1.5, 2.0, 3.0)
"""True noise of all sensors over what is stated."""
ONE_LOAD = 20.0
"""N.m."""
FEWEST_FIT, FEWEST_KEPT_OUT = 7, 3
"""Records that are left of thirteen to fit and six kept out."""
FAR_OFF = (0.15, 0.35)
"""Range of the relative error of base parameters, whose tolerance is 10 %."""
AMPLITUDE_OFF = (0.45, 0.7)
"""Range of that of one or two amplitudes of the static error, whose tolerance is 30 %."""
PARAMETERS = (
    "stiffness",
    "damping",
    "input_inertia",
    "input_damping",
    "output_damping",
    "load_inertia",
)


def stressed(about: Circumstances, stress: str, rng: np.random.Generator) -> Circumstances:
    """Return a session under a stress; noise and faulty rows come with the sensors later."""
    machine = about.machine
    if stress == "parameters":
        signs = rng.choice([-1.0, 1.0], len(PARAMETERS))
        off = 1.0 + signs * rng.uniform(*FAR_OFF, len(PARAMETERS))
        values: dict[str, Any] = {
            n: float(k * getattr(SHEET, n)) for n, k in zip(PARAMETERS, off, strict=True)
        }
        return replace(about, machine=replace(machine, **values))
    if stress == "amplitudes":
        amplitudes = np.array(machine.amplitudes)
        for line in rng.permutation(len(amplitudes))[: rng.integers(1, 3)]:
            off = rng.choice([-1.0, 1.0]) * rng.uniform(*AMPLITUDE_OFF)
            amplitudes[line] = SHEET.amplitudes[line] * (1.0 + off)
        return replace(about, machine=replace(machine, amplitudes=tuple(amplitudes.tolist())))
    if stress == "one_load":
        conditions = tuple(replace(condition, load=ONE_LOAD) for condition in about.conditions)
        loads = np.where(
            np.array([condition.load for condition in about.conditions]) == 0.0,
            ONE_LOAD,
            ONE_LOAD + about.loads - np.array([condition.load for condition in about.conditions]),
        )
        return replace(about, conditions=conditions, loads=loads)
    if stress == "half":
        kept: list[int] = []
        for role, count in (("train", FEWEST_FIT), ("held_out", FEWEST_KEPT_OUT)):
            places = [k for k, condition in enumerate(about.conditions) if condition.role == role]
            kept += rng.choice(places, count, replace=False).tolist()
        return restricted(about, sorted(kept))
    return about


def true_noise(sensors: Sensors, stress: str, rng: np.random.Generator) -> Sensors:
    """Return sensors with the noise that they have, whatever is stated."""
    if stress != "noise":
        return sensors
    factor = float(rng.choice(NOISE_FACTORS))
    return replace(
        sensors,
        angle_noise=factor * sensors.angle_noise,
        torsion_noise=factor * sensors.torsion_noise,
        input_noise=factor * sensors.input_noise,
        output_noise=factor * sensors.output_noise,
    )


def with_faults(rows: list[Matrix], stress: str, rng: np.random.Generator) -> list[Matrix]:
    """Return rows (4, n) of records, of which up to four have spikes and one perhaps a jump.

    Spikes are in 0.1 to 0.5 % of the rows of one channel: 20 to 200 arcsec of the output angle, or
    30 to 300 times the noise of a torque. A jump of the output encoder is 20 to 100 arcsec.
    """
    if stress != "outliers":
        return rows
    rows = [row.copy() for row in rows]
    places = rng.permutation(len(rows))[: rng.integers(1, 5)]
    for place in places:
        row = rows[place]
        channel = int(rng.integers(1, 4))
        unit = (0.0, ARCSEC, SHEET.input_noise, SHEET.output_noise)
        low, high = (20.0, 200.0) if channel == 1 else (30.0, 300.0)
        count = max(1, round(rng.uniform(0.001, 0.005) * row.shape[1]))
        at = rng.choice(row.shape[1], count, replace=False)
        sizes = rng.uniform(low, high, count) * rng.choice([-1.0, 1.0], count)
        row[channel, at] += sizes * unit[channel]
    if rng.random() < 1.0 / 3.0:
        row = rows[places[0]]
        begin = int(row.shape[1] * rng.uniform(0.2, 0.8))
        row[1, begin:] += rng.uniform(20.0, 100.0) * rng.choice([-1.0, 1.0]) * ARCSEC
    return rows
