"""What a maker can change in a drive, and what each change does to its figures.

A lever's formula is a statement that can be replaced: it maps the figures of a completed page and
the errors of the parts, with the setting, to new ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.drive.catalogue import CataloguePage, Entry, accuracy_of_parts, drive_of
from pymoo_hdte.drive.datasheet import ErrorSource
from pymoo_hdte.drive.datasheet_file import hs_20_100
from pymoo_hdte.drive.estimates import Estimate
from pymoo_hdte.drive.model import DriveModel

Figures = Mapping[str, Entry]
Parts = tuple[ErrorSource, ...]

SHARES: Mapping[str, Estimate] = {
    "wall_share": Estimate(
        lambda known: 0.5, (), 0.5, "half of the torsional compliance is of the wall; assumed"
    ),
    "ring_share": Estimate(
        lambda known: 0.5,
        (),
        0.5,
        "half of the starting torque comes from the force that bends the ring; assumed",
    ),
    "preload_share": Estimate(
        lambda known: 0.7,
        (),
        0.4,
        "0.7 of the soft beginning is of flanks that preload closes; assumed",
    ),
}
"""Figures that the formulas of the levers need and no page has, in the form of `ESTIMATES`.

Examples
--------
>>> list(SHARES)
['wall_share', 'ring_share', 'preload_share']
"""
GRADE = 2.0**0.5
"""Step of a deviation from one tolerance grade to the next, ISO 1328-1."""


@dataclass(frozen=True)
class Lever:
    """One thing that can be changed.

    Attributes
    ----------
    name : str
    unchanged : float
        Setting that leaves the drive as it is: a factor, or steps of a class, dimensionless.
    settings : tuple of float, length n
        Settings to choose from, in rising order, the unchanged one among them, dimensionless.
    formula : callable
        Maps figures, errors of the parts and a setting to figures and errors, in SI.
    stress : callable
        Maps a setting to the bending stress in the flexspline, relative to the unchanged one.
    basis : str
        What the formula says, in a sentence.

    Examples
    --------
    >>> LEVERS[0].name, LEVERS[0].settings
    ('wall_thickness', (0.9, 1.0, 1.1))
    """

    name: str
    unchanged: float
    settings: tuple[float, ...]
    formula: Callable[[Figures, Parts, float], tuple[dict[str, Entry], Parts]]
    basis: str
    stress: Callable[[float], float] = field(default_factory=lambda: _no_stress)


def _no_stress(setting: float) -> float:
    return 1.0


def _times(figures: Figures, factors: Mapping[str, float]) -> dict[str, Entry]:
    return {
        name: replace(entry, value=entry.value * factors.get(name, 1.0))
        for name, entry in figures.items()
    }


def _with_start(figures: Figures, factor: float) -> dict[str, Entry]:
    """Return the figures with another starting torque; the drag beyond it stays."""
    start = figures["no_load_starting_torque"]
    running = figures["no_load_running_torque"]
    added = (factor - 1.0) * start.value
    return dict(figures) | {
        "no_load_starting_torque": replace(start, value=start.value + added),
        "no_load_running_torque": replace(running, value=running.value + added),
    }


def wall(figures: Figures, parts: Parts, setting: float) -> tuple[dict[str, Entry], Parts]:
    """Return the figures with a wall ``setting`` times as thick.

    The torsion of a thin tube falls with its thickness, and the force that bends a ring by a given
    way grows with its cube (Timoshenko, Strength of Materials, 1955).
    """
    share, ring = figures["wall_share"].value, figures["ring_share"].value
    stiffer = 1.0 / (share / setting + 1.0 - share)
    changed = _times(figures, dict.fromkeys(("K1", "K2", "K3"), stiffer))
    return _with_start(changed, 1.0 - ring + ring * setting**3), parts


def preload(figures: Figures, parts: Parts, setting: float) -> tuple[dict[str, Entry], Parts]:
    """Return the figures with ``setting`` times the preload of the teeth.

    Contact forces, and with them friction and hysteresis, grow in proportion; the soft beginning of
    the torsion shrinks by the part that the preload closes.
    """
    second, first = figures["K2"].value, figures["K1"].value
    share, ring = figures["preload_share"].value, figures["ring_share"].value
    left = 1.0 - share + share / setting
    stiffer = (second - (second - first) * left) / first
    changed = _times(figures, {"K1": stiffer, "hysteresis_loss": setting})
    return _with_start(changed, 1.0 - ring + ring * setting), parts


def _graded(*classes: str) -> Callable[[Figures, Parts, float], tuple[dict[str, Entry], Parts]]:
    def formula(figures: Figures, parts: Parts, setting: float) -> tuple[dict[str, Entry], Parts]:
        factor = GRADE**setting
        changed = tuple(
            replace(part, mean=part.mean * factor, std=part.std * factor)
            if part.error_class in classes
            else part
            for part in parts
        )
        return dict(figures), changed

    return formula


LEVERS = (
    Lever(
        "wall_thickness",
        1.0,
        (0.9, 1.0, 1.1),
        wall,
        "wall_share of the torsional compliance falls with the thickness, ring_share of the "
        "starting torque grows with its cube, bending stress in proportion",
        lambda setting: setting,
    ),
    Lever(
        "preload",
        1.0,
        (0.8, 1.0, 1.25),
        preload,
        "hysteresis and ring_share of the starting torque grow in proportion, preload_share of "
        "the distance of K1 from K2 falls in proportion",
    ),
    Lever(
        "cam_class",
        0.0,
        (-1.0, 0.0, 1.0),
        _graded("e_w"),
        "errors of wave generator and bearing change by the square root of two a class",
    ),
    Lever(
        "tooth_class",
        0.0,
        (-1.0, 0.0, 1.0),
        _graded("e_p", "e_h"),
        "pitch and tooth errors change by the square root of two a class",
    ),
)
"""The levers, with what their formulas say.

