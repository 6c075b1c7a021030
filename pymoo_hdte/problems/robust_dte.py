"""The robust DTE problem of Section 5.1 as a pymoo `Problem`."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, one_of, real_number, whole_number
from pymoo_hdte.drive import PARAMETER_UNITS, PARAMETERS, PRESETS, DriveModel, preset
from pymoo_hdte.problems.reference import ReferenceFront, load_reference
from pymoo_hdte.problems.robust import MOMENTS, RobustProblem, make_moments
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    TruncatedNormal,
    UniformBand,
)
from pymoo_hdte.units import ARCSEC

SURROGATE_BOX = 0.35
"""Half-width of the surrogate's box as a share of the nominal values (Section 3)."""

HIGHEST_ORDER = 6
"""At order 6 the surrogate takes 16,807 model runs; time and memory grow with the tenth power."""

DESIGN_VARIABLES = PARAMETERS[1:]
"""U = (K, J_in, B_in, B_fc) of Section 5.1; theta_s is noise."""


class RobustDTE(RobustProblem):
    """Minimise mean and standard deviation of the dynamic transmission error (DTE).

    Design variables are the nominal stiffness K and the nominal J_in, B_in and B_fc, each within
    ``box`` of its value in the data sheet. Around a design the four vary uniformly by
    ``tolerance``, while theta_s follows its truncated normal distribution; both objectives are
    moments of the DTE over that scatter, on a Chebyshev surrogate of the drive model.

    Parameters
    ----------
    model : str or DriveModel
        A preset (``"calibrated"``, ``"resonant"``, ``"published"``) or a model of your own.
        ``calibrated`` is the printed model plus named effects whose values were fitted to the
        published statistics; the printed model alone has next to no trade-off.
    order : int
        Order k of the surrogate, 1 to 6; the paper takes 3. It costs (k + 1)^5 model runs.
    moments : {"exact", "sample"}
        Integrate the surrogate exactly, or over common random numbers as the paper does.
    n_samples, sample_seed : int
        Number and seed of those samples; only used with ``moments="sample"``.
    tolerance : float
        Relative half-width of the band around a design.
    box : float
        Relative half-width of the search space.

    Attributes
    ----------
    model : DriveModel
    surrogate : ChebyshevSurrogate
        DTE in arcsec over ``PARAMETERS``. Its box is +-35 % (wider if box and tolerance reach
        further) in the four design variables and mean +- 3 std in theta_s.
    moments : ExactMoments or SampledMoments
    nominal : ndarray, shape (4,)
        The initial design.
    var_names, obj_names, units
        Names in the order of X and F, and the unit of each. X is in SI units, F in arcsec.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed, naming it, its value and what is; also for a model
        whose theta_s could become negative.
    UnstableDrive
        If the nominal design, or a corner or node of the surrogate's box, has no steady state.

    Notes
    -----
    A true front is stored for every preset under the other defaults; with any other setting
    ``pareto_front()`` and ``pareto_set()`` return None.

    In a real drive K and B_fc cannot be chosen independently: wall thickness and preload move both.
    """

    def __init__(
        self,
        model: str | DriveModel = "calibrated",
        order: int = 3,
        moments: str = "exact",
        n_samples: int = 1000,
        sample_seed: int = 1,
        tolerance: float = 0.05,
        box: float = 0.25,
    ) -> None:
        if not isinstance(model, DriveModel | str):
            raise InvalidInput("model", model, f"a DriveModel or one of {', '.join(PRESETS)}")
        self.model = model if isinstance(model, DriveModel) else preset(model)
        if whole_number("order", order, 1) > HIGHEST_ORDER:
            limit = f"1 to {HIGHEST_ORDER}, for (order + 1)^5 model runs"
            raise InvalidInput("order", order, limit)
        one_of("moments", moments, MOMENTS)
        n_samples = whole_number("n_samples", n_samples, 2)
        sample_seed = whole_number("sample_seed", sample_seed, 0)
        tolerance = real_number("tolerance", tolerance, above=0.0, below=1.0)
        box = real_number("box", box, above=0.0, below=1.0)
        self.nominal = self.model.nominal[1:]
        self.nominal.flags.writeable = False
        samples = {} if moments == "exact" else {"n_samples": n_samples, "seed": sample_seed}
        self._settings = {
            **_physics(self.model),
            **{"order": order, "moments": moments, "tolerance": tolerance, "box": box},
            **samples,
        }

        theta_s = theta_s_scatter(self.model)
        bands = [UniformBand(tolerance) for _ in DESIGN_VARIABLES]
        inputs: list[TruncatedNormal | UniformBand] = [theta_s, *bands]
        design_box = Box(DESIGN_VARIABLES, self.nominal * (1.0 - box), self.nominal * (1.0 + box))
        uncertain_box = surrogate_box(self.model, theta_s, box, tolerance)
        # The nodes of the fit may miss an unstable nominal design, or corner of the box.
        self.model.steady_state(np.vstack([self.model.nominal, *_corners(uncertain_box)]))
        self.surrogate = ChebyshevSurrogate.fit(
            self.model.dte_arcsec,
            uncertain_box,
            order,
            provenance={"model": self.model.to_dict(), "output": "DTE in arcsec"},
        )
        scatter = make_moments(
            moments, self.surrogate, inputs, design_box, n_samples, sample_seed
        )
        obj_names = ("mean_dte_arcsec", "std_dte_arcsec")
        units = dict(zip(PARAMETERS[1:], PARAMETER_UNITS[1:], strict=True))
        super().__init__(scatter, obj_names, units | dict.fromkeys(obj_names, "arcsec"))

    @property
    def settings(self) -> dict[str, Any]:
        """What decides the true front, JSON-able: physics, surrogate order, moments, bands, box."""
        return dict(self._settings)

    def name(self) -> str:
        """Return the name that pymoo shows, with that of the drive model."""
        return f"{type(self).__name__}({self.model.name})"

    def _reference(self) -> ReferenceFront | None:
        return load_reference(self.model.name, self._settings)

    def _calc_pareto_front(self) -> NDArray[np.float64] | None:
        """Return the stored true front, shape (n, 2), or None for settings without one."""
        reference = self._reference()
        return None if reference is None else reference.front

    def _calc_pareto_set(self) -> NDArray[np.float64] | None:
        """Return the designs of `pareto_front`, row for row, shape (n, 4), or None."""
        reference = self._reference()
        return None if reference is None else reference.designs


