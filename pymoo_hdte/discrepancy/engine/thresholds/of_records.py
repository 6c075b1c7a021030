"""Rules for accepting believed values and records, and for counting a line as seen."""

from __future__ import annotations

from dataclasses import dataclass

from pymoo_hdte.discrepancy.engine.thresholds.fields import BY_HAND, RuleSet, rule
from pymoo_hdte.units import ARCSEC


@dataclass(frozen=True, kw_only=True)
class RecordRules(RuleSet):
    """Thresholds for refusing believed values and records, leaving records out, and seeing lines.

    See `rules.Rules`, which has them all.
    """

    # Plausibility of numbers: wide enough for every effect that a campaign may contain.
    largest_transmission_error: float = rule(
        0.02,
        "rad",
        "Larger transmission errors and amplitudes of the static error are refused.",
        f"{BY_HAND}: ten times the wind-up of the drive of the paper at its rated torque; angles "
        "in degrees are 57 times too large.",
    )
    least_error_amplitude: float = rule(
        1e-3 * ARCSEC,
        "rad",
        "Smaller amplitudes of the believed static error that are not zero are refused.",
        f"{BY_HAND}: 0.001 arcsec; no encoder would show a smaller line.",
    )
    largest_twist: float = rule(
        0.1,
        "rad",
        "A believed stiffness that the largest load would twist further is refused.",
        f"{BY_HAND}: thirty times the wind-up of catalogued drives at their rated torque; a "
        "stiffness whose 10^4 was overlooked gives 10 rad and more.",
    )
    least_natural_frequency: float = rule(
        0.5,
        "Hz",
        "An inertia that would swing on the mesh more slowly is refused.",
        f"{BY_HAND}: those of the drive of the paper swing at 18, 90 and 900 Hz; g.cm2 for kg.m2 "
        "lower a frequency 3000-fold.",
    )
    least_tolerance: float = rule(
        1e-3,
        "1",
        "Smaller tolerances of beliefs are refused.",
        f"{BY_HAND}: no parameter of a drive is known better, and a base held fixed turns its own "
        "errors into effects.",
    )
    overstated_noise_ratio: float = rule(
        30.0,
        "ratio of standard deviations",
        "A stated noise that exceeds what the rows of all records show by more is refused.",
        f"{BY_HAND}: a wrong unit is off by 57 or 1000.",
        at_least=1.0,
    )
    speed_mismatch: float = rule(
        0.1,
        "relative",
        "Largest difference of the mean speed of a record from the one that it states.",
        f"{BY_HAND}: the next wrong unit, rad/s for r/min, is a factor of ten.",
        at_most=1.0,
    )
    slope_mismatch: float = rule(
        5.0,
        "ratio",
        "Largest factor between the slope of a torsion sweep and the believed compliance.",
        f"{BY_HAND}: wide enough for a soft wind-up or a clearance; a wrong unit is off by 57 or "
        "1000.",
        at_least=1.0,
    )
    load_mismatch: float = rule(
        0.3,
        "share of the load",
        "Largest difference of a mean torque from what the load asks for, and the least share of "
        "it that the motor supplies.",
        f"{BY_HAND}: gains and ripples of sensors are smaller, a channel swapped is larger.",
        at_most=1.0,
    )
    torque_mismatch: float = rule(
        10.0,
        "ratio",
        "Multiple of the load at the input, and of the zero error of a sensor, that a torque may "
        "have besides.",
        f"{BY_HAND}: drives of this kind lose less to friction; N.mm for N.m is a factor of 1000.",
        at_least=1.0,
    )
    fewest_records: int = rule(
        3,
        "1",
        "Fewer records to be fitted are refused.",
        f"{BY_HAND}: with fewer, what changes with speed or load cannot be told from the base "
        "parameters.",
    )

    # Which lines of a drive are analysed, and which count as seen?
    highest_order: float = rule(
        14.0,
        "cycles per input turn",
        "Lines are looked at up to this order.",
        f"{BY_HAND} as a budget of time; the report says where a harmonic may lie above.",
    )
    line_separation: float = rule(
        0.9,
        "cycles in the record or output turn",
        "Least distance of two order lines that are fitted side by side.",
        "Resolution: two lines a whole cycle apart are orthogonal; a record may fall short of a "
        "whole turn by a little.",
    )
    nyquist_share: float = rule(
        0.9,
        "share of the Nyquist order",
        "Order up to which the rows of a record show lines.",
        f"{BY_HAND}: closer to it, rows hardly tell sine from cosine.",
        at_most=1.0,
    )
    unexpected_line_chance: float = rule(
        1e-3,
        "probability",
        "Chance that noise alone shows any line beyond the expected ones in a whole campaign.",
        "Test level: the power of a line is exponential under noise (Scargle, Astrophysical "
        "Journal 263, 1982), and all lines of all records share the chance (Bonferroni).",
        at_most=1.0,
    )
    most_unexpected_lines: int = rule(
        6,
        "1",
        "Most unexpected orders that are added to those looked at.",
        f"{BY_HAND} as a budget of time.",
    )
    order_line_chance: float = rule(
        1e-6,
        "probability",
        "Chance that noise alone makes a line strong enough to bring candidates of its order.",
        "Test level by the chi-square distribution: 2e-5 for all of some 20 orders of a campaign.",
        at_most=1.0,
    )
    second_speed_chance: float = rule(
        0.01,
        "probability",
        "Chance that noise alone makes a line of one speed seem to be one of two.",
        "Test level by the chi-square distribution; what is seen at one speed is a frequency.",
        at_most=1.0,
    )
    most_order_lines: int = rule(
        4,
        "1",
        "Most orders of strong lines that bring candidates.",
        f"{BY_HAND} as a budget of time.",
    )

    # What else the records of a drive must show.
    least_held_load: float = rule(
        0.5,
        "N.m at a torque scale of 1",
        "A record of a drive with clearance is left out if its load is smaller, or does not exceed "
        "the swing of its torque: the tooth flanks are not held together.",
        f"{BY_HAND}: a few times what the zero of a torque sensor is known to.",
    )
    rattling_lines: int = rule(
        8,
        "lines",
        "From so many lines that no steady motion has on, a record does not repeat.",
        "Simulation: in 15 seen campaigns of a test bench with a soft wind-up no record had any; "
        "of 22 with a clearance 13 had a record with 12 to 422, and the others a clearance with a "
        "soft skin, strong friction or lines everywhere.",
    )
    rattling_trace: int = rule(
        2,
        "lines",
        "So many of these lines have to be in several records; see `fewest_rattling`.",
        "Simulation: 12 of the same campaigns with a clearance have so many; noise alone shows "
        "one line in a thousand campaigns.",
    )
    fewest_rattling: int = rule(
        2,
        "records",
        "Records without load that do not repeat, from which a clearance is taken to be evident.",
        f"{BY_HAND}: one record may be disturbed; that two without load are, and none with load, "
        "is what flanks do that part.",
    )
    least_temperature_spread: float = rule(
        3.0,
        "K",
        "Friction that depends on temperature is looked for if the records' temperatures spread by "
        "this.",
        f"{BY_HAND}: greases and oils lose 3 to 7 % of their viscosity per kelvin, so that viscous "
        "friction changes by 10 to 20 %, as much as it is usually believed to; a sensor on the "
        "housing follows the lubricant no better than to a kelvin or two.",
    )
    sweep_gain: float = rule(
        50.0,
        "chi-square",
        "Reduction of the chi-square of the torsion sweeps with which they speak for an effect.",
        f"{BY_HAND}: seven standard deviations of one unknown, since what stands on it is whether "
        "records are left out.",
    )
    changed_noise_ratio: float = rule(
        1.5,
        "ratio of variances",
        "The verdict is repeated with the noise that the named effect carries to the channels, if "
        "a variance grows by more than this; for a single effect already before others are sought.",
        f"{BY_HAND}: chi-square of the feature that it moves most is then off by half.",
        at_least=1.0,
    )

    # Machines other than a drive.
    noise_power_ratio: float = rule(
        2.0,
        "ratio of powers",
        "Up to here a force, or what a model leaves of one, may be that of the sensors.",
        f"{BY_HAND}: the noise of the sensors is an estimate from the same records.",
        at_least=1.0,
    )
    band_share: float = rule(
        0.2,
        "share of the power of a position",
        "Where more lies beyond a tenth of the sampling rate, records are interpolated to a finer "
        "rate; what is left beyond the band that is used is said.",
        f"{BY_HAND}: motions that are sampled finely have some per cent there, an oscillator at "
        "its resonance with nine samples in a period has 84 %.",
        at_most=1.0,
    )
    fewest_periods: float = rule(
        5.0,
        "periods in a record",
        "Fewer do not make an order of what varies with the position of a port.",
        f"{BY_HAND}: fewer may be a wander.",
    )
    position_order_chance: float = rule(
        1e-4,
        "probability",
        "Chance that noise alone shows an order in the middle of those that are looked at.",
        "Test level: the power over that of its surroundings follows a gamma distribution; all "
        "orders share the chance (Bonferroni). Near the ends it is larger. Orders that a gear is "
        "known to have share a chance of their own.",
        at_most=1.0,
    )
    most_position_orders: int = rule(
        6,
        "1",
        "Most orders of one port.",
        f"{BY_HAND} as a budget of time.",
    )
    most_tried_orders: int = rule(
        20_000,
        "1",
        "Most orders of one port that are tried beyond the band; where there were more, whole "
        "numbers are, up to an order that is said.",
        f"{BY_HAND} as a budget of time: a few seconds for a record of some ten thousand rows.",
    )
    interpolated_share: float = rule(
        0.3,
        "share of the sampling rate",
        "Frequency up to which the force of a record is looked at where its rows were not measured "
        "at even steps.",
        "Simulation: of a line there a cubic spline through rows with steps of half to one and a "
        "half of the mean keeps 93 % of the amplitude, at 0.45, near the Nyquist frequency, 57 %.",
        at_most=0.5,
    )
    slow_rows_share: float = rule(
        0.1,
        "share of the moving rows",
        "The highest order that is tried beyond the band is within it in this share of the rows.",
        f"{BY_HAND}: fewer rows show an order only if it is three times as large as it has to be "
        "in all of them, and orders that are hardly seen raise the limit of the others.",
        at_most=1.0,
    )
    side_lines: float = rule(
        2.5,
        "resolutions of an order",
        "So near to a stronger order none is looked for.",
        f"{BY_HAND}: the second side line of a travel that is passed evenly is at 2.5, with 2 % of "
        "the power.",
    )
    ripple_share: float = rule(
        1e-3,
        "share of the power beyond the band",
        "A ripple beyond the band of the motion is named if it takes away at least this share of "
        "the force where it was seen.",
        f"{BY_HAND}: 3 % of the amplitude. Long records show lines of a thousandth of it, which no "
        "use of a machine would notice.",
        at_least=0.0,
        at_most=1.0,
    )
    reverse_share: float = rule(
        0.01,
        "share of the way",
        "A port moves in two directions if it goes more than this share in the rarer one.",
        f"{BY_HAND}: the noise of a record at rest changes the sign of its speed now and then.",
        at_least=0.0,
        at_most=0.5,
    )
