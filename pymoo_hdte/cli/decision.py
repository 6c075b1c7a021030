"""From a drive, and what was found missing in its model, to what to change and to measure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.drive import (
    ESTIMATES,
    CataloguePage,
    DriveEffect,
    DriveModel,
    Entry,
    complete,
    drive_of,
    efficiency,
    starting_torque,
)
from pymoo_hdte.drive.catalogue import sampled
from pymoo_hdte.drive.levers import LEVERS, SHARES, bending_stress, changed_drive
from pymoo_hdte.effects.effect import place_of

DRIVES = 16
"""Drives of a design, the same quasi-random ones for each (a Sobol' sequence): at size 20 what a
lever does to the goal is within 0.14 % of the goal of what it does with 256 drives."""
TOLERANCE = 0.05
"""Relative scatter of stiffness, inertia and damping from drive to drive: the bands in which the
paper judges robustness (Section 5.3)."""
DRAWS = 19
"""Sets of estimates, within their tolerances: a further one lies between the least and the largest
of n gains with probability (n - 1) / (n + 1), here 90 %."""
SPREAD = 3.0
"""Standard deviations in the goal: mean + 3 std, which few drives exceed."""
LITTLE = 1e-2
"""Share of the goal below which a lever has no influence, and a change no gain: seven times what is
uncertain with `DRIVES` drives."""


@dataclass(frozen=True)
class Limits:
    """What a changed drive may cost, relative to the unchanged one.

    Starting torque and efficiency may change by the tolerances with which makers print them
    (Schaeffler TPI 275: 25 %, 3 points). The stress is set by hand: a wall a step thicker.

    Attributes
    ----------
    starting_torque, stress : float
        Largest factor.
    efficiency : float
        Largest loss, in parts of 1.
    """

    starting_torque: float = 1.25
    stress: float = 1.1
    efficiency: float = 0.03


@dataclass(frozen=True)
class Cost:
    """What a design costs.

    Attributes
    ----------
    starting : float
        Torque, N.m.
    efficiency, stress : float
        Dimensionless.
    """

    starting: float
    efficiency: float
    stress: float


@dataclass(frozen=True)
class Outcome(Cost):
    """What a design of the drive does under its rated condition.

    Attributes
    ----------
    mean, std : float
        Of the DTE over drives, arcsec; NaN if one has no steady state.
    """

    mean: float
    std: float

    @property
    def goal(self) -> float:
        """Mean plus three standard deviations, arcsec."""
        return self.mean + SPREAD * self.std


@dataclass(frozen=True, eq=False)
class Decision:
    """What to change in a drive, what it would bring, and what to measure to be sure.

    Attributes
    ----------
    page : CataloguePage
    figures : dict of Entry
    found : tuple of DriveEffect
        Effects that a verdict adds to the page.
    drives : (DriveModel, DriveModel)
        Before and after the change, with what was found.
    before, after : Outcome
    effects : dict of (dict of Outcome)
        By lever and setting, the other levers unchanged.
    settings : dict of float
        The chosen ones that differ from the unchanged drive.
    idle : tuple of str
        Levers without influence.
    gain : (float, float)
        Where 90 % of the reductions of the nominal drive's DTE lie, as estimates vary, arcsec.
    gain_changes : dict of float
        By name of an estimate, how far the gain changes over its tolerance, arcsec, largest first.
    """

    page: CataloguePage
    figures: dict[str, Entry]
    found: tuple[DriveEffect, ...]
    drives: tuple[DriveModel, DriveModel]
    before: Outcome
    after: Outcome
    effects: dict[str, dict[float, Outcome]]
    settings: dict[str, float]
    idle: tuple[str, ...]
    gain: tuple[float, float]
    gain_changes: dict[str, float]


def decide(
    page: CataloguePage, found: tuple[DriveEffect, ...] = (), limits: Limits | None = None
) -> Decision:
    """Choose settings of the levers for the least mean + 3 std of the DTE within limits.

    Each lever is tried alone; those without influence are left as they are. Of the others, all
    combinations of their settings are tried that the limits allow. Where the best of them gains
    less than `LITTLE`, nothing is changed.

    Parameters
    ----------
    page : CataloguePage
    found : tuple of DriveEffect, optional
        Effects beside those of the page.
    limits : Limits, optional

    Raises
    ------
    InvalidInput
        As `complete`.
    ArithmeticError
        If the unchanged drive has no steady state.
    """
    limits = Limits() if limits is None else limits
    figures = complete(page, {**ESTIMATES, **SHARES})
    known: dict[tuple[tuple[str, float], ...], Outcome] = {}

    def outcome(settings: Mapping[str, float]) -> Outcome:
        key = tuple(sorted(settings.items()))
        if key not in known:
            known[key] = _outcome(page, figures, settings, found)
        return known[key]

    before = outcome({})
    if not np.isfinite(before.goal):
        raise ArithmeticError("the drive has no steady state somewhere within its scatter")
    effects = {
        lever.name: {
            setting: outcome({lever.name: setting} if setting != lever.unchanged else {})
            for setting in lever.settings
        }
        for lever in LEVERS
    }
    idle = tuple(
        name
        for name, tried in effects.items()
        if max(abs(design.goal / before.goal - 1.0) for design in tried.values()) < LITTLE
    )
    choices = [
        [(lever.name, setting) for setting in lever.settings]
        for lever in LEVERS
        if lever.name not in idle
    ]
    unchanged = {lever.name: lever.unchanged for lever in LEVERS}
    designs = [
        {name: setting for name, setting in design if setting != unchanged[name]}
        for design in product(*choices)
    ]
    fit = [
        design
        for design in designs
        if allowed(_cost(changed_drive(page, figures, design), design), before, limits)
    ]
    settings = min(fit, key=lambda design: np.nan_to_num(outcome(design).goal, nan=np.inf))
    if outcome(settings).goal > (1.0 - LITTLE) * before.goal:
        settings = {}
    drives = _changed(page, figures, {}, found), _changed(page, figures, settings, found)
    return Decision(
        page,
        figures,
        found,
        drives,
        before,
        outcome(settings),
        effects,
        settings,
        idle,
        *_varied(page, figures, settings, found),
    )


def allowed(outcome: Cost, before: Cost, limits: Limits) -> bool:
    """Return whether a cost is within limits."""
    return (
        outcome.starting <= limits.starting_torque * before.starting * (1.0 + 1e-9)
        and outcome.stress <= limits.stress * (1.0 + 1e-9)
        and outcome.efficiency >= before.efficiency - limits.efficiency
    )


def nominal_dte(drive: DriveModel) -> float:
    """Return the DTE of the nominal drive at its rated condition, arcsec; NaN if there is none."""
    return float(drive.dte_where_found(drive.nominal[None])[0])


def found_effects(revised: DriveModel, page: CataloguePage) -> tuple[DriveEffect, ...]:
    """Return the effects of a revised model that the drive of a page lacks."""
    known = {place_of(effect) for effect in drive_of(page).effects}
    return tuple(effect for effect in revised.effects if place_of(effect) not in known)


def _changed(
    page: CataloguePage,
    figures: Mapping[str, Entry],
    settings: Mapping[str, float],
    found: tuple[DriveEffect, ...],
) -> DriveModel:
    """Return the drive after changes, with what was found."""
    return _with(changed_drive(page, figures, settings), found)


def _with(drive: DriveModel, found: tuple[DriveEffect, ...]) -> DriveModel:
    return replace(drive, effects=(*drive.effects, *found))


def _outcome(
    page: CataloguePage,
    figures: Mapping[str, Entry],
    settings: Mapping[str, float],
    found: tuple[DriveEffect, ...],
) -> Outcome:
    changed = changed_drive(page, figures, settings)
    cost, drive = _cost(changed, settings), _with(changed, found)
    dte = drive.dte_where_found(_drives(drive))
    return Outcome(
        cost.starting, cost.efficiency, cost.stress, float(dte.mean()), float(dte.std(ddof=1))
    )


def _cost(drive: DriveModel, settings: Mapping[str, float]) -> Cost:
    """Return what settings of the levers cost in a drive that has them, at its rated condition."""
    condition = drive.sheet.input_speed, drive.sheet.load_torque
    return Cost(
        starting_torque(drive), float(efficiency(drive, *condition)[0]), bending_stress(settings)
    )


def _drives(drive: DriveModel) -> NDArray[np.float64]:
    """Return drives of a design: normal theta_s, cut off at 3 std, and uniform other values."""
    shares = scipy.stats.qmc.Sobol(5, scramble=False).random(2 * DRIVES)[DRIVES:]
    drives = drive.nominal * (1.0 + TOLERANCE * (2.0 * shares - 1.0))
    deviation = scipy.stats.truncnorm.ppf(shares[:, 0], -3.0, 3.0)
    error = drive.nominal[0] + drive.kinematic_error.std * deviation
    drives[:, 0] = np.maximum(error, 0.05 * drive.nominal[0])
    return drives


def _varied(
    page: CataloguePage,
    figures: dict[str, Entry],
    settings: Mapping[str, float],
    found: tuple[DriveEffect, ...],
) -> tuple[tuple[float, float], dict[str, float]]:
    """Return the interval of the gain, and by how much each estimate moves it."""

    def gain(entries: Mapping[str, Entry]) -> float:
        drives = (_changed(page, entries, design, found) for design in ({}, settings))
        before, after = map(nominal_dte, drives)
        return before - after

    draws = [gain(drawn) for drawn in sampled(figures, DRAWS, np.random.default_rng(1))]
    low, high = np.nanmin(draws), np.nanmax(draws)
    moved = {}
    for name, entry in figures.items():
        if entry.estimated:
            ends = [
                gain({**figures, name: replace(entry, value=entry.value * (1.0 + side))})
                for side in (-entry.tolerance, entry.tolerance)
            ]
            moved[name] = float(abs(ends[1] - ends[0]))
    return (float(low), float(high)), dict(sorted(moved.items(), key=lambda item: -item[1]))
