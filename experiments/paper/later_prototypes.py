"""Whether the five prototypes of Table 6 are of the series of 20 that Table 3 describes.

Tables 3 and 6 print enough for a t-test: if all 25 are of one normal series, the difference of the
two means over its standard error follows Student's t with 23 degrees of freedom. The p-values of
the coefficients are adjusted for their number.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace

import numpy as np
from scipy.stats import t as student
from scipy.stats import ttest_ind_from_stats

from experiments.paper.bench.campaign import COEFFICIENTS, N_PROTOTYPES, NOMINAL_STIFFNESS
from experiments.published_values import TABLE_3, TABLE_6
from pymoo_hdte._comparing.statistics import holm
from pymoo_hdte._runner.result import WITHIN_PAPER, Column, Finding, Table, significant

ALIKE = 0.05
"""Level of the test that tells two series of prototypes apart."""


@dataclass(frozen=True)
class LaterPrototypes:
    """A coefficient of the five prototypes of Table 6 beside the series of 20, in SI units.

    ``p`` is that of the t-test, ``welch`` without equal standard deviations (None where the series
    prints none), ``adjusted`` that of the t-test after Holm's adjustment.
    """

    name: str
    mean: float
    std: float
    series_mean: float
    series_std: float | None
    p: float
    welch: float | None
    adjusted: float


def later_prototypes() -> list[LaterPrototypes]:
    """Compare K, B_in and B_fc of the five with what is printed of the 20."""
    rows: list[LaterPrototypes] = []
    for name in COEFFICIENTS[:3]:
        values = np.array([getattr(prototype, name) for prototype in TABLE_6.values()])
        five = (float(values.mean()), float(values.std(ddof=1)), len(values))
        series = TABLE_3.get(name)
        if series is None:
            error = five[1] * (1 / five[2] + 1 / N_PROTOTYPES) ** 0.5
            p = 2.0 * student.sf(abs(five[0] - NOMINAL_STIFFNESS) / error, five[2] - 1)
            row = LaterPrototypes(name, *five[:2], NOMINAL_STIFFNESS, None, float(p), None, p)
        else:
            twenty = (series.mean, series.std, N_PROTOTYPES)
            p = float(ttest_ind_from_stats(*five, *twenty).pvalue)
            welch = float(ttest_ind_from_stats(*five, *twenty, equal_var=False).pvalue)
            row = LaterPrototypes(name, *five[:2], *twenty[:2], p, welch, p)
        rows.append(row)
    adjusted = holm([row.p for row in rows])
    return [replace(row, adjusted=float(p)) for row, p in zip(rows, adjusted, strict=True)]


def later_prototypes_table() -> Table:
    """Tabulate the comparison, and say which coefficient is apart, if any."""
    rows = later_prototypes()
    least = min(rows, key=lambda row: row.adjusted)
    alike = least.adjusted >= ALIKE
    relation = "nothing tells them from" if alike else "they are not of"
    finding = Finding(
        alike,
        f"The five prototypes of Table 6 have a mean {least.name} of {1e4 * least.mean:.3f}e-4 "
        f"against {1e4 * least.series_mean:.3f}e-4 in Table 3 (t-test, Holm's adjustment: p = "
        f"{significant(least.adjusted, 1)}{_by_welch(least)}): {relation} the series that Table 3 "
        "describes.",
        within_paper=True,
    )
    columns = (
        Column("coefficient"),
        Column("mean", "", 4, "Table 6, five prototypes"),
        Column("std", "", 3, "Table 6, five prototypes"),
        Column("mean", "", 4, "Tables 3 and 4, 20 prototypes", paper=True),
        Column("std", "", 3, "Tables 3 and 4, 20 prototypes", paper=True),
        Column("p", "", 2),
        Column("p, Welch", "", 2),
        Column("p, adjusted", "", 2),
    )
    title = "Are the prototypes of Table 6 of the same series?"
    note = (
        "SI units. Two normal series of one mean and one standard deviation; Welch's test lets the "
        "standard deviations differ. K: with the standard deviation of the five, since Table 3 "
        "prints none."
    )
    cells = tuple(astuple(row) for row in rows)
    return Table("later", title, columns, cells, note, (finding,))


def _by_welch(row: LaterPrototypes) -> str:
    if row.welch is None:
        return ""
    return f"; {significant(row.welch, 1)} unadjusted if standard deviations may differ"


def of_the_first_page() -> dict[str, str]:
    """Say which coefficient of Table 6 is not of the series of Table 3, if any."""
    row = min(later_prototypes(), key=lambda row: row.adjusted)
    if row.adjusted >= ALIKE:
        return {}
    return {
        WITHIN_PAPER: f"{row.name} of the five prototypes in Table 6 does not fit the series of "
        f"Table 3 (means {1e4 * row.mean:.3f}e-4 and {1e4 * row.series_mean:.3f}e-4, p = "
        f"{significant(row.adjusted, 1)})"
    }
