"""A result with everything a report may have to show."""

import numpy as np
from matplotlib.figure import Figure

from pymoo_hdte._runner.result import (
    MISSED,
    NOT_SHOWN,
    OF_MODELS,
    SHOWN,
    WITHIN_PAPER,
    Column,
    Finding,
    Picture,
    Result,
    Table,
    scored,
)

HOSTILE = "<script>alert('x')</script>"


def line_plot() -> Figure:
    figure = Figure(figsize=(6, 2))
    figure.subplots().plot([0, 1], [0, np.pi])
    return figure


def example() -> Result:
    columns = (
        Column("algorithm"),
        Column("mean", "arcsec", 3, "IGD"),
        Column("paper", "arcsec", 4, "IGD", paper=True),
        Column("runs"),
    )
    rows = (
        (HOSTILE, np.float64(1 / 3), 0.018, np.int64(20)),
        ("none", float("nan"), None, 0),
        ("all", float("inf"), None, 0),
    )
    findings = (
        Finding(np.bool_(True), "They agree."),
        Finding(False, "They differ.", answers=True),
        Finding(True, "A fit gives it back.", fitted=True),
        Finding(False, "A fit misses it.", fitted=True),
        Finding(True, "It holds.", check=True),
        Finding(False, "It fails.", check=True),
        Finding(True, "It fits itself.", within_paper=True),
        Finding(False, "It contradicts itself.", within_paper=True),
        scored(SHOWN, "It is shown."),
        scored(NOT_SHOWN, "It is too few."),
        scored(MISSED, "It is missed."),
    )
    times = Table("times", "Wall times", (Column("time", "s"),), ((1.5,),), wall_times=True)
    return Result(
        title="An example",
        command="python -m experiments table7",
        paragraphs=(HOSTILE,),
        tables=(Table("quality", "Quality", columns, rows, "How.", findings), times),
        pictures=(Picture("line", "A line.", line_plot()),),
        notes=("A note.",),
        models={"calibrated": "What it is."},
        first_page={WITHIN_PAPER: "this holds", OF_MODELS: "that does not"},
        shown_first="line",
    )
