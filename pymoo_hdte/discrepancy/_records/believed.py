"""What the engineer believes about drive and rig before the measurement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number
from pymoo_hdte.discrepancy._records.known_values import known_values
from pymoo_hdte.drive import DampingReference, DriveEffect, LoadInertia
from pymoo_hdte.effects.effect import place_of
from pymoo_hdte.units import ARCSEC

MECHANICAL = (
    "stiffness",
    "damping",
    "input_inertia",
    "input_damping",
    "output_damping",
    "load_inertia",
)
"""Fields of `BelievedDrive` that are fitted; J_out, 1/100 of the load's inertia, is not."""

SENSOR_PLACES = ("drive", "brake")
"""Places of the output's torque sensor: between drive and load inertia, or behind both."""


@dataclass(frozen=True)
class BelievedDrive:
    """Believed parameters of the drive and its load in the motion, Eq. (9), with their tolerances.

    Attributes
    ----------
    ratio : float
        Transmission ratio N, dimensionless.
    stiffness, damping : float
        K and c of the mesh at the output, N.m/rad and N.m.s/rad.
    input_inertia, output_inertia, load_inertia : float
        kg.m2; the load inertia may be zero.
    input_damping, output_damping : float
        Damping of the bearings, N.m.s/rad.
    error_orders : tuple of float, length n_lines
        Orders of the static error in cycles per input turn.
    error_amplitudes : tuple of float, length n_lines
        Their amplitudes at the output, rad; the phases are unknown.
    tolerance : float
        Relative half-width of every parameter but the static error.
    error_tolerance : float
        Relative half-width of the amplitudes.
    effects : tuple of Effect
        Effects that the drive is believed to have in addition to Eq. (9). Their numbers are fixed
        unless ``tolerances`` names them. The inertia of the load and the damping of the torsion are
        given as values instead.
    tolerances : dict of str to float
        Relative half-widths of single values. Those of `MECHANICAL` replace ``tolerance``; numbers
        of effects go by the names of `known_values`.

    Raises
    ------
    InvalidInput
        For a value that is not finite or out of range, orders that do not match, an effect that is
        given twice at one place, or one that belongs in a value.

    Examples
    --------
    >>> believed = read_campaign("campaign").believed
    >>> believed.ratio, believed.tolerance_of("stiffness")
    (50, 0.1)
    """

    ratio: float
    stiffness: float
    damping: float
    input_inertia: float
    input_damping: float
    output_damping: float
    output_inertia: float
    load_inertia: float
    error_orders: tuple[float, ...]
    error_amplitudes: tuple[float, ...]
    tolerance: float = 0.1
    error_tolerance: float = 0.3
    effects: tuple[DriveEffect, ...] = ()
    tolerances: Mapping[str, float] = field(default_factory=dict, hash=False)

    def tolerance_of(self, name: str) -> float:
        """Return the relative half-width of a value.

        Parameters
        ----------
        name : str
            One of `MECHANICAL`.
        """
        return self.tolerances.get(name, self.tolerance)

    def __post_init__(self) -> None:
        real_number("ratio", self.ratio, above=1.0)
        for name in ("stiffness", "input_inertia", "output_inertia"):
            real_number(name, getattr(self, name), above=0.0)
        for name in ("damping", "input_damping", "output_damping", "load_inertia"):
            real_number(name, getattr(self, name), at_least=0.0)
        for name in ("tolerance", "error_tolerance"):
            real_number(name, getattr(self, name), at_least=0.0, below=1.0)
        for name in ("error_orders", "error_amplitudes"):
            if not isinstance(getattr(self, name), tuple):
                raise InvalidInput(name, getattr(self, name), "a tuple of numbers")
        for order in self.error_orders:
            real_number("error_orders", order, above=0.0)
        for amplitude in self.error_amplitudes:
            real_number("error_amplitudes", amplitude, at_least=0.0)
        if len(set(self.error_orders)) != len(self.error_orders):
            raise InvalidInput("error_orders", self.error_orders, "each order once")
        if len(self.error_amplitudes) != len(self.error_orders):
            allowed = f"one for each of the {len(self.error_orders)} error_orders"
            raise InvalidInput("error_amplitudes", self.error_amplitudes, allowed)
        self._check_effects()
        if not isinstance(self.tolerances, Mapping):
            raise InvalidInput("tolerances", self.tolerances, "a number for each name")
        for name, value in self.tolerances.items():
            one_of("tolerances", name, (*MECHANICAL, *known_values(self.effects)))
            real_number(f"tolerances.{name}", value, at_least=0.0, below=1.0)

    def _check_effects(self) -> None:
        if not isinstance(self.effects, tuple) or not all(
            hasattr(effect, "apply") for effect in self.effects
        ):
            raise InvalidInput("effects", self.effects, "a tuple of effects")
        for effect in self.effects:
            if isinstance(effect, LoadInertia | DampingReference):
                allowed = "none that is a value: load_inertia or damping"
                raise InvalidInput("effects", effect.name, allowed)
        places = [place_of(effect) for effect in self.effects]
        if len(set(places)) != len(places):
            names = [effect.name for effect in self.effects]
            raise InvalidInput("effects", names, "each effect once, at each port and order")


