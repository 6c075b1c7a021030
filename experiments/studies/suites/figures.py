"""Runtime profiles as COCO draws them, and the picture of how to choose."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from experiments.studies.suites.bbob_tables import BEST, CITED, curves
from experiments.studies.suites.data import Outcome
from experiments.studies.suites.peers import OURS
from experiments.studies.suites.protocol import BESIDE_PEERS, BUDGETS, DIMENSIONS, HELD_OUT
from experiments.studies.suites.suite_tables import named, ranks
from pymoo_hdte._comparing.figures import BLUE, GREEN, GREY, ORANGE, PINK, SKY, YELLOW, grid

LINES = {OURS: BLUE, "ElitistSwarm": SKY, "NSGA-II": GREEN, "COMO-CMA-ES": PINK}
PUBLISHED = {BEST: ORANGE, "SMS-EMOA-SA": YELLOW}
CHOICE = ("CompactSwarm", "ElitistSwarm", "SMS-EMOA", "NSGA-II", "AGE-MOEA-II", "CMOPSO")


def runtime_profiles(outcome: Outcome) -> Figure:
    """Draw the share of targets over evaluations, a panel a dimension, published curves dashed."""
    figure, axes = grid(1, len(DIMENSIONS), width=5.2, height=4.2, share_rows=True)
    for dimension, axis in zip(DIMENSIONS, axes[0], strict=True):
        for place, (name, curve) in enumerate(curves(dimension).items()):
            shares = {n: share for n, share in curve.items() if n <= BUDGETS[-1]}
            colour, style = PUBLISHED.get(name, GREY), ("--", ":", "-.")[place % 3]
            axis.plot(*_line(shares), style, color=colour, lw=1.2, label=f"{name}, published")
        _run_here(axis, outcome, dimension)
        axis.set_title(f"bbob-biobj, {dimension} dimensions", fontsize=10)
        axis.set_xscale("log")
        axis.set_xlabel("evaluations")
        axis.legend(fontsize=7, frameon=False, loc="upper left")
    axes[0, 0].set_ylabel("share of COCO's 58 targets")
    return figure


def _run_here(axis: Axes, outcome: Outcome, dimension: int) -> None:
    """Draw what ran here, each algorithm's run of the largest budget."""
    for name, colour in LINES.items():
        shares = outcome.shares(dimension, name, BUDGETS[-1], BESIDE_PEERS)
        if shares:
            width = 2.2 if name == OURS else 1.3
            axis.plot(*_line(shares), color=colour, lw=width, label=f"{name}, here")


def _line(shares: dict[int, float]) -> tuple[list[int], list[float]]:
    return list(shares), list(shares.values())


def how_to_choose(outcome: Outcome) -> Figure:
    """Draw average ranks over the budget on the held-out suite, and the shares of targets."""
    figure, axes = grid(1, 3, width=3.9, height=3.3)
    (suite,) = HELD_OUT
    budgets = outcome.budgets(suite)
    colours = dict(zip(CHOICE, (BLUE, SKY, YELLOW, GREEN, PINK, ORANGE), strict=True))
    for axis, (measure, words) in zip(
        axes[0], (("hypervolume", "hypervolume"), ("igd_plus", "IGD+")), strict=False
    ):
        by_budget = {budget: ranks(outcome, suite, budget, measure) for budget in budgets}
        for name, colour in colours.items():
            line = {b: by_name[name] for b, by_name in by_budget.items() if name in by_name}
            if not line:
                continue
            bold = name in (OURS, "ElitistSwarm")
            axis.plot(*_line(line), "o-", color=colour, lw=2.2 if bold else 1.0, ms=4, label=name)
        axis.set_title(f"{named(outcome, suite)}, {words}", fontsize=9)
        axis.set_ylabel("average rank, 1 is best")
        axis.invert_yaxis()
        _over_evaluations(axis)
    # Below all lines.
    worst, best = axes[0, 0].get_ylim()
    axes[0, 0].set_ylim(worst + 0.3 * (worst - best), best)
    axes[0, 0].legend(fontsize=7, frameon=False, ncols=2, loc="lower left")
    axis = axes[0, 2]
    _run_here(axis, outcome, DIMENSIONS[0])
    cited = {n: share for (d, n), share in CITED.items() if d == DIMENSIONS[0]}
    axis.plot(*_line(cited), "s", color=ORANGE, markersize=5, label=f"{BEST}, published")
    axis.set_title(f"bbob-biobj, {DIMENSIONS[0]} dimensions", fontsize=10)
    axis.set_ylabel("share of targets")
    axis.legend(fontsize=7, frameon=False, loc="upper left")
    _over_evaluations(axis)
    return figure


def _over_evaluations(axis: Axes) -> None:
    axis.set_xscale("log")
    axis.set_xlabel("evaluations")
