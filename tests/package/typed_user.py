"""What a user may write: .ci/run has ``mypy --strict`` judge it against the installed package."""

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.algorithms import ElitistSwarm
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.discrepancy import analyse, read_campaign
from pymoo_hdte.drive import DriveModel, hs_20_100, preset
from pymoo_hdte.parallel import ExecutorParallelization
from pymoo_hdte.problems import Design, Mean, MeanPlusStd, RobustDTE, RobustProblem, robust_problem
from pymoo_hdte.validation import ValidationMetrics, validation_metrics


def beam(b: float, h: float) -> dict[str, float]:
    """Return mass and deflection of a beam."""
    return {"mass": 7850 * b * h, "deflection": 1e-8 / (b * h**3)}


def robust_beam() -> RobustProblem:
    """Return the robust design problem of the beam."""
    sizes = {name: Design(0.02, 0.05, tolerance=0.02) for name in ("b", "h")}
    goals = [Mean(response="mass"), MeanPlusStd(3, response="deflection")]
    return robust_problem(beam, sizes, objectives=goals, accuracy=0.01)


def best(problem: RobustDTE, front: NDArray[np.float64]) -> int:
    """Return the place of the balanced design on a front of shape (n, 2)."""
    return int(WeightedUtopia(PREFERENCES["balanced"]).do(front))


def compared(model: DriveModel, measured: NDArray[np.float64]) -> ValidationMetrics:
    """Hold measured errors of the nominal design, arcsec, against the model."""
    predicted = model.dte_arcsec(np.repeat(model.nominal[None], len(measured), axis=0))
    return validation_metrics(predicted, measured)


def judged(folder: str) -> str:
    """Return what the verdict on a campaign is."""
    return analyse(read_campaign(folder)).verdict.status


def searched() -> ElitistSwarm:
    """Return a swarm after it was given workers that are ended again."""
    with ExecutorParallelization(2, time_limit=60.0) as runner:
        made: int | None = runner.counts.made
    assert made == 0
    return ElitistSwarm()


try:
    ratio: float = hs_20_100().ratio
    error: float = compared(preset("calibrated"), np.array([88.0, 89.0, 90.0])).mean_error
except InvalidInput as refused:
    field: str = refused.field