@dataclass(frozen=True)
class Rig:
    """Speed loop and sensors of the rig.

    The noise is that of one raw sample, before any averaging. Angles are referred to the output:
    the input encoder has N times the noise and the quantisation written here. Gains are relative
    half-widths, zeros half-widths, both constant over a campaign.

    Attributes
    ----------
    proportional, integral : float
        P and I of ``T_motor = P (w_set - w) + I integral(w_set - w) dt + constant``, N.m.s/rad and
        N.m/rad; both zero for a constant motor torque.
    angle_noise, torsion_angle_noise : float
        Standard deviations in running and in torsion records, rad.
    input_torque_noise, output_torque_noise : float
        Standard deviations, N.m.
    repeatability : float
        Standard deviation of the transmission error from one record to the next, rad.
    angle_quantisation : float
        Step of the encoders, rad.
    input_torque_gain, output_torque_gain : float
        Gain errors of the torque sensors, relative.
    input_torque_zero, output_torque_zero : float
        Zero errors of the torque sensors, N.m.
    output_torque_at : {"drive", "brake"}
        Where the torque sensor of the output sits: between drive and load inertia, so that it reads
        the load's torque and what accelerates the load, or behind both, where it reads the load's
        torque alone.
    motor_poles, motor_slots : int
        Of the motor, at which it may cog; both zero where they are not known.

    Raises
    ------
    InvalidInput
        For a value that is negative or not finite, for noise of zero, another place, or poles
        without slots.

    Examples
    --------
    >>> read_campaign("campaign").rig.output_torque_noise
    0.2
    """

    proportional: float
    integral: float
    angle_noise: float
    input_torque_noise: float
    output_torque_noise: float
    repeatability: float
    torsion_angle_noise: float
    angle_quantisation: float = 0.3 * ARCSEC
    input_torque_gain: float = 0.005
    input_torque_zero: float = 0.003
    output_torque_gain: float = 0.005
    output_torque_zero: float = 0.1
    output_torque_at: str = "drive"
    motor_poles: int = 0
    motor_slots: int = 0

    def __post_init__(self) -> None:
        poles, slots = (
            whole_number(name, getattr(self, name), 0) for name in ("motor_poles", "motor_slots")
        )
        if (poles == 0) != (slots == 0):
            missing = "motor_slots" if poles else "motor_poles"
            raise InvalidInput(missing, 0, "the number of both poles and slots, or of neither")
        for attribute in fields(self):
            value = getattr(self, attribute.name)
            if attribute.name == "output_torque_at":
                one_of(attribute.name, value, SENSOR_PLACES)
                continue
            # Residuals are weighted by the noise, so that it must not be zero.
            if attribute.name.endswith("_noise"):
                real_number(attribute.name, value, above=0.0)
            else:
                real_number(attribute.name, value, at_least=0.0)
