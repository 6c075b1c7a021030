"""The kinematic error theta_s of a drive: which orders it has, and how it scatters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, one_of, real_number
from pymoo_hdte.drive._solve.order_spectrum import OrderSpectrum, sine_phasor

_READINGS = {"peak_to_peak": 1.0, "semi_amplitude": 2.0}


@dataclass(frozen=True)
class KinematicError:
    """Shape and scatter of theta_s = sum_j a_j sin(o_j theta_in + phi_j), as Eq. (1) has it.

    Attributes
    ----------
    orders, amplitudes, phases : tuple of float, length n_orders
        o_j in cycles per input turn; a_j relative to each other; phi_j in rad.
    reading : str
        What the value theta_s measures: the ``"peak_to_peak"`` of the sum over one output turn, or
        its ``"semi_amplitude"``, half of that.
    std : float
        Standard deviation of theta_s over prototypes (before truncation at 3 std), rad.

    Raises
    ------
    InvalidInput
        For another reading, lists of different lengths, a number that is not finite or out of
        range, or amplitudes that are all 0.

    Examples
    --------
    >>> error = preset("calibrated").kinematic_error
    >>> error.orders, error.reading
    ((1.0, 2.0, 2.02), 'semi_amplitude')
    """

    orders: tuple[float, ...]
    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]
    reading: str
    std: float

    def __post_init__(self) -> None:
        one_of("kinematic_error.reading", self.reading, tuple(_READINGS))
        real_number("kinematic_error.std", self.std, above=0.0)
        orders = finite_array("kinematic_error.orders", self.orders, (None,))
        if not orders.size or np.any(orders <= 0.0):
            raise InvalidInput("kinematic_error.orders", self.orders, "one or more, above 0")
        for name in ("amplitudes", "phases"):
            finite_array(f"kinematic_error.{name}", getattr(self, name), (len(orders),))
        if min(self.amplitudes) < 0.0 or max(self.amplitudes) == 0.0:
            raise InvalidInput(
                "kinematic_error.amplitudes", self.amplitudes, "at least 0, not all 0"
            )

    def unit_phasors(self, ratio: float) -> NDArray[np.complex128]:
        """Return the phasors of the error per rad of its value theta_s.

        Parameters
        ----------
        ratio : float
            Transmission ratio N, dimensionless.

        Returns
        -------
        ndarray of complex, shape (n_orders,)
            p_j, dimensionless: the error is its value times Re sum_j p_j exp(i o_j theta_in).

        Raises
        ------
        InvalidInput
            If the ratio is not above 0, or the lines cancel each other.
        """
        phasors = sine_phasor(self.amplitudes, self.phases)
        shape = OrderSpectrum(np.array(self.orders), phasors[None, :])
        peak_to_peak = shape.peak_to_peak(ratio)[0]
        if peak_to_peak <= 1e-9 * sum(self.amplitudes):
            raise InvalidInput("kinematic_error", self, "lines that do not cancel each other")
        return phasors * _READINGS[self.reading] / peak_to_peak
