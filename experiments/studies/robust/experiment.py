"""Model runs that a robust surrogate takes for a deviation within 1 %, beside other libraries.

The protocol, written before anything was run or tuned:

- Ten functions (`functions`), two inputs of each designed: designs are the middle half of the
  input's range and deviate by a quarter of it, so that runs reach over the range of the source.
- A method needs the least number of runs from which the error of the standard deviation is below
  1 % at 95 % of 200 random designs, and stays so for a third more runs; at most 1000. Errors are
  those at 256 draws of the scatter, the same for the function and all surrogates. All runs count,
  also those that a method makes only to measure its error.
- Beside it stands where a method stops by itself, which only ours does, and the same error of the
  deviation over designs and scatter together, for which the other libraries are mostly used.
- Our stated band is compared at the 200 designs with moments of 16,384 draws.
- All others are tried up to three times the runs that ours needs, at most 1000; one that has not
  reached 1 % there needs more than it was given.
- Constants of the package may be chosen on Ishigami, borehole, OTL circuit, piston, wing weight and
  cantilever; robot arm, G-function, kink and resonance are kept out of that.

The whole, ``--full``, takes some 15 minutes of one core and 0.5 GB.
"""

from __future__ import annotations

from matplotlib.figure import Figure

from experiments.comparing.figures import BLUE, GREEN, ORANGE, grid
from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.result import NEW, Picture, Result
from experiments.runner.texts import paragraphs
from experiments.studies.robust.data import (
    ACCURACY,
    CHAOSPY,
    NAME,
    OPENTURNS,
    OURS,
    Outcome,
    outcome_for,
)
from experiments.studies.robust.functions import FUNCTIONS
from experiments.studies.robust.tables import (
    curves_table,
    needed_table,
    of_the_first_page,
    stops_table,
)

(PROTOCOL,) = paragraphs("robust")
CHOSEN = (
    "Constants of the package were chosen on Ishigami's function, borehole, OTL circuit, piston, "
    "wing weight and cantilever; robot arm, G-function, kink and resonance were kept out of that. "
)


def run(context: Context) -> Result:
    """Show the runs that every method needs, and what our band covers."""
    outcome = outcome_for(context)
    sources = "; ".join(f"{function.name}: {function.source}" for function in FUNCTIONS)
    return Result(
        title="Runs of a simulator that its robust surrogate takes",
        command=context.command(NAME),
        paragraphs=(*stored_outcome(context, NAME), PROTOCOL, CHOSEN, f"Sources. {sources}."),
        first_page={NEW: of_the_first_page(outcome)},
        tables=(needed_table(outcome), stops_table(outcome), curves_table(outcome)),
        pictures=(
            Picture(
                "robust",
                "Error of the standard deviation, of 95 % of 200 designs, over model runs; every "
                "way of chaospy is a line. Dotted: 1 %.",
                error_over_runs(outcome),
                leading=True,
            ),
        ),
    )


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
                runs, errors = [step[0] for step in steps], [100.0 * step[1] for step in steps]
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
