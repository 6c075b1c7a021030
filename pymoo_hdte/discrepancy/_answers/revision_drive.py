"""The revised model: the believed drive with fitted values and the named effects, as a drive model.

It is an ordinary `DriveModel`, for simulation, surrogate and `RobustDTE` alike, and is written as
two TOML files that `load_datasheet` and `load_model` read back: the data sheet, and the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._records.believed import BelievedDrive
from pymoo_hdte.discrepancy._records.believed_model import LEAST
from pymoo_hdte.discrepancy._records.campaign import Campaign
from pymoo_hdte.discrepancy._records.known_values import with_known_values
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.drive import (
    DampingReference,
    DataSheet,
    DriveEffect,
    DriveModel,
    KinematicError,
    LoadInertia,
    OrderSpectrum,
    hs_20_100,
)
from pymoo_hdte.drive._solve.order_spectrum import sine_phasor
from pymoo_hdte.drive.datasheet import Nominal
from pymoo_hdte.effects.effect import Place, place_of
from pymoo_hdte.units import ARCSEC

SHEET_FILE = "revised_model_sheet.toml"
MODEL_FILE = "revised_model.toml"

_LEAST_SCATTER = 1e-3
"""Least relative scatter of the static error over prototypes."""
_LARGEST_TOOTH_DIVISOR = 100


def revised_model(finding: DriveFinding) -> DriveModel:
    """Return the drive with its fitted values and the named effects.

    Effects enter where the verdict names them (`EXPLAINED`); otherwise only the base parameters
    change, and ``description`` says so. Errors as in `drive_model`.
    """
    verdict = finding.verdict
    fitted = verdict.accepted
    if fitted.candidates:
        labels = ", ".join(candidate.label for candidate in fitted.candidates)
        what = f"the nominal drive with {labels}, all values fitted"
    elif verdict.status == "adequate":
        what = "the nominal drive with fitted values; nothing is missing"
    else:
        what = "the nominal drive with fitted values; the missing effect is outside the library"
    if finding.campaign.believed.effects:
        names = ", ".join(effect.name for effect in finding.campaign.believed.effects)
        what = f"{what}; {names} as stated"
    return drive_model(finding.campaign, fitted, "revised", what)


def drive_model(campaign: Campaign, fitted: Fit, name: str, description: str) -> DriveModel:
    """Return a fit as a drive model under the campaign's hardest condition.

    Its motor has constant torque, as Eq. (9) has it; the rig's speed loop is no part of the drive.

    Raises
    ------
    InvalidInput
        If the ratio is not one of whole tooth numbers, the static error is zero, or a name stands
        twice at one port.
    """
    names = [parameter.name for parameter in fitted.parameters]
    values = dict(zip(names, fitted.values.tolist(), strict=True))
    # One that is believed to be nothing is fitted within 1e-12 of it, to either side.
    values["load_inertia"] = max(values["load_inertia"], 0.0)
    believed = campaign.believed
    lines = range(len(believed.error_orders))
    amplitudes = [values[f"error_amplitude_{line}"] for line in lines]
    phases = [values[f"error_phase_{line}"] for line in lines]
    static_error = _peak_to_peak(believed, amplitudes, phases)
    scatter = max(believed.error_tolerance, _LEAST_SCATTER)
    return DriveModel(
        name=name,
        description=f"{campaign.drive}: {description}. The load of the rig is its load inertia.",
        provenance=(
            f"Fitted to the campaign {campaign.title!r}. The scatter of theta_s over prototypes is "
            "not measured by one rig: three standard deviations are its tolerance, "
            f"{100.0 * scatter:.0f} %."
        ),
        sheet=_sheet(campaign, values, static_error),
        kinematic_error=KinematicError(
            orders=believed.error_orders,
            # In arcsec for the reader: only their proportions count.
            amplitudes=tuple(amplitude / ARCSEC for amplitude in amplitudes),
            phases=tuple(phases),
            reading="peak_to_peak",
            std=scatter * static_error / 3.0,
        ),
        effects=_merged(
            (*with_known_values(believed.effects, values), *fitted.effects),
            values["load_inertia"],
            believed.ratio,
        ),
    )


def _peak_to_peak(believed: BelievedDrive, amplitudes: list[float], phases: list[float]) -> float:
    phasors = sine_phasor([amplitudes], phases)
    spectrum = OrderSpectrum(np.array(believed.error_orders), phasors)
    return float(spectrum.peak_to_peak(believed.ratio)[0])


def _merged(
    effects: tuple[DriveEffect, ...], load_inertia: float, ratio: float
) -> tuple[DriveEffect, ...]:
    """Return all effects, those of the believed drive included; a model takes each once."""
    merged: dict[Place, DriveEffect] = {}
    believed = (LoadInertia(load_inertia), DampingReference(1.0))
    for effect in (*believed, *(effect.on_sheet(ratio) for effect in effects)):
        place = place_of(effect)
        merged[place] = merged[place].joined(effect) if place in merged else effect
    return tuple(merged.values())


def _sheet(campaign: Campaign, values: Mapping[str, float], static_error: float) -> DataSheet:
    """Return the data sheet; B_fc is c / N^2, as `_merged` refers it to the output again."""
    believed, reference = campaign.believed, hs_20_100()
    # The two gears differ by two teeth in every strain wave gear of whole or half ratio.
    teeth = Fraction(2.0 * believed.ratio).limit_denominator(_LARGEST_TOOTH_DIVISOR)
    circular_spline, difference = teeth.numerator, 2 * teeth.denominator
    if not np.isclose(circular_spline / difference, believed.ratio, rtol=1e-12):
        raise InvalidInput("ratio", believed.ratio, "a ratio of whole tooth numbers")
    return DataSheet(
        name=campaign.drive,
        source=(
            f"fitted to the campaign {campaign.title!r}; mesh and error sources are those of "
            f"{reference.name}, which the equations of motion do not use"
        ),
        flexspline_teeth=circular_spline - difference,
        circular_spline_teeth=circular_spline,
        # A campaign says no more than the ratio; lines of the static error stand in the model.
        held="flexspline",
        orders_as_held="circular_spline",
        input_speed=max(abs(record.input_speed) for record in campaign.running),
        load_torque=max(abs(record.load_torque) for record in campaign.running),
        nominal=Nominal(
            static_error=static_error,
            stiffness=values["stiffness"],
            input_inertia=values["input_inertia"],
            input_damping=max(values["input_damping"], LEAST),
            mesh_damping=max(values["damping"], LEAST) / believed.ratio**2,
            output_inertia=believed.output_inertia,
            output_damping=max(values["output_damping"], LEAST),
        ),
        mesh=reference.mesh,
        error_sources=reference.error_sources,
    )
