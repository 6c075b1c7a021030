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

import numpy as np
from matplotlib.figure import Figure

from experiments.runner.committed import stored_outcome
from experiments.runner.registry import Context
from experiments.runner.texts import paragraphs
from experiments.studies.robust.data import (
    ACCURACY,
    BUDGET,
    CHAOSPY,
    FURTHER,
    METHODS,
    NAME,
    OPENTURNS,
    OURS,
    SEEDS,
    Outcome,
    ahead,
    outcome_for,
)
from experiments.studies.robust.functions import BY_NAME, FUNCTIONS
from experiments.studies.robust.task import DESIGNS
from pymoo_hdte._comparing.figures import BLUE, GREEN, ORANGE, grid
from pymoo_hdte._comparing.statistics import rate
from pymoo_hdte._runner.result import (
    NEW,
    NOT_SHOWN,
    SHOWN,
    Cell,
    Column,
    Finding,
    Picture,
    Result,
    Table,
    scored,
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


WANTED_AHEAD = 0.8
"""Share of the functions on which ours needs fewer runs."""
WANTED_COVERED = 0.95
"""Share of the designs at which a band holds mean and deviation, of every build."""


def needed_table(outcome: Outcome) -> Table:
    """Say how many runs every method needs on every function."""
    columns = [Column("function"), Column("inputs"), Column("chosen on")]
    columns += [Column(name, group="error at designs") for name in METHODS]
    columns += [Column(name, group="error overall") for name in METHODS]
    rows: list[tuple[Cell, ...]] = []
    for name in outcome.functions():
        function = BY_NAME[name]
        counts = [_count(outcome, name, method, column) for column in (1, 2) for method in METHODS]
        rows.append((name, len(function.laws), "yes" if function.tuned else "no", *counts))
    return Table(
        "needed",
        "Least model runs for a deviation within 1 %",
        tuple(columns),
        tuple(rows),
        note=f"Others are tried up to {FURTHER} times the runs that ours needs, at most {BUDGET}, "
        "or as far as stands behind 'above'; "
        "of their ways, the best counts. Curves end where the error at designs stays, also those "
        "for the error overall. One seed of every method. A dash: not run.",
        findings=(_needed_finding(outcome),),
    )


def _count(outcome: Outcome, function: str, method: str, column: int) -> Cell:
    tried = outcome.tried(function, method)
    return outcome.needed(function, method, column) or (f"above {tried}" if tried else None)


def of_the_first_page(outcome: Outcome) -> str:
    """Say what a robust problem is and how few runs it takes, as part of a longer sentence."""
    names, won = _tried_and_won(outcome)
    return (
        "a robust problem made of a deterministic simulator in a dozen lines, with exact moments "
        "of a surrogate that takes fewer runs than chaospy and OpenTURNS on "
        f"{len(won)} of {len(names)} functions (one seed a method)"
    )


def _tried_and_won(outcome: Outcome) -> tuple[list[str], list[str]]:
    """Return the functions on which all methods were run, and those on which ours needs least."""
    names = [
        name
        for name in outcome.functions()
        if all(outcome.tried(name, method) for method in METHODS)
    ]
    return names, [name for name in names if ahead(outcome, name)]


def _needed_finding(outcome: Outcome) -> Finding:
    names, won = _tried_and_won(outcome)
    kept_out = [name for name in names if not BY_NAME[name].tuned]
    lost = ", ".join(name for name in names if name not in won)
    others = ", ".join(name for name in outcome.functions() if name not in names)
    share = rate(len(won), len(names))
    return scored(
        share.state(WANTED_AHEAD),
        f"With one seed a method, our surrogate takes fewer runs than chaospy's and OpenTURNS's on "
        f"{len(won)} of {len(names)} functions, a share of {share.in_words}; at least "
        f"{WANTED_AHEAD:g} is wanted. Of the {len(kept_out)} functions kept out of the choice of "
        f"constants it does so on {len(set(won) & set(kept_out))}."
        + (f" It does not on {lost}." if lost else "")
        + (f" Not run with all three: {others}." if others else ""),
        answers=True,
    )


def stops_table(outcome: Outcome) -> Table:
    """Say where ours stops by itself, with the worst of the seeds."""
    rows: list[tuple[Cell, ...]] = []
    for name in outcome.functions():
        stops = [outcome.stops[name, seed] for seed in SEEDS if (name, seed) in outcome.stops]
        if not stops:
            continue
        stopped = [finding for finding in stops if np.isfinite(finding["runs"])]
        rows.append(
            (
                name,
                len(stops),
                int(np.median([stop["runs"] for stop in stopped])) if stopped else None,
                len(stops) - len(stopped),
                *(100.0 * max(finding[key] for finding in stops) for key in _ERRORS),
                *(
                    100.0 * min(stop[key] for stop in stopped) if stopped else None
                    for key in _COVERED
                ),
            )
        )
    columns = (
        Column("function"),
        Column("seeds"),
        Column("runs where it stops, median"),
        Column("refused"),
        *(
            Column(moment, "%", 2, group)
            for group in ("true error", "stated")
            for moment in _MOMENTS
        ),
        *(Column(moment, "%", 3, "designs that the band covers") for moment in _MOMENTS),
    )
    return Table(
        "stops",
        "Where ours stops when asked for 1 %, and its band at 200 designs",
        columns,
        tuple(rows),
        note="Errors as shares of the scatter: true ones of 95 % of the designs, stated ones the "
        f"median band; the worst seed. Refused: not within {BUDGET} runs, and without a band.",
        findings=(_cover_finding(outcome),) if outcome.stops else (),
    )


_MOMENTS = ("mean", "deviation")
_COVERED = ("covered_mean", "covered_std")
_ERRORS = ("true_mean_error", "true_std_error", "stated_mean_error", "stated_std_error")


def _cover_finding(outcome: Outcome) -> Finding:
    """Judge the band of the build that covers least, of those that gave an answer at all."""
    refused = [key for key, stop in outcome.stops.items() if not np.isfinite(stop["runs"])]
    covered = {
        key: min(numbers[moment] for moment in _COVERED)
        for key, numbers in outcome.stops.items()
        if key not in refused
    }
    missing = [
        function.name
        for function in FUNCTIONS
        if any((function.name, k) not in outcome.stops for k in SEEDS)
    ]
    none = ", ".join(dict.fromkeys(name for name, _ in refused))
    words = f"{len(refused)} refused ({none})" if refused else "none was refused"
    words += f". Not run with all seeds: {', '.join(missing)}." if missing else "."
    if not covered:
        return scored(NOT_SHOWN, f"No build of {OURS} gave an answer: {words}")
    (name, seed), least = min(covered.items(), key=lambda item: item[1])
    share = rate(round(least * DESIGNS), DESIGNS)
    state = share.state(WANTED_COVERED)
    enough = sum(share >= WANTED_COVERED for share in covered.values())
    return scored(
        NOT_SHOWN if missing and state == SHOWN else state,
        f"The stated band of {OURS} covers mean and deviation at {100.0 * WANTED_COVERED:g} % of "
        f"{DESIGNS} designs or more in {enough} of {len(covered)} surrogate builds that gave an "
        f"answer, and in all of them it should. The smallest share is {share.in_words}, on {name} "
        f"with seed {seed}. Of {len(outcome.stops)} builds, {words}",
    )


def curves_table(outcome: Outcome) -> Table:
    """Give the points of all curves."""
    rows = tuple((*key, *step) for key, steps in outcome.curves.items() for step in steps)
    columns = (
        Column("function"),
        Column("method"),
        Column("way"),
        Column("runs"),
        Column("at designs", "", 3, "error of the deviation"),
        Column("overall", "", 3, "error of the deviation"),
    )
    return Table("curves", "Errors over runs", columns, rows, folded=True)
