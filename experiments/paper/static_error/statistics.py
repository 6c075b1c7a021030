"""Statistics of the static error of Eqs. (1) and (2) under every open reading of the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.stats import norm

from experiments.paper.bench.prototypes import draw_prototypes, plant_outliers, repeat_measurements
from experiments.published_values import TABLE_2
from pymoo_hdte.drive import StaticErrorSample, hs_20_100, sample_static_error
from pymoo_hdte.drive.datasheet import ERROR_CLASSES, DataSheet
from pymoo_hdte.identification import (
    ErrorStatistics,
    detectable_correlation,
    error_statistics,
    find_outliers,
)
from pymoo_hdte.identification.outliers import SIGMAS
from pymoo_hdte.units import ARCSEC

N_SAMPLES = 1000
SEED = 1
ANGLES = (0.0, 14.5, 20.0, 25.0, 28.6, 30.0)
"""Pressure angles of the flexspline's pitch circle, degrees; the paper prints none."""

ASSUMED_ANGLE = 20.0
"""Pressure angle of the data sheet, degrees."""

_TRIED = np.arange(0.0, 81.0, 10.0)
"""Pressure angles between which means are interpolated, degrees."""

TOOTH = "e_h"
SLOW = tuple(name for name in ERROR_CLASSES if name != TOOTH)

NORMAL_95 = 1.96

Values = NDArray[np.float64]


def sample_statistics(sample: StaticErrorSample) -> dict[str, Values]:
    """Return every statistic of theta_s that 36.251 arcsec might be, shape (n,) each, arcsec.

    The tooth order, 404, adds twice its amplitude to a peak-to-peak, less than 0.01 arcsec short of
    it: one of its peaks lies within half a tooth of every slow extreme.
    """
    spectrum = sample.spectrum(SLOW)
    amplitudes = np.stack(list(spectrum.amplitudes().values()), axis=1) / ARCSEC
    tooth = np.abs(sample.class_phasor(TOOTH)) / ARCSEC
    output_turn = spectrum.peak_to_peak(sample.sheet.ratio) / ARCSEC
    input_turn = spectrum.peak_to_peak(1.0) / ARCSEC
    total, power = amplitudes.sum(axis=1), (amplitudes**2).sum(axis=1) / 2.0
    return {
        "peak-to-peak, output turn": output_turn,
        "peak-to-peak, output turn, with order 404": output_turn + 2.0 * tooth,
        "peak-to-peak, one input turn": input_turn,
        "peak-to-peak, one input turn, with order 404": input_turn + 2.0 * tooth,
        "semi-amplitude, output turn": output_turn / 2.0,
        "semi-amplitude, output turn, with order 404": output_turn / 2.0 + tooth,
        "semi-amplitude, one input turn": input_turn / 2.0,
        "semi-amplitude, one input turn, with order 404": input_turn / 2.0 + tooth,
        "sum of the order amplitudes": total,
        "sum of the order amplitudes, with order 404": total + tooth,
        "rms": power**0.5,
        "rms, with order 404": (power + tooth**2 / 2.0) ** 0.5,
    }


@dataclass(frozen=True)
class Reading:
    """One way to read Eqs. (1) and (2): the factor on the motion error, and the phases.

    ``influence`` takes K_b and z_t to the factor; with ``one_phase`` the errors of a class share
    their phase, so that their sizes add up.
    """

    name: str
    influence: Callable[[float, int], float]
    one_phase: bool = False

    def sample(self, pressure_angle: float, prototypes: StaticErrorSample) -> StaticErrorSample:
        """Return the same prototypes under this reading and pressure angle, degrees."""
        mesh = prototypes.sheet.mesh
        factor = self.influence(mesh.error_influence, mesh.teeth_in_mesh)
        changed = replace(
            mesh,
            pressure_angle=np.deg2rad(pressure_angle),
            error_influence=factor * mesh.teeth_in_mesh**0.5,
        )
        sheet = replace(prototypes.sheet, mesh=changed)
        phases = _class_phases(prototypes) if self.one_phase else prototypes.phases
        return StaticErrorSample(sheet, prototypes.magnitudes, phases)


READINGS = (
    Reading("K_b / sqrt(z_t)", lambda k_b, z_t: k_b / z_t**0.5),
    Reading("sqrt(K_b / z_t)", lambda k_b, z_t: (k_b / z_t) ** 0.5),
    Reading("K_b / z_t", lambda k_b, z_t: k_b / z_t),
    Reading("K_b / sqrt(z_t), one phase a class", lambda k_b, z_t: k_b / z_t**0.5, one_phase=True),
)
"""The first is the one that this project uses."""


@dataclass(frozen=True)
class AngleRange:
    """Pressure angles, degrees, at which a statistic's mean is a wanted value.

    ``low`` and ``high`` bound what two samples of this size cannot tell apart (95 %); the range may
    exist where ``exact`` does not. None where there is no such angle.
    """

    exact: float | None
    low: float | None
    high: float | None


def prototypes() -> StaticErrorSample:
    """Draw the virtual prototypes of Section 2.1."""
    return sample_static_error(hs_20_100(), N_SAMPLES, np.random.default_rng(SEED))


def tooth_order_error(sample: StaticErrorSample) -> float:
    """Return by how much adding twice the tooth amplitude overstates the peak-to-peak, arcsec."""
    exact = sample.peak_to_peak() / ARCSEC
    return float(
        np.abs(sample_statistics(sample)["peak-to-peak, output turn, with order 404"] - exact).max()
    )