Examples
--------
>>> [lever.name for lever in LEVERS]
['wall_thickness', 'preload', 'cam_class', 'tooth_class']
"""


def changed_drive(
    page: CataloguePage,
    figures: Figures,
    settings: Mapping[str, float],
    levers: Sequence[Lever] = LEVERS,
) -> DriveModel:
    """Return the model of a page after changes.

    Parameters
    ----------
    page : CataloguePage
    figures : mapping of Entry
        Of ``complete(page, ESTIMATES | SHARES)``.
    settings : mapping of float
        By name of the lever, dimensionless; levers that are not named stay unchanged.
    levers : sequence of Lever

    Returns
    -------
    DriveModel
        A printed accuracy changes as that of the parts does.

    Raises
    ------
    InvalidInput
        For an unknown lever; as `drive_of`.

    Examples
    --------
    >>> page = load_page(built_in_page(20))
    >>> figures = complete(page, {**ESTIMATES, **SHARES})
    >>> thick = changed_drive(page, figures, {"wall_thickness": 1.1})
    >>> print(f"{thick.sheet.nominal.stiffness:.0f} N.m/rad")
    26190 N.m/rad
    """
    unknown = set(settings) - {lever.name for lever in levers}
    if unknown:
        allowed = ", ".join(lever.name for lever in levers)
        raise InvalidInput("lever", sorted(unknown)[0], allowed)
    before: Parts = tuple(page.error_sources or hs_20_100().error_sources)
    now, parts = dict(figures), before
    for lever in levers:
        if lever.name in settings:
            now, parts = lever.formula(now, parts, settings[lever.name])
    if "transmission_accuracy" in now and parts != before:
        sheet = drive_of(page, figures, sources=before).sheet
        old, new = (
            accuracy_of_parts(replace(sheet, error_sources=some))[0] for some in (before, parts)
        )
        now = _times(now, {"transmission_accuracy": new / old})
    return drive_of(page, now, sources=parts)


def bending_stress(settings: Mapping[str, float], levers: Sequence[Lever] = LEVERS) -> float:
    """Return the bending stress in the flexspline relative to the unchanged drive.

    Examples
    --------
    >>> bending_stress({"wall_thickness": 1.1})
    1.1
    """
    stresses = [lever.stress(settings.get(lever.name, lever.unchanged)) for lever in levers]
    return float(np.prod(stresses))
