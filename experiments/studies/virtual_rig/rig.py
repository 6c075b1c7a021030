"""A virtual rig with hidden effects, independent of the library's laws: campaigns for tests.

Every record moves the static error a little: the sine and the cosine part of each of m lines and
the constant get normal errors of repeatability / sqrt(m), so that the varying part has the
repeatability as its root mean square. They are integrated, not added to the reading.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from experiments.studies.virtual_rig.integrator import Mechanics, quasi_static_torsion
from experiments.studies.virtual_rig.laws import Mesh, Side
from experiments.studies.virtual_rig.runs import Condition, simulate_run
from pymoo_hdte.checks import InvalidInput, one_of, real_number
from pymoo_hdte.discrepancy._records.campaign import (
    BelievedDrive,
    Campaign,
    Rig,
    RunningRecord,
    TorsionRecord,
)

LOAD_SETTING = 0.25
"""Standard deviation of the brake's load from a set value other than zero, N.m."""
PAUSE = 20.0
"""Time between two records of a session, s."""
SWEEP = (0.0, 40.0, -40.0, 40.0)
"""Corners of the torsion sweep, N.m; `SWEEP_LEG` seconds apart, sampled at `SWEEP_RATE`."""
SWEEP_LEG = 60.0
SWEEP_RATE = 10.0


def _default_conditions() -> tuple[Condition, ...]:
    train = {
        10: (0, 40),
        200: (10, 40),
        600: (0, 20),
        1000: (10, 40),
        1400: (0, 20),
        2000: (0, 20, 40),
    }
    held_out = {10: (20,), 200: (20,), 600: (40,), 1000: (0,), 1400: (40,), 2000: (10,)}
    averaged = {10: 50, 200: 4, 600: 2, 1000: 1, 1400: 1, 2000: 1}
    return tuple(
        Condition(float(speed), float(load), 1000.0 / averaged[speed], averaged[speed], role)
        for role, loads in (("train", train), ("held_out", held_out))
        for speed in loads
        for load in loads[speed]
    )


DEFAULT_CONDITIONS = _default_conditions()
"""Those of the shared rigs: 13 records to fit and 6 held out."""


_Part = TypeVar("_Part", Side, Mesh)


@dataclass(frozen=True)
class HiddenEffect:
    """One hidden effect.

    Attributes
    ----------
    port : str
        "input", "output" or "mesh".
    parameters : dict
        Fields of `laws.Side` (input, output) or `laws.Mesh` and their values, SI.
    """

    port: str
    parameters: dict[str, Any]


def torque_ripple(rng: np.random.Generator) -> HiddenEffect:
    """Draw a motor torque of 0.005 to 0.025 N.m at a whole order from 2 to 8."""
    return HiddenEffect(
        "input",
        {
            "ripple": rng.uniform(0.005, 0.025),
            "ripple_order": float(rng.integers(2, 9)),
            "ripple_phase": rng.uniform(0.0, 2.0 * np.pi),
            "ripple_second": rng.uniform(0.0, 2.0 * np.pi),
        },
    )


@dataclass(frozen=True)
class TrueRig:
    """The true drive on the rig.

    Attributes
    ----------
    drive : BelievedDrive
        True values of the believed parameters.
    error_phases : tuple of float
        phi of a sin(o theta_in + phi), one for each error order, rad.
    effects : tuple of HiddenEffect

    Raises
    ------
    InvalidInput
        If the phases do not match the orders, or two effects set the same field differently.
    """

    drive: BelievedDrive
    error_phases: tuple[float, ...]
    effects: tuple[HiddenEffect, ...] = ()

    def __post_init__(self) -> None:
        if len(self.error_phases) != len(self.drive.error_orders):
            allowed = f"one for each of the {len(self.drive.error_orders)} error orders"
            raise InvalidInput("error_phases", self.error_phases, allowed)
        fields: dict[tuple[str, str], object] = {}
        for effect in self.effects:
            one_of("port", effect.port, ("input", "output", "mesh"))
            for field, value in effect.parameters.items():
                if fields.setdefault((effect.port, field), value) != value:
                    raise InvalidInput(
                        f"{field} of {effect.port}", value, "one value from all effects of a port"
                    )

    def mechanics(self, rig: Rig) -> Mechanics:
        """Return the rig as the integrator sees it."""
        drive = self.drive
        mesh = Mesh(
            drive.stiffness,
            drive.damping,
            np.array(drive.error_orders),
            np.array(drive.error_amplitudes),
            np.array(self.error_phases),
        )
        return Mechanics(
            drive.ratio,
            rig.proportional,
            rig.integral,
            drive.load_inertia,
            self._with_effects(Side(drive.input_inertia, drive.input_damping), "input"),
            self._with_effects(Side(drive.output_inertia, drive.output_damping), "output"),
            self._with_effects(mesh, "mesh"),
        )

    def _with_effects(self, part: _Part, port: str) -> _Part:
        for effect in self.effects:
            if effect.port == port:
                part = part._replace(**effect.parameters)
        return part


