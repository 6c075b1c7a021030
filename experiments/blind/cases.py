"""The blind cases: what each hides, from which seed, and what the workflow must reach on them.

Committed before the scoring run. A case draws its effect from one generator and its rig with all
noise from another, so that its twin, the same rig and noise without the effect, can be run too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy import BelievedDrive, Campaign, Rig
from pymoo_hdte.units import ARCSEC
from pymoo_hdte.virtual.hidden_forms import LISTED_FORMS, UNLISTED_FORMS, HiddenEffect, draw_effect
from pymoo_hdte.virtual.rig import TrueRig, draw_rig, run_campaign

SCORING_SEED = 20261122
"""Replaces 20261121, given up after 284 of 641 cases, when its outcomes led to changes."""

NONE_CASES = 200
SINGLE_CASES = 20
"""Cases for each listed effect."""
UNLISTED_CASES = (7, 7, 7, 7, 6, 6)
PAIR_CASES = 40
PARAMETER_CASES = 7
"""Cases for each of `PARAMETERS`."""
DETECTION_CASES = 6
"""Cases for each listed effect and each of `DETECTION_SIZES`."""
DETECTION_SIZES = (0.05, 0.1, 0.2, 0.4, 0.7)
PARAMETERS = ("stiffness", "input_inertia", "input_damping")
OUT_OF_TOLERANCE = (0.15, 0.40)
"""Range of the relative error of a believed value that is out of its tolerance of 10 %."""

# What must be reached: "Must reach" of issue 4; rates are judged as design section 8 says.
LEAST_RIGHT = 0.95
"""Share of cases whose first name is right, or whose class holds the truth."""
MOST_WRONG_CONFIDENT = 0.02
MOST_ALARMS = 0.05
"""Share of false alarms on campaigns that hide nothing."""
LEAST_NOTICED = 0.90
"""Share of unlisted effects that are noticed."""
LEAST_BOTH = 0.70
"""Share of pairs of which both effects are found."""
LEAST_F1 = 0.9
"""F1 score of the flagged cells."""
MOST_BIAS_LEFT = 0.1
"""Bias of the base parameters after the revision over that before it."""
LEAST_SHRINKAGE = 0.85
"""Median shrinkage of the gap on the held-out records."""
FLOOR_MULTIPLE = 1.5
"""Multiple of the noise floor within which a gap has closed."""
LEAST_CLOSED = 0.70
MOST_SECONDS = 10.0
"""Median time of a case on one core."""

BELIEVED = BelievedDrive(
    ratio=101.0,
    stiffness=2.583e4,
    damping=4.5,
    input_inertia=1.97e-4,
    input_damping=1.7e-4,
    output_damping=5.022e-4,
    output_inertia=8.505e-4,
    load_inertia=0.08,
    error_orders=(1.0, 2.0, 2.02),
    error_amplitudes=(4.0 * ARCSEC, 9.0 * ARCSEC, 5.0 * ARCSEC),
)
"""The HS-20-100, and below the rig, of the shared campaigns."""
RIG = Rig(
    proportional=0.02,
    integral=0.5,
    angle_noise=0.7 * ARCSEC,
    input_torque_noise=0.003,
    output_torque_noise=0.2,
    repeatability=0.3 * ARCSEC,
    torsion_angle_noise=0.204 * ARCSEC,
)


@dataclass(frozen=True)
class Case:
    """One campaign with a hidden truth.

    Attributes
    ----------
    kind : str
        "none", "single", "unlisted", "pair", "parameter" or "detection".
    names : tuple of str
        The hidden effects; of a parameter, the one that is out of tolerance.
    size : float
        Strength of the effects, 1 being typical.
    number : int
        Counts the cases of a kind, name and size.
    root : int
        Seed of the whole list.
    """

    kind: str
    names: tuple[str, ...]
    size: float
    number: int
    root: int = SCORING_SEED

    @property
    def truth(self) -> str:
        """What is hidden, in one word."""
        return "+".join(self.names) or "none"

    @property
    def key(self) -> str:
        """All fields in one name."""
        return f"{self.kind}_{self.truth}_{self.size:g}_{self.number}_seed{self.root}"

    def effects(self) -> tuple[HiddenEffect, ...]:
        """Return the hidden effects; none where a parameter is out of tolerance."""
        rng, _ = self._generators()
        if self.kind == "pair":
            return _pair(rng)
        if self.kind == "parameter":
            return ()
        return tuple(draw_effect(name, BELIEVED, rng, self.size) for name in self.names)

    def run(self, effects: tuple[HiddenEffect, ...]) -> Campaign:
        """Run the campaign; other effects leave all else as it is, loads, angles and noise."""
        of_effect, rng = self._generators()
        true_rig = replace(draw_rig(BELIEVED, (), rng), effects=effects)
        if self.kind == "parameter":
            true_rig = _out_of_tolerance(true_rig, self.names[0], of_effect)
        return run_campaign(true_rig, BELIEVED, RIG, rng, title=f"blind case {self.number}")

    def _generators(self) -> tuple[np.random.Generator, np.random.Generator]:
        """Return the generators of the effect and of the rig with its noise.

        They are the same for all sizes, so that a detection limit compares one rig with itself.
        """
        name = "" if self.kind == "pair" else self.truth
        words = f"{self.kind} {name} {self.number}"
        seeds = np.random.SeedSequence(self.root, spawn_key=tuple(words.encode())).spawn(2)
        of_effect, of_rig = (np.random.default_rng(seed) for seed in seeds)
        return of_effect, of_rig


def all_cases(root: int = SCORING_SEED) -> list[Case]:
    """Return all cases of a root seed, those of the detection limit last."""
    found = [Case("none", (), 1.0, number, root) for number in range(NONE_CASES)]
    for name in LISTED_FORMS:
        found += [Case("single", (name,), 1.0, number, root) for number in range(SINGLE_CASES)]
    for name, count in zip(UNLISTED_FORMS, UNLISTED_CASES, strict=True):
        found += [Case("unlisted", (name,), 1.0, number, root) for number in range(count)]
    for number in range(PAIR_CASES):
        nameless = Case("pair", (), 1.0, number, root)
        names = tuple(effect.name for effect in nameless.effects())
        found.append(replace(nameless, names=names))
    for name in PARAMETERS:
        numbers = range(PARAMETER_CASES)
        found += [Case("parameter", (name,), 1.0, number, root) for number in numbers]
    for size in DETECTION_SIZES:
        for name in LISTED_FORMS:
            numbers = range(DETECTION_CASES)
            found += [Case("detection", (name,), size, number, root) for number in numbers]
    return found


def _pair(rng: np.random.Generator) -> tuple[HiddenEffect, ...]:
    """Draw two different listed effects until a rig can hold both."""
    while True:
        names = rng.choice(list(LISTED_FORMS), 2, replace=False)
        effects = tuple(draw_effect(str(name), BELIEVED, rng) for name in names)
        try:
            TrueRig(BELIEVED, (0.0,) * len(BELIEVED.error_orders), effects)
        except InvalidInput:
            continue
        return effects


def _out_of_tolerance(true_rig: TrueRig, name: str, rng: np.random.Generator) -> TrueRig:
    off = rng.uniform(*OUT_OF_TOLERANCE) * rng.choice([-1.0, 1.0])
    changed: dict[str, Any] = {name: float(getattr(BELIEVED, name) * (1.0 + off))}
    return replace(true_rig, drive=replace(true_rig.drive, **changed))
