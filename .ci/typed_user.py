"""What a user may write, judged by ``mypy --strict`` against the installed package."""

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.drive import DriveModel, hs_20_100, preset
from pymoo_hdte.problems import RobustDTE
from pymoo_hdte.validation import ValidationMetrics, validation_metrics


def best(problem: RobustDTE, front: NDArray[np.float64]) -> int:
    """Return the place of the balanced design on a front of shape (n, 2)."""
    return int(WeightedUtopia(PREFERENCES["balanced"]).do(front))


def compared(model: DriveModel, measured: NDArray[np.float64]) -> ValidationMetrics:
    """Hold measured errors of the nominal design, arcsec, against the model."""
    predicted = model.dte_arcsec(np.repeat(model.nominal[None], len(measured), axis=0))
    return validation_metrics(predicted, measured)


try:
    ratio: float = hs_20_100().ratio
    error: float = compared(preset("calibrated"), np.array([88.0, 89.0, 90.0])).mean_error
except InvalidInput as refused:
    field: str = refused.field
