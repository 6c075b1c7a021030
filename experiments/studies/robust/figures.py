"""The error of the deviation over model runs, one panel a function."""

from __future__ import annotations

from matplotlib.figure import Figure

from experiments.comparing.figures import BLUE, GREEN, ORANGE, grid
from experiments.studies.robust.data import Outcome
from experiments.studies.robust.job import ACCURACY, CHAOSPY, OPENTURNS, OURS

STYLES = {OURS: (BLUE, "o-"), CHAOSPY: (ORANGE, "^--"), OPENTURNS: (GREEN, "s-.")}
_COLUMNS = 5


def error_over_runs(outcome: Outcome) -> Figure:
    """Draw all curves; of chaospy every way."""
    names = outcome.functions()
    figure, axes = grid(-(-len(names) // _COLUMNS), _COLUMNS, width=2.6, height=2.6)
    for place, axis in enumerate(axes.flat):
        if place >= len(names):
            axis.set_visible(False)
            continue
        for (name, method, _), steps in outcome.curves.items():
            if name == names[place]:
                colour, style = STYLES[method]
                runs, errors = [one[0] for one in steps], [100.0 * one[1] for one in steps]
                axis.loglog(runs, errors, style, color=colour, markersize=3, lw=0.9, mfc="none")
        axis.axhline(100.0 * ACCURACY, color="black", linestyle=":", linewidth=1)
        axis.set_title(names[place], fontsize=9)
        axis.set_xlabel("model runs")
    axes[0, 0].set_ylabel("error of the deviation [%]")
    handles = [
        axes[0, 0].plot([], [], style, color=colour, mfc="none", label=method)[0]
        for method, (colour, style) in STYLES.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    return figure
