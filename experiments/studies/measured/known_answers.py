"""What is known of measured rigs from elsewhere, and how an answer is held against it.

An answer is *right* if it is plain and names every effect that is known and none that is not, and
*confidently wrong* if it is plain and does not; *partly right* if it names the main effect and says
itself that it is not all; *not found* if it says that nothing it knows is the cause; *wrong*
otherwise.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RIGHT, PARTLY, WRONG, CONFIDENT = "right", "partly right", "wrong", "confidently wrong"
NOT_FOUND, UNKNOWN = "not found", "no answer known"
FALLS_SHORT = (CONFIDENT, WRONG, NOT_FOUND, PARTLY, UNKNOWN, RIGHT)
"""Judgements, what falls short first."""
PLAIN = ("named", "adequate", "parameter")
"""Statuses of an answer without a reservation."""
_DRY = frozenset({"coulomb_friction", "stribeck_friction"})
_RIPPLE = frozenset({"torque_ripple", "kinematic_error", "position_dependent_friction"})


@dataclass(frozen=True)
class Friction:
    """A known curve of friction: dry + viscous speed + root speed^(1/3), N.m; speed in rad/s."""

    dry: float
    viscous: float
    root: float = 0.0

    def at(self, speed: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the friction at speeds (n,) above 0."""
        return self.dry + self.viscous * speed + self.root * np.cbrt(speed)


@dataclass(frozen=True)
class KnownRig:
    """A measured rig and what is known of it.

    Attributes
    ----------
    name : str
    folder : str
        With its records, in `experiments.studies.measured.rigs.SHARED`; described by a ``rig.toml``
        there, or else by ``experiments/data/<name>.toml``.
    answer : str
        What is missing in the believed model, in words.
    source : str
        Who says so.
    effects : tuple of frozenset of str
        Effects that are missing, the main one first; any of a set counts as that effect.
    also : frozenset of str
        Further effects that are plausible there, and that no published answer excludes. Where no
        effect is known, a plain verdict may name nothing else.
    values : dict of str to float
        Known values by effect and quantity, SI.
    friction : Friction or None
        Known curve of the friction.
    order : float or None
        Cycles of a ripple per turn of the joint, known within ``reach``: of the resolution of the
        travel, and of whether the ripple turns with the housing or with the output, which is off by
        the ripple's cycles per input turn.
    reach : float
    """

    name: str
    folder: str
    answer: str
    source: str
    effects: tuple[frozenset[str], ...] = ()
    also: frozenset[str] = frozenset()
    values: tuple[tuple[str, float], ...] = ()
    friction: Friction | None = None
    order: float | None = None
    reach: float = 0.0


def judged(rig: KnownRig, status: str, names: Collection[str], others: Collection[str] = ()) -> str:
    """Return the judgement on an answer.

    Parameters
    ----------
    rig : KnownRig
    status : str
        Of a verdict; ``"named"`` for a tool that has no doubts.
    names : collection of str
        Effects that it names.
    others : collection of str
        Effects of the other members of a class, which says that one of its members is there.
    """
    if not rig.effects:
        beyond = set(names) - rig.also if rig.also else set()
        return CONFIDENT if beyond and status in PLAIN else UNKNOWN
    main = bool(rig.effects[0] & {*names, *others})
    every = all(effect & set(names) for effect in rig.effects)
    known = frozenset().union(*rig.effects, rig.also)
    if main and status in PLAIN:
        return RIGHT if every and known >= set(names) else CONFIDENT
    if main:
        return PARTLY
    if status == "unlisted":
        return NOT_FOUND
    return CONFIDENT if status in (*PLAIN, "class") else WRONG


def beside(rig: KnownRig, names: Collection[str]) -> list[str]:
    """Return which names are no part of the known answer, and only allowed beside it."""
    known = frozenset().union(*rig.effects)
    return [name for name in names if name in rig.also and name not in known]