def draw_rig(
    believed: BelievedDrive, effects: tuple[HiddenEffect, ...], rng: np.random.Generator
) -> TrueRig:
    """Draw a rig whose parameters differ from the believed ones uniformly within the tolerances.

    The ratio and the error orders are as believed; the phases are uniform.
    """
    off = 1.0 + believed.tolerance * rng.uniform(-1.0, 1.0, 7)
    lines = len(believed.error_orders)
    amplitudes = np.array(believed.error_amplitudes)
    amplitudes *= 1.0 + believed.error_tolerance * rng.uniform(-1.0, 1.0, lines)
    drive = replace(
        believed,
        stiffness=float(off[0] * believed.stiffness),
        damping=float(off[1] * believed.damping),
        input_inertia=float(off[2] * believed.input_inertia),
        input_damping=float(off[3] * believed.input_damping),
        output_damping=float(off[4] * believed.output_damping),
        output_inertia=float(off[5] * believed.output_inertia),
        load_inertia=float(off[6] * believed.load_inertia),
        error_amplitudes=tuple(amplitudes.tolist()),
    )
    return TrueRig(drive, tuple(rng.uniform(0.0, 2.0 * np.pi, lines).tolist()), effects)


def run_campaign(
    true_rig: TrueRig,
    believed: BelievedDrive,
    rig: Rig,
    rng: np.random.Generator,
    conditions: tuple[Condition, ...] = DEFAULT_CONDITIONS,
) -> Campaign:
    """Run and record a session: the conditions in random order, and a torsion sweep.

    Parameters
    ----------
    true_rig : TrueRig
    believed : BelievedDrive
        Believed drive of the campaign.
    rig : Rig
        Its speed loop needs an integral part, or the mean speed would be free.
    rng : numpy.random.Generator
    conditions : tuple of Condition

    Returns
    -------
    Campaign

    Raises
    ------
    InvalidInput
        For a speed loop without integral part.
    """
    real_number("integral", rig.integral, above=0.0)
    errors = draw_torque_errors(rig, rng)
    lasting = np.array([condition.duration(believed.ratio) + PAUSE for condition in conditions])
    order = rng.permutation(len(conditions))
    elapsed = np.empty(len(conditions))
    elapsed[order] = np.concatenate([[0.0], np.cumsum(lasting[order])[:-1]])
    running = tuple(
        _run(true_rig, rig, errors, condition, float(start), rng)
        for condition, start in zip(conditions, elapsed, strict=True)
    )
    torsion = _torsion_record(true_rig, rig, errors, rng)
    return Campaign("virtual rig", "HS-20-100", believed, rig, running, (torsion,))


def _run(
    true_rig: TrueRig,
    rig: Rig,
    errors: TorqueErrors,
    condition: Condition,
    elapsed: float,
    rng: np.random.Generator,
) -> RunningRecord:
    mechanics = true_rig.mechanics(rig)
    mechanics = mechanics._replace(mesh=repeated(mechanics.mesh, rig.repeatability, rng))
    setting = LOAD_SETTING * rng.standard_normal()
    load = condition.load_torque + (setting if condition.load_torque != 0.0 else 0.0)
    start = rng.uniform(0.0, 2.0 * np.pi * mechanics.ratio)
    samples = simulate_run(mechanics, condition, load, start)
    if rig.output_torque_at == "brake":
        samples[3] = load
    raw_time = condition.raw_interval * np.arange(float(samples.shape[1]))
    averaged = condition.samples_averaged
    channels = measure(samples, mechanics.ratio, rig, errors, averaged, rng)
    return RunningRecord(
        name=condition.name,
        role=condition.role,
        input_speed=condition.input_speed,
        load_torque=condition.load_torque,
        sample_rate=condition.sample_rate,
        samples_averaged=averaged,
        elapsed=elapsed,
        time=raw_time.reshape(-1, averaged).mean(axis=1),
        input_angle=channels[0],
        output_angle=channels[1],
        input_torque=channels[2],
        output_torque=channels[3],
    )


