"""Static transmission error of prototypes, Eqs. (1) and (2): thirteen sources, five classes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Parts of SciPy load when they are first used: signals and statistics take longer than a study.
import scipy
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, one_of, whole_number
from pymoo_hdte.drive._solve.order_spectrum import OrderSpectrum
from pymoo_hdte.drive.datasheet import ERROR_CLASSES, DataSheet
from pymoo_hdte.units import ARCSEC

TRUNCATION = 3.0
"""Errors are drawn within this many standard deviations (Section 2.1)."""

_ARCSEC_MM_PER_UM = 412.8
"""Eq. (2): arcsec at the output per micrometre at the mesh and per millimetre of diameter."""


@dataclass(frozen=True)
class StaticErrorSample:
    """Static errors of n virtual prototypes, Eqs. (1) and (2).

    Attributes
    ----------
    sheet : DataSheet
        Whose error sources they are.
    magnitudes : ndarray, shape (n, n_sources)
        Size of each error source, m.
    phases : ndarray, shape (n, n_sources)
        Initial phase of each error source, rad.

    Examples
    --------
    >>> sample = sample_static_error(hs_20_100(), 5, np.random.default_rng(1))
    >>> sample.peak_to_peak().shape
    (5,)
    """

    sheet: DataSheet
    magnitudes: NDArray[np.float64]
    phases: NDArray[np.float64]

    def class_phasor(self, error_class: str) -> NDArray[np.complex128]:
        """Return the resultant of the sources of one class (Eqs. 1 and 2).

        Parameters
        ----------
        error_class : {"e_m", "e_g", "e_w", "e_p", "e_h"}
            Class of the static error, Eq. (1).

        Returns
        -------
        ndarray of complex, shape (n,)
            rad at the output; its angle is the phase phi of ``|phasor| sin(order theta_in + phi)``.

        Raises
        ------
        InvalidInput
            For another class.
        """
        one_of("error_class", error_class, ERROR_CLASSES)
        member = [source.error_class == error_class for source in self.sheet.error_sources]
        vectors = self.magnitudes[:, member] * np.exp(1j * self.phases[:, member])
        return _output_angle(self.sheet, error_class) * vectors.sum(axis=1)

    def spectrum(self, classes: tuple[str, ...] = ERROR_CLASSES) -> OrderSpectrum:
        """Return theta_s over theta_in, rad, as an order spectrum of n rows (Eqs. 1 and 2).

        Parameters
        ----------
        classes : tuple of str
            Classes of Eq. (1) that take part, all by default.

        Returns
        -------
        OrderSpectrum

        Raises
        ------
        InvalidInput
            For no class or one that does not exist.
        """
        if not classes:
            raise InvalidInput("classes", classes, f"one or more of {', '.join(ERROR_CLASSES)}")
        for name in classes:
            one_of("error class", name, ERROR_CLASSES)
        orders = np.array([self.sheet.error_orders[name] for name in classes])
        sines = np.stack([self.class_phasor(name) for name in classes], axis=1)
        return OrderSpectrum(orders, -1j * sines)

    def peak_to_peak(self, classes: tuple[str, ...] = ERROR_CLASSES) -> NDArray[np.float64]:
        """Return the peak-to-peak of theta_s over one output turn, shape (n,), rad.

        Parameters and errors as in `spectrum`.
        """
        return self.spectrum(classes).peak_to_peak(self.sheet.ratio)


def sample_static_error(
    sheet: DataSheet, n_samples: int, rng: np.random.Generator
) -> StaticErrorSample:
    """Draw prototypes: truncated normal errors, independent uniform phases (Section 2.1).

    Parameters
    ----------
    sheet : DataSheet
        Means and standard deviations of the error sources (Table 2).
    n_samples : int
        Number of prototypes n, at least 1.
    rng : numpy.random.Generator
        Source of the randomness.

    Returns
    -------
    StaticErrorSample

    Raises
    ------
    InvalidInput
        If ``n_samples`` is below 1.

    Examples
    --------
    >>> sample = sample_static_error(hs_20_100(), 500, np.random.default_rng(1))
    >>> sample.magnitudes.shape[0]
    500
    """
    n_samples = whole_number("n_samples", n_samples, 1)
    means = np.array([source.mean for source in sheet.error_sources])
    stds = np.array([source.std for source in sheet.error_sources])
    shape = (n_samples, len(means))
    standard = scipy.stats.truncnorm.rvs(-TRUNCATION, TRUNCATION, size=shape, random_state=rng)
    return StaticErrorSample(sheet, means + stds * standard, rng.uniform(0.0, 2.0 * np.pi, shape))


def class_amplitudes(sheet: DataSheet) -> dict[str, float]:
    """Return each class's amplitude at the output, rad: root sum of squares of its mean errors.

    The square is the expected squared resultant of sources with independent uniform phases, but for
    the variances of the magnitudes. The angle at the output is that of Eq. (2), mesh to output.

    Parameters
    ----------
    sheet : DataSheet
        Mean errors (Table 2) and the constants of Eq. (2), from mesh to output.

    Returns
    -------
    dict of str to float
        rad, by class of the static error, Eq. (1).

    Examples
    --------
    >>> amplitudes = class_amplitudes(hs_20_100())
    >>> len(amplitudes), min(amplitudes.values()) > 0.0
    (5, True)
    """
    squares = dict.fromkeys(ERROR_CLASSES, 0.0)
    for source in sheet.error_sources:
        squares[source.error_class] += source.mean**2
    return {name: _output_angle(sheet, name) * square**0.5 for name, square in squares.items()}


def _output_angle(sheet: DataSheet, error_class: str) -> float:
    """Return rad at the output per metre of error in this class (Table 1 and Eq. 2)."""
    mesh = sheet.mesh
    projection = 0.5 if error_class in ("e_p", "e_h") else float(np.cos(mesh.pressure_angle))
    averaging = mesh.error_influence / mesh.teeth_in_mesh**0.5
    return projection * averaging * _ARCSEC_MM_PER_UM * 1e3 / mesh.pitch_diameter * ARCSEC