def surrogate_box(
    model: DriveModel, theta_s: TruncatedNormal, box: float, tolerance: float
) -> Box:
    """Return the box the surrogate is built on, over `PARAMETERS`.

    +-35 % of the nominal in the dynamic parameters, more where ``box`` and ``tolerance`` reach
    further, and the whole support of ``theta_s``.
    """
    lowest = min(1.0 - SURROGATE_BOX, (1.0 - box) * (1.0 - tolerance))
    highest = max(1.0 + SURROGATE_BOX, (1.0 + box) * (1.0 + tolerance))
    lower, upper = model.nominal * lowest, model.nominal * highest
    lower[0], upper[0] = theta_s.support
    return Box(PARAMETERS, lower, upper)


def theta_s_scatter(model: DriveModel) -> TruncatedNormal:
    """Return the distribution of theta_s over prototypes, in rad.

    Raises
    ------
    InvalidInput
        If theta_s could fall to 0 or below.
    """
    mean, std = model.nominal[0], model.kinematic_error.std
    theta_s = TruncatedNormal(mean, std)
    if theta_s.support[0] <= 0.0:
        limit = f"below {mean / theta_s.cut / ARCSEC:g} arcsec, so that theta_s stays above 0"
        raise InvalidInput("kinematic_error.std in arcsec", std / ARCSEC, limit)
    return theta_s


def _corners(box: Box) -> NDArray[np.float64]:
    return np.array(list(product(*zip(box.lower, box.upper, strict=True))))


def _physics(model: DriveModel) -> dict[str, Any]:
    """Return what the model is, without the texts that only say so."""
    texts = ("name", "description", "provenance", "data_sheet")
    return {key: value for key, value in model.to_dict().items() if key not in texts}
