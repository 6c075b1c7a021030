"""Coefficients of the equations of motion, Eq. (9) with the terms that effects add to it.

    J_in  th_in''  + B_in  th_in'  + (k d + c d') / N = T_in(t)
    J_out th_out'' + B_out th_out' - (k d + c d')     = -T_L(t)
    d = th_in / N - th_out - th_s(th_in),   k = K (1 + kappa cos(2 th_in + psi))

`steady_state` and `time_domain` both solve these equations, so a term stands here once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Coefficients:
    """Coefficients of n designs under one operating condition, SI units.

    Attributes
    ----------
    ratio, input_speed, load_torque : float
        N; mean speed of the input in rad/s; T_L in N.m.
    stiffness, damping : ndarray, shape (n,)
        Mean K and c between input (referred to the output) and output.
    stiffness_depth, stiffness_phase : float
        kappa and psi of the stiffness variation; kappa is 0 where the stiffness is constant.
    input_inertia, input_damping : ndarray, shape (n,)
    output_inertia, output_damping : float
    error_orders : ndarray, shape (n_orders,)
        Orders of theta_s in cycles per input turn.
    error_phasors : ndarray of complex, shape (n, n_orders)
        theta_s = Re sum phasor exp(i order theta_in), rad.
    """

    ratio: float
    input_speed: float
    load_torque: float
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]
    stiffness_depth: float
    stiffness_phase: float
    input_inertia: NDArray[np.float64]
    input_damping: NDArray[np.float64]
    output_inertia: float
    output_damping: float
    error_orders: NDArray[np.float64]
    error_phasors: NDArray[np.complex128]

    @property
    def mean_mesh_torque(self) -> float:
        """Mean of k d + c d' in steady state: load and bearing friction, N.m at the output."""
        return self.load_torque + self.output_damping * self.input_speed / self.ratio
