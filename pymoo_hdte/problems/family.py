"""The robust DTE problems with a stored front, to compare algorithms on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from pymoo_hdte.problems.operating_conditions import hs_20_100_duty_cycle
from pymoo_hdte.problems.robust_dte import RobustDTE
from pymoo_hdte.problems.robust_dte_direct import RobustDTEDirect
from pymoo_hdte.problems.robust_dte_grades import RobustDTEGrades
from pymoo_hdte.problems.robust_dte_tolerance import RobustDTETolerance

Member = Callable[[], RobustDTE | RobustDTETolerance | RobustDTEGrades | RobustDTEDirect]


def robust_dte_family() -> dict[str, Member]:
    """Return the members by name, each as a function that builds the problem.

    Building fits a surrogate: a tenth of a second at the paper's order 3, about one at order 5, and
    the stored fronts are those of these surrogates. Only ``calibrated_direct`` has none: its front
    is the drive model's, to 1 % of its width, and a design takes it 20 ms. All but two
    have two objectives, four variables and no constraint: ``calibrated_tolerance`` has three
    objectives and five variables, ``calibrated_grades`` seven variables and two constraints.

    ======================== ==============================================================
    calibrated               the front of the order-3 surrogate; smooth, along the bounds
    resonant                 a front of two pieces; K and J_in leave their bounds, B_fc does not
    ..._order4, ..._order5   on finer surrogates (3125 and 7776 model runs); one piece each
    calibrated_duty_cycle    mean DTE over four operating conditions; two pieces
    calibrated_tolerance     the tolerance is a variable, its cost an objective
    calibrated_grades        grades of the error classes at a limited cost, off a resonance; three
                             pieces in two regions that no path joins
    calibrated_direct        the drive model itself, by quadrature
    ======================== ==============================================================

    Examples
    --------
    >>> list(robust_dte_family())[:3]
    ['calibrated', 'calibrated_order4', 'calibrated_order5']
    """
    orders = {"": 3, "_order4": 4, "_order5": 5}
    members: dict[str, Member] = {
        model + suffix: partial(RobustDTE, model, order)
        for model in ("calibrated", "resonant")
        for suffix, order in orders.items()
    }
    members["calibrated_duty_cycle"] = _duty_cycle
    members["calibrated_tolerance"] = RobustDTETolerance
    members["calibrated_grades"] = RobustDTEGrades
    members["calibrated_direct"] = RobustDTEDirect
    return members


def _duty_cycle() -> RobustDTE:
    return RobustDTE(conditions=hs_20_100_duty_cycle())
