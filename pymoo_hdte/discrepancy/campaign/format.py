"""Names of the campaign format: ``campaign.toml`` and a file for each record.

What they mean, with units and signs, stands in ``docs/campaign_format.md``. The believed drive is a
model: values, each with the relative tolerance that a fit keeps, and effects whose values are kept.
The inertia of the load and the damping of the torsion are values, also where a model file has them
as effects.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from pymoo_hdte.io.layout import Channel, TableLayout
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
"""Key of the place of the output's torque sensor, which is no number; absent for the usual one."""

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
"""Channel of the drive's temperature, of which a record has the mean; or else its field has it."""
TEMPERATURE_FIELD = "temperature_C"

TRANSMISSION_ERROR = "transmission_error"
"""Channel of a measured transmission error, in the place of one of the angles."""

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