_RESISTANCE = frozenset(
    {
        *("stribeck_friction", "load_dependent_friction"),
        *("shear_thinning_drag", "nonlinear_drag"),
    }
)
_LEAST_SQUARES = "least squares of our own"
_UR10E = "identification in shamilmamedov/dynamic_calibration, and least squares of our own"
KNOWN_RIGS = (
    KnownRig(
        "ur10e_joint_1",
        "measured/ur10e",
        "dry friction; ripple twice per input turn (202 per joint turn)",
        _UR10E,
        (_DRY | {"nonlinear_drag"}, _RIPPLE),
        # A term that grows more slowly than the speed fits better than a viscous one.
        frozenset({"nonlinear_drag"}),
        friction=Friction(5.6, 11.8, 17.5),
        order=202.0,
        reach=2.0 + 2.0,
    ),
    KnownRig(
        "ur10e_joint_4",
        "measured/ur10e",
        "gravity 3.0 N.m; Coulomb friction 2.3 N.m; ripple twice per input turn",
        _UR10E,
        (frozenset({"gravity"}), _DRY, _RIPPLE),
        values=(("gravity: torque", 3.0), ("coulomb_friction: level", 2.3)),
        order=202.0,
        reach=2.0 + 2.0,
    ),
    KnownRig(
        "ur10e_joint_6",
        "measured/ur10e",
        "Coulomb friction 2.30 N.m; ripple four times per input turn (404 per joint turn)",
        _UR10E,
        (_DRY, _RIPPLE),
        values=(("coulomb_friction: level", 2.30),),
        order=404.0,
        reach=3.7 + 4.0,
    ),
    KnownRig(
        "tx40_joint_4",
        "measured/tx40_j4",
        "Coulomb friction 2.48 N.m beside viscous friction 1.11 N.m.s/rad",
        "thanhndv212/figaroh-examples",
        (_DRY,),
        _RIPPLE | {"force_offset"},
        friction=Friction(2.48, 1.11),
    ),
    KnownRig(
        "silverbox",
        "measured/silverbox",
        "a cubic spring that hardens, 3.76 to 3.9",
        "band-limited least squares, R2 of the force .9997 on the arrow",
        (frozenset({"hardening_stiffness"}),),
        # The circuit is known to have an offset.
        frozenset({"force_offset"}),
        (("hardening_stiffness: coefficient", 3.83),),
    ),
    KnownRig(
        "bouc_wen",
        "measured/bouc_wen",
        "hysteresis of Bouc and Wen",
        "simulated with the parameters of the public benchmark",
        (frozenset({"hysteresis"}),),
        # With gamma + delta below 0 a loop that is loaded stiffens, unlike springs that slip.
        frozenset({"hardening_stiffness"}),
    ),
    KnownRig(
        "emps",
        "measured/emps",
        "Coulomb friction 20.39 N; friction differs with the direction, or there is an offset",
        "Janot, Gautier, Brunot (2019)",
        (_DRY, frozenset({"direction_dependent_friction", "force_offset"})),
        values=(
            ("coulomb_friction: level", 20.39),
            ("inertia of position", 95.109),
            ("damping of joint", 203.5),
        ),
    ),
    KnownRig(
        "kinova",
        "measured/kinova_gen3_j7",
        "dry friction with a Stribeck dip; ripple at 200 and 400 per joint turn",
        "means and lines of the ten runs; HBRS-SDP/joint-friction-model",
        (_DRY, _RIPPLE),
        order=200.0,
        reach=1.0,
    ),
    KnownRig(
        "lara8_joint_3",
        "measured/lara8_j3",
        "none published, of torques or torsion",
        "allwinlucious/MasterThesis",
    ),
    KnownRig(
        "ur10e_joint_2",
        "cases/real/gravity_hides_coulomb",
        "gravity; Coulomb friction 16.3 N.m beside viscous friction 21 N.m.s/rad",
        _UR10E,
        (frozenset({"gravity"}), frozenset({"coulomb_friction"})),
        _RESISTANCE | {"torque_ripple"},
        values=(("coulomb_friction: level", 16.3), ("damping of bearing", 21.0)),
    ),
    KnownRig(
        "kinova_joint_4",
        "cases/real/vote_kills_gravity",
        "gravity 9.3 N.m; dry friction",
        _LEAST_SQUARES,
        (frozenset({"gravity"}),),
        _DRY | {"torque_ripple"},
        values=(("gravity: torque", 9.3),),
    ),
    KnownRig(
        "kinova_joint_5",
        "cases/real/kinova5_missing_is_certain",
        "dry friction 1.2 N.m",
        _LEAST_SQUARES,
        (_DRY,),
        frozenset({"torque_ripple", "gravity"}),
        values=(("coulomb_friction: level", 1.2),),
    ),
    KnownRig(
        "tx40_joint_3",
        "cases/real/named_though_gap_grows",
        "Coulomb friction 6.1 N.m, while all joints move; the rest is not sure",
        _LEAST_SQUARES,
        (frozenset({"coulomb_friction"}),),
        frozenset({"torque_ripple"}),
        values=(("coulomb_friction: level", 6.1),),
    ),
    KnownRig(
        "lara8_joint_6",
        "cases/real/lara8_order_3131",
        "an error of the gear twice per input turn (202 to 203 per joint turn), 12.7 arcsec",
        _LEAST_SQUARES,
        (_RIPPLE,),
        order=202.5,
        reach=0.5 + 2.0,
    ),
    KnownRig(
        "dm4310",
        "cases/real/rests_and_breakaway",
        "Coulomb friction 0.119 N.m beside viscous friction 0.0073 N.m.s/rad",
        "its authors, and least squares of our own within 3 %",
        (_DRY | {"presliding_friction"},),
        frozenset({"torque_ripple", "position_dependent_friction"}),
        values=(
            ("coulomb_friction: level", 0.119),
            ("damping of bearing", 0.0073),
            ("inertia of q", 0.0017),
        ),
    ),
    KnownRig(
        "ak80_pendulum",
        "cases/real/delayed_torque",
        "the torque column leads by 50 ms and is half of what it should be",
        _LEAST_SQUARES,
        also=frozenset({"gravity", "coulomb_friction"}),
    ),
    KnownRig(
        "rack_and_pinion",
        "cases/real/one_way_push",
        "dry friction 18 N beside viscous friction 42 N.s/m; mass 25.3 kg",
        "least squares of our own on the whole push",
        (_DRY,),
        values=(
            ("coulomb_friction: level", 18.0),
            ("damping of guide", 42.0),
            ("inertia of x", 25.3),
        ),
    ),
    KnownRig(
        "filmed_pendulum",
        "cases/real/pendulum_30Hz_refused",
        "gravity 0.0492 N.m",
        _LEAST_SQUARES,
        (frozenset({"gravity"}),),
        values=(("gravity: torque", 0.0492),),
    ),
    KnownRig(
        "mr_damper",
        "cases/real/damper_vote",
        "hysteresis of a magneto-rheological damper",
        _LEAST_SQUARES,
        (frozenset({"hysteresis", "bouc_wen_hysteresis"}),),
    ),
    KnownRig(
        "mr_damper_made",
        "cases/real/inertia_zero",
        "none: made up, with an inertia that may be zero",
        "whoever made it",
    ),
    *(
        KnownRig(
            f"made_rest_{seconds}s",
            f"cases/real/rest_hides_coulomb/rest_{seconds}s",
            "Coulomb friction 0.12 N.m, in a motor that rests at first",
            "whoever made it",
            (frozenset({"coulomb_friction"}),),
            values=(("coulomb_friction: level", 0.12),),
        )
        for seconds in (0, 10, 20)
    ),
)
