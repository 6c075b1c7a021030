"""The robust DTE problem with grades of the error classes, at a limited cost, off a resonance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, finite_array, real_number
from pymoo_hdte.drive import PARAMETERS, DataSheet, DriveModel
from pymoo_hdte.drive._solve.hill import hill_steady_state
from pymoo_hdte.problems.drive_response import (
    DESIGN_VARIABLES,
    OBJECTIVES,
    PAPERS_ORDER,
    UNITS,
    DriveResponse,
    surrogate_box,
)
from pymoo_hdte.problems.operating_conditions import OperatingCondition, shares
from pymoo_hdte.problems.reference import StoredFront
from pymoo_hdte.problems.robust import RobustProblem
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, ExactMoments, TruncatedNormal, UniformBand
from pymoo_hdte.surrogate.tensor import chebyshev_nodes, coefficients_from_nodes
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

LOBES = 2.0
"""Order of the two lobes of the wave generator, which excite the drive at any load."""

_ORDERS = {"theta_s": 2, "K": PAPERS_ORDER, "J_in": PAPERS_ORDER, "B_in": 1, "B_fc": 2}
_ORDER_OF_GRADES = 2
"""All at order 3 would be 65,536 model runs and moments that fill gigabytes."""


class RobustDTEGrades(StoredFront, RobustProblem):
    """Minimise mean and standard deviation of the DTE at a limited cost, away from a resonance.

    X = (K, J_in, B_in, B_fc, grades): the four design variables of `RobustDTE`, and one grade for
    each line of the model's static error theta_s. A grade multiplies the amplitude of its line: 1
    is the drive of the data sheet, 0.5 one whose errors behind this line are half as large, in
    mean and scatter. Which classes of the static error, Eq. (1), stand behind a line follows
    from its order (Table 1): the wave generator errs at order 1, parts that stand still and the
    pitch at 2, the flexspline at 2.02. Their letters make the name, as in ``grade_w``.

    Two constraints hold for the nominal design. The grades cost no more than ``cost_limit``, by
    the reciprocal model of Chase and Greenwood as in `RobustDTETolerance`: the mean of 1 / grade
    over the error sources of the data sheet that stand behind a line, 1 for the drive as it is.
    That halving any one error costs the same is our simplification. And the drive also runs for
    long at ``process_speed``: its torsional resonance, that of K between both inertias, stays off
    the speed of the wave generator's two lobes there, by the share ``margin`` of it at least.
    Designs that are softer and stiffer than that are two separate regions. (The torsion under load
    is load / K, and a limit of it would only move the bound of K.)

    Parameters
    ----------
    model, tolerance, box, conditions
        As in `RobustDTE`; the band holds for the grades too.
    grades : tuple of float, length 2
        Smallest and largest grade, dimensionless, above 0.
    cost_limit : float
        Largest cost, dimensionless, between those of the coarsest and the finest grades.
    process_speed : float
        rad/s at the input, above 0.
    margin : float
        Share of the excitation's frequency, dimensionless, above 0 and below 1.

    Attributes
    ----------
    model, conditions, surrogate, inputs, nominal, var_names, obj_names, units
        As in `RobustDTE`; grades are pure numbers, and ``nominal`` has none. The surrogate is of
        order 3 in K and J_in, 1 in B_in, and 2 in all others.
    cost_shares : ndarray, shape (n_grades,)
        Share of the error sources that each grade stands for, dimensionless; they add up to 1.
    cost_limit, margin : float
        As given, dimensionless.
    process_speed : float
        As given, rad/s.
    n_ieq_constr : int
        Number of constraints, 2: the cost, then the resonance.

    Raises
    ------
    InvalidInput, UnstableDrive
        As `RobustDTE`; also for a line of theta_s at whose order no class of the data sheet errs.

    Notes
    -----
    Ask for ``dG``, shape (n, 2, n_var), in ``return_values_of`` to get the slopes of the
    constraints, as ``dF`` gives those of the objectives.

    Examples
    --------
    >>> problem = RobustDTEGrades()  # doctest: +SKIP
    >>> problem.n_var, problem.n_ieq_constr  # doctest: +SKIP
    """

    def __init__(
        self,
        model: str | DriveModel = "calibrated",
        tolerance: float = 0.05,
        grades: tuple[float, float] = (0.5, 1.25),
        cost_limit: float = 1.0,
        process_speed: float = 1320.0 * REVOLUTION_PER_MINUTE,
        margin: float = 0.05,
        box: float = 0.25,
        conditions: Sequence[OperatingCondition] | None = None,
    ) -> None:
        response = DriveResponse(model, PAPERS_ORDER, box, conditions)
        tolerance = real_number("tolerance", tolerance, above=0.0, below=1.0)
        finest, coarsest = finite_array("grades", grades, (2,)).tolist()
        real_number("grades[0]", finest, above=0.0, below=coarsest)
        self.cost_limit = real_number(
            "cost_limit", cost_limit, above=1 / coarsest, below=1 / finest
        )
        self.process_speed = real_number("process_speed", process_speed, above=0.0)
        self.margin = real_number("margin", margin, above=0.0, below=1.0)
        self.model, self.conditions = response.model, response.conditions
        self.nominal = response.nominal
        coefficients = self.model.coefficients(self.model.nominal[None])
        if coefficients.is_loose:
            allowed = "inertias rigidly on the output, whose resonance is known in closed form"
            loose = "coupled_inertia" if coefficients.coupled else "load_shaft"
            raise InvalidInput("model.effects", loose, allowed)
        self._output_inertia = coefficients.output_inertia
        classes = _classes(self.model)
        sources = np.array([len(_sources(self.model.sheet, names)) for names in classes])
        self.cost_shares = sources / sources.sum()
        names = tuple("grade_" + "".join(name[-1] for name in group) for group in classes)
        ones = np.ones(len(names))
        orders = [*_ORDERS.values(), *[_ORDER_OF_GRADES] * len(names)]
        settings = {key: value for key, value in response.settings.items() if key != "order"}
        settings |= {"orders": orders, "tolerance": tolerance, "grades": [finest, coarsest]}
        settings |= {"cost_shares": self.cost_shares.tolist(), "cost_limit": self.cost_limit}
        settings |= {"process_speed_rad_s": self.process_speed, "margin": self.margin}
        StoredFront.__init__(self, f"{response.variant}_grades", settings)

        band = UniformBand(tolerance)
        low, high = finest * (1.0 - tolerance), coarsest * (1.0 + tolerance)
        drive = surrogate_box(self.model, response.theta_s, box, tolerance)
        self.surrogate = self._fitted(_wider(drive, names, low * ones, high * ones), orders)
        scatter: list[TruncatedNormal | UniformBand] = [response.theta_s]
        self.inputs = (*scatter, *[band] * (len(DESIGN_VARIABLES) + len(names)))
        space = _wider(response.design_box, names, finest * ones, coarsest * ones)
        moments = ExactMoments(self.surrogate, self.inputs, space)
        RobustProblem.__init__(self, moments, OBJECTIVES, UNITS | dict.fromkeys(names, "1"))
        self.n_ieq_constr = 2

    def dte_arcsec(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the DTE by the drive model, averaged over the conditions, shape (n,), in arcsec.

        Parameters
        ----------
        points : ndarray, shape (n, 5 + n_grades)
            `PARAMETERS` in SI units, then the grades.

        Raises
        ------
        UnstableDrive
            If a drive has no steady state.
        """
        parameters, grades = np.split(points, [len(PARAMETERS)], axis=1)
        lines = grades.shape[1]
        average = np.zeros(len(points))
        for condition, share in zip(self.conditions, shares(self.conditions), strict=True):
            there = self.model.at(condition.input_speed, condition.load_torque)
            equations = there.coefficients(parameters)
            # Effects may have added lines of their own behind those of theta_s.
            phasors = equations.error_phasors.copy()
            phasors[:, :lines] *= grades
            motion = hill_steady_state(replace(equations, error_phasors=phasors))
            average += share * motion.peak_to_peak(there.sheet.ratio) / ARCSEC
        return average

    def _fitted(self, box: Box, orders: Sequence[int]) -> ChebyshevSurrogate:
        sizes = [order + 1 for order in orders]
        grid = np.meshgrid(*map(chebyshev_nodes, sizes), indexing="ij")
        nodes = box.from_cube(np.stack(grid, axis=-1).reshape(-1, len(box)))
        values = self.dte_arcsec(nodes).reshape(sizes)
        provenance = {"model": self.model.to_dict(), "output": "DTE in arcsec"}
        return ChebyshevSurrogate(box, coefficients_from_nodes(values), provenance)

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        x = self.moments.design_box.settle(x)
        super()._evaluate(x, out, *args, **kwargs)
        grades = x[:, len(DESIGN_VARIABLES) :]
        cost = (1.0 / grades) @ self.cost_shares
        frequency, slope = self.resonance(x)
        excitation = LOBES * self.process_speed
        away = (frequency / excitation - 1.0) / self.margin
        out["G"] = np.column_stack([cost / self.cost_limit - 1.0, 1.0 - away**2])
        if "dG" in out:
            of_cost = np.zeros_like(x)
            of_cost[:, len(DESIGN_VARIABLES) :] = -self.cost_shares / grades**2 / self.cost_limit
            of_margin = -2.0 * away[:, None] * slope / (self.margin * excitation)
            out["dG"] = np.stack([of_cost, of_margin], axis=1)

    def resonance(self, designs: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Return the undamped torsional resonance of n designs and its slope.

        Parameters
        ----------
        designs : ndarray, shape (n, n_var)
            SI.

        Returns
        -------
        frequency : ndarray, shape (n,)
            rad/s.
        slope : ndarray, shape (n, n_var)
            By each variable, in its unit.
        """
        stiffness, inertia = designs[:, 0], designs[:, 1]
        referred = self.model.sheet.ratio**2 * inertia
        frequency = np.sqrt(stiffness * (1.0 / self._output_inertia + 1.0 / referred))
        slope = np.zeros_like(designs)
        slope[:, 0] = frequency / (2.0 * stiffness)
        slope[:, 1] = -stiffness / (2.0 * referred * inertia * frequency)
        return frequency, slope


def _classes(model: DriveModel) -> list[tuple[str, ...]]:
    """Return the error classes of the data sheet behind each line of theta_s."""
    classes = []
    for order in model.kinematic_error.orders:
        names = [name for name, own in model.sheet.error_orders.items() if np.isclose(own, order)]
        if not _sources(model.sheet, names):
            allowed = "orders at which error sources of the data sheet err"
            raise InvalidInput("kinematic_error.orders", model.kinematic_error.orders, allowed)
        classes.append(tuple(names))
    return classes


def _sources(sheet: DataSheet, classes: Sequence[str]) -> list[str]:
    return [source.symbol for source in sheet.error_sources if source.error_class in classes]


def _wider(
    box: Box, names: tuple[str, ...], lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> Box:
    """Return a box with further variables behind its own."""
    bounds = np.concatenate([box.lower, lower]), np.concatenate([box.upper, upper])
    return Box((*box.names, *names), *bounds)
