"""Names of the campaign format: ``campaign.toml`` and a file for each record.

What they mean, with units and signs, stands in ``docs/campaign_format.md``. The believed drive is a
model: values, each with the relative tolerance that a fit keeps, and effects whose values are kept.
The inertia of the load and the damping of the torsion are values, also where a model file has them
as effects.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar

from pymoo_hdte._io.fields import Fields
from pymoo_hdte._io.layout import Channel, TableLayout
from pymoo_hdte.checks import Complaints, InvalidInput, real_number
from pymoo_hdte.discrepancy._records.believed import BelievedDrive, Rig
from pymoo_hdte.discrepancy._records.records import RunningRecord, TorsionRecord
from pymoo_hdte.units import factor_of_name

CAMPAIGN_FILE = "campaign.toml"

ENDING = ".csv.gz"
"""Ending of the file of a written record, after the name of the record."""
PLAIN_ENDING = ".csv"
"""Alternative ending, which can be read only."""

Names = Mapping[str, tuple[str, float]]
"""For each attribute its name in the file and the factor to SI units."""


def _named(**names: str) -> Names:
    return {attribute: (name, factor_of_name(name)) for attribute, name in names.items()}


BELIEVED = _named(
    ratio="ratio",
    stiffness="stiffness_Nm_per_rad",
    damping="damping_output_Nms_per_rad",
    input_inertia="input_inertia_kgm2",
    input_damping="input_damping_Nms_per_rad",
    output_damping="output_damping_Nms_per_rad",
    output_inertia="output_inertia_kgm2",
    load_inertia="load_inertia_kgm2",
    error_orders="static_error_orders",
    error_amplitudes="static_error_amplitudes_arcsec",
    tolerance="tolerance",
    error_tolerance="static_error_tolerance",
)

RIG = _named(
    proportional="proportional_Nms_per_rad",
    integral="integral_Nm_per_rad",
    angle_noise="angle_noise_arcsec",
    angle_quantisation="angle_quantisation_arcsec",
    input_torque_noise="input_torque_noise_Nm",
    input_torque_gain="input_torque_gain",
    input_torque_zero="input_torque_zero_Nm",
    output_torque_noise="output_torque_noise_Nm",
    output_torque_gain="output_torque_gain",
    output_torque_zero="output_torque_zero_Nm",
    repeatability="repeatability_arcsec",
    torsion_angle_noise="torsion_angle_noise_arcsec",
)

SENSOR_PLACE = "output_torque_at"
"""Key of the place of the output's torque sensor, a word; absent for the usual place."""

MOTOR = ("motor_poles", "motor_slots")
"""Keys of the numbers of a motor, both or neither."""

GOOD_ENOUGH = _named(
    good_enough_error="good_enough_arcsec",
    good_enough_torque="good_enough_N_m",
)

RUNNING = _named(
    input_speed="input_speed_rpm",
    load_torque="load_torque_Nm",
    sample_rate="sample_rate_Hz",
    samples_averaged="samples_averaged",
    elapsed="elapsed_s",
)

RANGES = {
    "input_speed_range_rpm": ("input_speed", "speed_range"),
    "load_torque_range_Nm": ("load_torque", "load_range"),
}
"""Fields that may stand in the place of a condition, in its unit: the lowest and highest mean."""

TORSION = _named(sample_rate="sample_rate_Hz")

# Numbers of decimals, chosen far below the noise of any sensor.
COLUMNS = {
    "time": ("time_s", 6),
    "input_angle": ("input_angle_rad", 9),
    "output_angle": ("output_angle_rad", 11),
    "input_torque": ("input_torque_Nm", 6),
    "output_torque": ("output_torque_Nm", 5),
}

TEMPERATURE = "temperature"
"""Channel of the drive's temperature, whose mean a record keeps; `TEMPERATURE_FIELD` replaces
it."""
TEMPERATURE_FIELD = "temperature_C"

SERIES = "series"
"""Key of the series of measurements to which a running record belongs; 1 where it is absent."""

TRANSMISSION_ERROR = "transmission_error"
"""Channel of a measured transmission error, which replaces one of the angles."""

LAYOUT = TableLayout(
    format="csv",
    channels={
        channel: Channel(column, unit)
        for channel, unit in (
            ("input_angle", "rad"),
            ("output_angle", "rad"),
            ("input_torque", "N.m"),
            ("output_torque", "N.m"),
        )
        for column, _ in (COLUMNS[channel],)
    }
    # No column has these unless the campaign says which.
    | {TEMPERATURE: Channel("", "C"), TRANSMISSION_ERROR: Channel("", "rad")},
    time=Channel(COLUMNS["time"][0], "s"),
    sample_rate=None,
    skip_rows=0,
)
"""The columns of a file for which the campaign states none."""

CONTROL = re.compile(
    r"\bT\s*=\s*(\S+?)\s*\*\s*\(w_set - w\)\s*\+\s*(\S+?)\s*\*\s*integral\(w_set - w\)"
)
"""The sentence that may replace the two numbers of the speed loop."""


Checked = TypeVar("Checked", BelievedDrive, Rig, RunningRecord | TorsionRecord)


def in_units(values: Any, names: Names) -> dict[str, Any]:
    """Return the attributes of an object under the names and in the units of the file."""

    def rounded(value: Any, factor: float) -> Any:
        if isinstance(value, tuple):
            return [rounded(item, factor) for item in value]
        # Twelve digits hide the rounding of the conversion and exceed the accuracy of any value.
        digits = f"{value / factor:.12g}"
        return int(digits) if digits.lstrip("-").isdigit() else float(digits)

    return {key: rounded(getattr(values, name), factor) for name, (key, factor) in names.items()}


def build(kind: type[Checked], names: Names, table: Fields, place: str, **known: Any) -> Checked:
    """Build a checked object from a table; its errors name the field as the file does."""
    optional = {field.name for field in fields(kind) if field.default is not MISSING}
    values = dict(known)
    complaints = Complaints()
    for attribute, (key, factor) in names.items():
        if attribute in known or (attribute in optional and not table.has(key)):
            continue
        with complaints.noted():
            values[attribute] = _si(table.take(key, "a number"), f"{place}.{key}", factor)
    with complaints.noted():
        table.finish()
    complaints.finish()
    try:
        return kind(**values)
    except InvalidInput as error:
        if error.field not in names:
            raise
        raise placed_in_table(error, error.field, names, place) from None


def _si(raw: Any, field: str, factor: float) -> Any:
    """Return a number or a tuple of numbers in SI units; whole numbers without unit stay whole."""
    if isinstance(raw, list):
        return tuple(_number_in_si(item, field, factor) for item in raw)
    return _number_in_si(raw, field, factor)


def _number_in_si(raw: Any, field: str, factor: float) -> float:
    number = real_number(field, raw) * factor
    return raw if isinstance(raw, int) and factor == 1.0 else number


def placed_in_table(error: InvalidInput, attribute: str, names: Names, place: str) -> InvalidInput:
    """Return an error about an attribute as one about its field in the file, in its unit."""
    key, factor = names[attribute]
    value = error.value
    if isinstance(value, float):
        value /= factor
    elif isinstance(value, tuple):
        value = tuple(number / factor for number in value)
    return InvalidInput(f"{place}.{key}", value, error.allowed)
