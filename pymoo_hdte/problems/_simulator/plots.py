"""Pictures of a robust problem, and one HTML page of all of them."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING, Any

import numpy as np
from jinja2 import Environment
from numpy.typing import ArrayLike, NDArray

from pymoo_hdte.checks import InvalidInput, finite_array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pymoo_hdte.problems._simulator.problem import SimulatorProblem

Array = NDArray[np.float64]

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{{ title }}</title>
<style>body{font-family:sans-serif;max-width:60em;margin:2em auto}td,th{padding:.2em .8em;
text-align:right}td:first-child,th:first-child{text-align:left}img{max-width:100%}</style></head>
<body><h1>{{ title }}</h1>
<p>{{ n_runs }} runs of the simulator.{% if refusal %} <b>The surrogate is not trusted:
{{ refusal }}.</b>{% endif %}</p>
<h2>Responses</h2>
<table><tr><th>response</th><th>error of mean and deviation, share of the scatter</th></tr>
{% for name, error in errors %}<tr><td>{{ name }}</td><td>{{ error }}</td></tr>{% endfor %}</table>
<h2>The design</h2>
<table><tr><th>variable</th><th>value</th></tr>
{% for name, value in design %}<tr><td>{{ name }}</td><td>{{ value }}</td></tr>{% endfor %}</table>
<table><tr><th>objective</th><th>value</th><th>error</th></tr>
{% for row in objectives %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table>
{% if constraints %}<table><tr><th>constraint</th><th>value</th><th>bound</th></tr>
{% for row in constraints %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table>{% endif %}
<h2>Where the scatter comes from</h2>
<table><tr><th>input</th>{% for name in responses %}<th>{{ name }}</th>{% endfor %}</tr>
{% for row in shares %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}</table>
<p>Total Sobol indices at the design: the share of the variance in which an input takes part.</p>
{% for title, picture in pictures %}<h2>{{ title }}</h2>
<img alt="{{ title }}" src="data:image/png;base64,{{ picture }}">{% endfor %}
</body></html>
"""


def plot_front(problem: SimulatorProblem, result: Any, axes: Axes | None = None) -> Axes:
    """Draw the first two objectives of a result with their error bands; one over its variable."""
    axes = _new_axes() if axes is None else axes
    X, F = np.atleast_2d(result.X), np.atleast_2d(result.F)
    half = problem.band(X)
    order = np.argsort(F[:, 0])
    names = problem.obj_names
    if F.shape[1] == 1:
        axes.errorbar(X[:, 0], F[:, 0], yerr=half[:, 0], fmt="o", ms=3, lw=0.8)
        axes.set(xlabel=problem.var_names[0], ylabel=names[0])
        return axes
    (x, y), (dx, dy) = F[order, :2].T, half[order, :2].T
    axes.errorbar(x, y, xerr=dx, yerr=dy, fmt="o", ms=3, lw=0.8, ecolor="0.7")
    axes.set(xlabel=names[0], ylabel=names[1])
    return axes


def plot_scatter(
    problem: SimulatorProblem, design: ArrayLike, response: str | None, axes: Axes | None = None
) -> Axes:
    """Draw how a response scatters around a design, with its mean and quantiles of 5 and 95 %."""
    axes = _new_axes() if axes is None else axes
    name, values = problem.scatter(design, response)
    axes.hist(values, bins=60, density=True, color="0.8")
    axes.axvline(float(values.mean()), color="C0", label="mean")
    for p, style in ((0.05, ":"), (0.95, "--")):
        quantile = float(np.quantile(values, p))
        axes.axvline(quantile, color="C1", ls=style, label=f"{100.0 * p:g} % quantile")
    axes.set(xlabel=name, ylabel="density")
    axes.legend(fontsize=8)
    return axes


def page(
    problem: SimulatorProblem,
    result: Any,
    design: ArrayLike | None,
    title: str = "Robust design",
) -> str:
    """Return the report as HTML; parameters as in `SimulatorProblem.report`.

    Raises
    ------
    InvalidInput
        If neither a result nor a design is given.
    """
    if design is None and result is None:
        raise InvalidInput("result and design", (None, None), "one of them")
    if design is None:
        design = np.atleast_2d(result.X)[middle(np.atleast_2d(result.F))]
    point = finite_array("design", design, (problem.n_var,))
    F, band = problem.evaluate(point[None], return_values_of=["F", "F_band"])
    pictures = []
    if result is not None:
        pictures.append(("Front", _png(plot_front(problem, result).figure)))
    for name in problem.responses:
        drawn = plot_scatter(problem, point, name)
        pictures.append((f"Scatter of {name}", _png(drawn.figure)))
    totals = [problem.sobol_indices(point, name).total for name in problem.responses]
    shares = [
        [name, *(f"{total[place]:.3f}" for total in totals)]
        for place, name in enumerate(problem.degrees)
    ]
    objectives = zip(problem.obj_names, F[0], band[0], strict=True)
    environment = Environment(autoescape=True)
    return environment.from_string(_PAGE).render(
        title=title,
        n_runs=problem.n_runs,
        refusal=problem.refusal,
        errors=[(name, f"{error:.2g}") for name, error in problem.response_errors.items()],
        design=[
            (name, f"{x:.6g}") for name, x in zip(problem.var_names, point.tolist(), strict=True)
        ],
        objectives=[(name, f"{value:.6g}", f"{half:.2g}") for name, value, half in objectives],
        constraints=[
            (name, f"{value:.6g}", f"{side.replace('_', ' ')} {bound:.6g}")
            for name, value, side, bound in limits_at(problem, point)
        ],
        responses=problem.responses,
        shares=shares,
        pictures=pictures,
    )


def limits_at(problem: SimulatorProblem, design: Array) -> list[tuple[str, float, str, float]]:
    """Return the constraints of a problem at a design: name, value, kind of bound and bound."""
    if not problem.constraints:
        return []
    (G,) = problem.evaluate(design[None], return_values_of=["G"])
    return [
        (
            limit.statistic.name,
            float(limit.bound + limit.side * excess),
            "at_most" if limit.side > 0.0 else "at_least",
            float(limit.bound),
        )
        for limit, excess in zip(problem.constraints, G, strict=True)
    ]


def middle(F: Array) -> int:
    """Return the row of a front that is nearest to the best of every objective, in ranges."""
    ranges = np.maximum(np.ptp(F, axis=0), np.finfo(float).tiny)
    return int(np.argmin(np.sum(((F - F.min(axis=0)) / ranges) ** 2, axis=1)))


def _new_axes() -> Axes:
    from matplotlib.figure import Figure  # Takes longer to load than a problem without pictures.

    return Figure(figsize=(6.0, 4.0), layout="constrained").add_subplot()


def _png(figure: Figure | Any) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110)
    return base64.b64encode(stream.getvalue()).decode("ascii")
