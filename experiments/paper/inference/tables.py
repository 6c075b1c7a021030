"""What the searches say of the published trade-off: headline, tables, and the first sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from experiments.paper.calibrating.predictions import PUBLISHED
from experiments.paper.inference.data import Fit
from experiments.paper.inference.held_out import (
    dominating_shares,
    prototypes,
    stable,
    surrogate_rmse,
)
from experiments.paper.inference.likelihood import OBSERVED, READING
from experiments.paper.inference.rungs import Rung
from experiments.paper.inference.verdicts import (
    PRESET,
    STEPS,
    WITHIN,
    Named,
    above_a_special_case,
    chosen_fits,
    describe,
    gives_both,
    gives_trade_off,
    step_errors,
    steps_of,
)
from experiments.runner.result import Cell, Column, Finding, Table, significant


def of_the_first_page(fits: Sequence[Fit]) -> str:
    """Say whether its trade-off and its optima go together, as part of a longer sentence."""
    both = len(_models(gives_both(fits)))
    return (
        f"{both or 'none'} of {len(_models(fits))} fitted drive models {_give(both or 1)} its "
        f"trade-off between mean and scatter and {'leave' if both > 1 else 'leaves'} its optima "
        "optimal"
    )


def opening(fits: Sequence[Fit]) -> str:
    """Return what the searches found, for the first screen of the report."""
    common = [one for one in fits if one.target == "common"]
    searched = len(common)
    meeting = [one for one in common if gives_trade_off(one)]
    both = gives_both(fits)
    if both:
        return (
            f"Of {searched} drive models searched, {len(both)} give the published numbers with the "
            "steps between the optima, and leave the optima non-dominated: first "
            f"{describe(both[0].rung)}."
        )
    last = (
        "Unless its search ended far from the front, the paper optimised another model than any "
        f"found here; {len(above_a_special_case(common))} of the searches ended above a special "
        "case of their model, so that more models may give the numbers."
    )
    if not meeting:
        return (
            f"None of {searched} drive models gives the paper's trade-off between mean and "
            f"standard deviation within the errors that common random numbers leave. {last}"
        )
    first = min(meeting, key=lambda one: one.bic)
    return (
        f"None of {searched} drive models gives both the paper's numbers and its optima. "
        f"{len(meeting)} {_give(len(meeting))} the nine numbers with the steps between the optima, "
        f"but in {'each' if len(meeting) > 1 else 'it'} other designs of the box dominate the "
        f"optima, in the likeliest by {significant(first.evaluation.depths.max(), 2)} widths of "
        f"the published front. {_nearest(fits)}. {last}"
    )


def _models(fits: Sequence[Fit]) -> set[Rung]:
    """Return the models of fits: one may be fitted to several targets."""
    return {one.rung for one in fits}


def _nearest(fits: Sequence[Fit]) -> str:
    nearest = chosen_fits(fits)[-1].fit.evaluation
    return (
        "Fitted to both, the nearest has a chi-square of "
        f"{significant(nearest.chi_square('common'), 2)} and a depth of "
        f"{significant(nearest.depths.max(), 2)}"
    )


def _give(count: int) -> str:
    return "gives" if count == 1 else "give"


def steps_table(fits: Sequence[Fit]) -> Table:
    """Return the steps between the published optima, by the paper and by the models chosen."""
    paper: tuple[Cell, ...] = ("the paper", *steps_of(OBSERVED), None, None, None, None)
    rows = [paper, *(_steps_row(named) for named in chosen_fits(fits))]
    columns = (
        Column("model"),
        *(
            Column(moment, "arcsec", 3, f"{first} to {last}".replace("_", " "))
            for moment in ("mean", "std")
            for first, last in STEPS
        ),
        Column("largest miss of a step", "standard errors", 2),
        Column("chi-square of the nine numbers", "", 3),
        Column("greatest depth", "front widths", 2),
        Column("share of designs that dominate", "%", 2, "greatest"),
    )
    # Steps stand by moment; the paper's designs are read by step.
    order = [0, 1, 3, 2, 4, 5, 6, 7, 8]
    columns = tuple(columns[place] for place in order)
    ordered = tuple(tuple(row[place] for place in order) for row in rows)
    return Table(
        "steps",
        "The steps between the published optima, which common random numbers make sharp",
        columns,
        ordered,
        findings=tuple(_findings(fits)),
        note="Chi-square with the covariance in every row.",
    )


def _steps_row(named: Named) -> tuple[Cell, ...]:
    found = named.fit.evaluation
    shares = dominating_shares(named.fit.rung, named.fit.parameters)
    return (
        f"{named.label} ({describe(named.fit.rung)})",
        *steps_of(found.predicted),
        float(np.abs(step_errors(found)).max()),
        found.chi_square("common"),
        float(found.depths.max()),
        100.0 * float(shares.max()),
    )


def _findings(fits: Sequence[Fit]) -> list[Finding]:
    (independent,) = (one for one in fits if one.target == "independent")
    common = [one for one in fits if one.target == "common"]
    meeting = [one for one in common if gives_trade_off(one)]
    both = gives_both(fits)
    found = independent.evaluation
    ours, paper = steps_of(found.predicted), steps_of(OBSERVED)
    return [
        Finding(
            gives_trade_off(independent),
            f"Fitted as {PRESET} was, each number with its own sampling error, the model of "
            f"{PRESET} has a chi-square of {significant(found.chi_square('independent'), 2)}, and "
            f"of {significant(found.chi_square('common'), 3)} with the covariance; from the "
            f"balanced to the robust design it changes by {ours[1]:+.3f} and {ours[3]:+.3f} arcsec "
            f"(paper {paper[1]:+.3f} and {paper[3]:+.3f}).",
            fitted=True,
        ),
        Finding(
            bool(meeting),
            f"{len(meeting)} of {len(common)} models give all four steps within {WITHIN:g} "
            "standard errors and the nine numbers with a chi-square that is not improbable"
            + (
                f"; the likeliest is {describe(min(meeting, key=lambda one: one.bic).rung)}. By "
                f"sampling alone, without the {READING:g} arcsec, it misses a step by "
                f"{_miss_by_sampling(meeting):.1f} standard errors."
                if meeting
                else "."
            ),
            fitted=True,
        ),
        Finding(
            bool(both),
            f"{len(_models(both))} of {len(_models(fits))} models do so and leave the three optima "
            f"non-dominated; some were fitted to that as well, {len(fits)} fits in all.",
        ),
    ]


def _miss_by_sampling(meeting: Sequence[Fit]) -> float:
    found = min(meeting, key=lambda one: one.bic).evaluation
    return float(np.abs(step_errors(found, sampling_alone=True)).max())


def ladder_table(fits: Sequence[Fit]) -> Table:
    """Return all rungs fitted with the covariance, the likeliest first."""
    common = sorted((one for one in fits if one.target == "common"), key=lambda one: one.bic)
    least = common[0].bic
    rows = tuple(
        (
            ", ".join(name.replace("_", " ") for name in one.rung.candidate.effects) or "none",
            ", ".join(one.rung.closures) or "none",
            one.rung.candidate.reading.replace("_", " "),
            one.rung.candidate.bands,
            one.n_parameters,
            one.evaluation.chi_square("common"),
            one.bic - least,
            float(np.abs(step_errors(one.evaluation)).max()),
            float(one.evaluation.depths.max()),
            one.starts,
            one.followed,
            one.reached,
        )
        for one in common
    )
    columns = (
        Column("effects"),
        Column("closures"),
        Column("theta_s"),
        Column("bands"),
        Column("parameters"),
        Column("chi-square", "", 3),
        Column("BIC above the least", "", 3),
        Column("largest miss of a step", "standard errors", 2),
        Column("greatest depth", "front widths", 2),
        Column("made", "", 3, "starts"),
        Column("followed", "", 3, "starts"),
        Column("that reach the best basin", "", 3, "starts"),
    )
    return Table(
        "ladder",
        f"{len(common)} models fitted to the nine numbers with their covariance",
        columns,
        rows,
        note="All starts are of a Latin hypercube; a third is followed after its first steps. "
        "Where one start alone reaches the best basin, a deeper one cannot be excluded. A model "
        "that contains another is shown as found, even where its search ends higher.",
    )


def held_out_table(shown: Sequence[Named]) -> Table:
    """Return published numbers that no fit has seen."""
    unseen = ("rmse_2", "rmse_3", "prototypes_mean", "prototypes_std")
    rows: list[tuple[Cell, ...]] = [
        ("the paper", *(PUBLISHED[name] for name in unseen), "No. 5", "No. 4", None)
    ]
    for named in shown:
        rung, parameters = named.fit.rung, named.fit.parameters
        values = prototypes(rung, parameters)
        rows.append(
            (
                named.label,
                surrogate_rmse(rung, parameters, 2),
                surrogate_rmse(rung, parameters, 3),
                values.mean(),
                values.std(),
                f"No. {int(np.argmin(values)) + 1}",
                f"No. {int(np.argmax(values)) + 1}",
                "yes" if stable(rung, parameters) else "no",
            )
        )
    columns = (
        Column("model"),
        Column("order 2", "arcsec", 3, "RMSE of the surrogate, Table 5"),
        Column("order 3", "arcsec", 3, "RMSE of the surrogate, Table 5"),
        Column("mean", "arcsec", 4, "prototypes of Section 4"),
        Column("std", "arcsec", 3, "prototypes of Section 4"),
        Column("lowest DTE", "", 3, "prototypes of Section 4"),
        Column("highest DTE", "", 3, "prototypes of Section 4"),
        Column("stable over the box"),
    )
    return Table("held_out", "Published numbers that no fit has seen", columns, tuple(rows))