def repeated(mesh: Mesh, repeatability: float, rng: np.random.Generator) -> Mesh:
    """Return the mesh with the static error of one record: see the top of this module.

    Parameters
    ----------
    mesh : Mesh
    repeatability : float
        rad.
    rng : numpy.random.Generator
    """
    lines = len(mesh.error_orders)
    spread = repeatability / max(lines, 1) ** 0.5
    phasors = mesh.error_amplitudes * np.exp(1j * mesh.error_phases)
    phasors += spread * (rng.standard_normal(lines) + 1j * rng.standard_normal(lines))
    return mesh._replace(
        error_amplitudes=np.abs(phasors),
        error_phases=np.angle(phasors),
        error_offset=spread * rng.standard_normal(),
    )


def _torsion_record(
    true_rig: TrueRig, rig: Rig, errors: TorqueErrors, rng: np.random.Generator
) -> TorsionRecord:
    """Sweep the load with the input locked at angle zero; the encoder is zeroed before."""
    mechanics = true_rig.mechanics(rig)
    time = np.arange(round(SWEEP_LEG * (len(SWEEP) - 1) * SWEEP_RATE)) / SWEEP_RATE
    torque = np.interp(time, SWEEP_LEG * np.arange(len(SWEEP)), SWEEP)
    angle = -quasi_static_torsion(mechanics.mesh, 0.0, torque, mechanics.output.coulomb)
    angle += rig.torsion_angle_noise * rng.standard_normal(len(time))
    reading = (1.0 + errors.output_gain) * torque + errors.output_zero
    reading += rig.output_torque_noise * rng.standard_normal(len(time))
    return TorsionRecord("torsion_locked_input", "train", SWEEP_RATE, time, angle, reading)


@dataclass(frozen=True)
class TorqueErrors:
    """Gain (relative) and zero (N.m) errors of both torque sensors, constant in a campaign."""

    input_gain: float
    input_zero: float
    output_gain: float
    output_zero: float


def draw_torque_errors(rig: Rig, rng: np.random.Generator) -> TorqueErrors:
    """Draw gain and zero errors uniformly within what the rig is believed to keep."""
    share = rng.uniform(-1.0, 1.0, 4)
    return TorqueErrors(
        float(share[0] * rig.input_torque_gain),
        float(share[1] * rig.input_torque_zero),
        float(share[2] * rig.output_torque_gain),
        float(share[3] * rig.output_torque_zero),
    )


def measure(
    samples: NDArray[np.float64],
    ratio: float,
    rig: Rig,
    errors: TorqueErrors,
    samples_averaged: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return what the four sensors give: noise, quantisation, gain, zero, then the average.

    Parameters
    ----------
    samples : ndarray, shape (4, n * samples_averaged)
        Raw input angle, output angle (as the encoder shows it), input and output torque.
    ratio : float
        Noise and quantisation of the input encoder are this many times those of the output.
    rig : Rig
    errors : TorqueErrors
    samples_averaged : int
    rng : numpy.random.Generator

    Returns
    -------
    ndarray, shape (4, n)
    """
    stds = np.array(
        [rig.angle_noise * ratio, rig.angle_noise, rig.input_torque_noise, rig.output_torque_noise]
    )
    gains = np.array([1.0, 1.0, 1.0 + errors.input_gain, 1.0 + errors.output_gain])
    zeros = np.array([0.0, 0.0, errors.input_zero, errors.output_zero])
    raw = gains[:, None] * samples + zeros[:, None]
    raw += stds[:, None] * rng.standard_normal(samples.shape)
    if rig.angle_quantisation > 0.0:
        steps = rig.angle_quantisation * np.array([[ratio], [1.0]])
        raw[:2] = np.rint(raw[:2] / steps) * steps
    rows: NDArray[np.float64] = raw.reshape(4, -1, samples_averaged).mean(axis=2)
    return rows
