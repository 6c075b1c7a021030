"""Draw docs/robust_design.png, the first picture of the README: scatter of the DTE and front."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pymoo.optimize import minimize
from scipy.stats import gaussian_kde

from pymoo_hdte.algorithms import CompactSwarm
from pymoo_hdte.decision import PREFERENCES, WeightedUtopia
from pymoo_hdte.problems import RobustDTE

PICTURE = Path(__file__).with_name("robust_design.png")
DATA_SHEET, CHOSEN = "#D55E00", "#0072B2"
DRIVES = 2000


def draw(target: Path = PICTURE) -> None:
    """Optimise the calibrated drive and draw what that does to drives as they are built."""
    problem = RobustDTE()
    found = minimize(problem, CompactSwarm(), ("n_eval", 20_000), seed=1)
    chosen = found.X[WeightedUtopia(PREFERENCES["balanced"]).do(found.F)]
    figure = Figure(figsize=(9.6, 3.4), layout="constrained")
    scatter, front = figure.subplots(1, 2)
    labels = []
    front.plot(*problem.pareto_front().T, color="0.6", linewidth=5, label="front of the surrogate")
    front.plot(*found.F.T, ".", color=CHOSEN, markersize=4, label="CompactSwarm")
    for name, design, colour, line in (
        ("data sheet", problem.nominal, DATA_SHEET, "--"),
        ("balanced design", chosen, CHOSEN, "-"),
    ):
        dte = of_built_drives(problem, design)
        values = np.linspace(25.0, 150.0, 300)
        labels.append(f"{name}: {dte.mean():.1f} ± {dte.std():.1f} arcsec")
        scatter.plot(values, gaussian_kde(dte)(values), line, color=colour, label=labels[-1])
        front.plot(*problem.evaluate(design), "x", color=colour, markersize=9, mew=2.2, label=name)
    scatter.set(xlabel="DTE of a built drive [arcsec]", yticks=[], ylim=(0.0, 0.036))
    front.set(xlabel="mean DTE [arcsec]", ylabel="standard deviation [arcsec]")
    for axis in (scatter, front):
        axis.legend(frameon=False, fontsize=9)
    # A test compares the words, which say more than pixels.
    described = {"Software": None, "Description": "; ".join(labels)}
    figure.savefig(target, dpi=100, metadata=described)


def of_built_drives(problem: RobustDTE, design: np.ndarray) -> np.ndarray:
    """Return the DTE of random drives of one design, by the drive model, shape (DRIVES,)."""
    rng = np.random.default_rng(1)
    drives = np.column_stack([entry.sample(rng, DRIVES) for entry in problem.inputs])
    drives[:, 1:] *= design
    return problem.model.dte_arcsec(drives)


if __name__ == "__main__":
    draw()