def angle_ranges(
    reading: Reading, drawn: StaticErrorSample, wanted: float
) -> dict[str, AngleRange]:
    """Return for every statistic the pressure angles that give the mean ``wanted``, arcsec."""
    samples = [sample_statistics(reading.sample(angle, drawn)) for angle in _TRIED]
    return {name: _angle_range([at[name] for at in samples], wanted) for name in samples[0]}


def _angle_range(samples: list[Values], wanted: float) -> AngleRange:
    """Return where the mean of a statistic, which falls with the angle, is ``wanted``."""
    excess = np.array([sample.mean() for sample in samples]) - wanted
    # The paper's mean rests on a sample of the same size.
    errors = np.array([sample.std(ddof=1) for sample in samples]) * (2.0 / N_SAMPLES) ** 0.5

    def root(values: Values) -> float | None:
        if values[0] < 0.0 or values[-1] > 0.0:
            return None
        return float(brentq(CubicSpline(_TRIED, values), _TRIED[0], _TRIED[-1]))

    low, high = root(excess - NORMAL_95 * errors), root(excess + NORMAL_95 * errors)
    return AngleRange(root(excess), 0.0 if low is None and high is not None else low, high)


def of_component(sample: StaticErrorSample, component: str) -> StaticErrorSample:
    """Return the prototypes with the errors of one component only."""
    member = np.array([s.component == component for s in sample.sheet.error_sources])
    return replace(sample, magnitudes=sample.magnitudes * member)


def components(sheet: DataSheet) -> tuple[str, ...]:
    """Return the components in the order of the data sheet."""
    return tuple(dict.fromkeys(source.component for source in sheet.error_sources))


def _class_phases(sample: StaticErrorSample) -> Values:
    classes = [source.error_class for source in sample.sheet.error_sources]
    return sample.phases[:, [classes.index(name) for name in classes]]


SYMBOLS = tuple(TABLE_2)
MEANS = np.array([row.mean_um for row in TABLE_2.values()])
STDS = np.array([row.std_um for row in TABLE_2.values()])

N_PROTOTYPES, N_REPEATS = 20, 10
NOISE_UM = 0.3
"""Of a single reading: the accuracy of the paper's measuring machine."""

N_OUTLIERS, OUTLIER_UM = 26, 2.0
PLANTED_PAIR, PLANTED_CORRELATION = ("e13", "e14"), 0.92
PLANTED_LOGNORMAL, LOG_STD = "e34", 1.2


@dataclass(frozen=True)
class OutlierCount:
    """What one rule found: planted outliers found, good readings lost."""

    found: int
    planted: int
    lost: int
    good: int


def clean_campaign(rng: np.random.Generator) -> ErrorStatistics:
    """Measure independent, normal prototypes as Table 2 describes them."""
    truth = draw_prototypes(MEANS, STDS, N_PROTOTYPES, rng)
    return error_statistics(repeat_measurements(truth, NOISE_UM, N_REPEATS, rng), SYMBOLS)


def spoilt_readings(
    rng: np.random.Generator, skewed: bool = True
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Measure prototypes with a planted correlation, lognormal error and outliers.

    Returns the readings, shape (n_prototypes, n_errors, n_repeats), and where the outliers are.
    """
    matrix = np.eye(len(SYMBOLS))
    i, j = (SYMBOLS.index(symbol) for symbol in PLANTED_PAIR)
    matrix[i, j] = matrix[j, i] = PLANTED_CORRELATION
    truth = draw_prototypes(MEANS, STDS, N_PROTOTYPES, rng, matrix)
    if skewed:
        at = SYMBOLS.index(PLANTED_LOGNORMAL)
        truth[:, at] = MEANS[at] * rng.lognormal(-(LOG_STD**2) / 2.0, LOG_STD, N_PROTOTYPES)
    readings = repeat_measurements(truth, NOISE_UM, N_REPEATS, rng)
    return plant_outliers(readings, N_OUTLIERS, OUTLIER_UM, rng)


def outlier_counts(
    readings: NDArray[np.float64], planted: NDArray[np.bool_]
) -> dict[str, OutlierCount]:
    """Count what the plain 3-sigma rule and the pooled one find."""
    deviation = np.abs(readings - readings.mean(axis=2, keepdims=True))
    plain = deviation > SIGMAS * readings.std(axis=2, ddof=1, keepdims=True)
    rules = {"sigma of the same ten readings": plain, "sigma pooled": find_outliers(readings)}
    return {
        rule: OutlierCount(
            found=int(np.sum(rejected & planted)),
            planted=int(np.sum(planted)),
            lost=int(np.sum(rejected & ~planted)),
            good=int(np.sum(~planted)),
        )
        for rule, rejected in rules.items()
    }


def detections(n_campaigns: int, rng: np.random.Generator) -> tuple[int, int]:
    """Count campaigns in which the planted pair is found, and those with any other pair."""
    pair = tuple(SYMBOLS.index(symbol) for symbol in PLANTED_PAIR)
    count = alarms = 0
    for _ in range(n_campaigns):
        readings, _ = spoilt_readings(rng, skewed=False)
        pairs = error_statistics(readings, SYMBOLS).correlated_pairs
        count += pair in pairs
        alarms += any(rival != pair for rival in pairs)
    return count, alarms


def power(correlation: float, n_prototypes: int) -> float:
    """Return the probability that a true correlation is significant among all pairs.

    By Fisher's z, to first order; Holm's first step is the one that counts.
    """
    limit = np.arctanh(detectable_correlation(n_prototypes, len(SYMBOLS)))
    return float(norm.sf((limit - np.arctanh(correlation)) * (n_prototypes - 3) ** 0.5))


def prototypes_needed(correlation: float, wanted: float = 0.9) -> int:
    """Return the least number of prototypes that find a true correlation with that power."""
    return next(n for n in range(5, 10_000) if power(correlation, n) >= wanted)
