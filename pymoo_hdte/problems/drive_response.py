"""The DTE around a drive's nominal design: what is designed, what scatters, and its surrogate."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.checks import InvalidInput, real_number, whole_number
from pymoo_hdte.drive import PARAMETER_UNITS, PARAMETERS, PRESETS, DriveModel, preset
from pymoo_hdte.problems.operating_conditions import (
    OperatingCondition,
    duty_cycle,
    duty_cycle_dte_arcsec,
    shares,
)
from pymoo_hdte.surrogate import Box, ChebyshevSurrogate, TruncatedNormal
from pymoo_hdte.surrogate.box import corners
from pymoo_hdte.units import ARCSEC

SURROGATE_BOX = 0.35
"""Half-width of the surrogate's box as a share of the nominal values (Section 3)."""

PAPERS_ORDER = 3

HIGHEST_ORDER = 6
"""Highest order: its 16,807 model runs, time and memory grow with the tenth power."""

DESIGN_VARIABLES = PARAMETERS[1:]
"""U = (K, J_in, B_in, B_fc) of Section 5.1; theta_s is noise."""

OBJECTIVES = ("mean_dte_arcsec", "std_dte_arcsec")

UNITS = dict(zip(PARAMETERS[1:], PARAMETER_UNITS[1:], strict=True))
UNITS |= dict.fromkeys(OBJECTIVES, "arcsec")
"""Units of design variables and objectives, by name."""

_SHARE_DECIMALS = 12
"""Decimals to which shares of weights are rounded, so that weights in any unit give one front."""


class DriveResponse:
    """DTE of a drive, averaged over its duty cycle, as the robust problems see it.

    Parameters
    ----------
    model : str or DriveModel
        A preset or a model.
    order : int
        Order of the surrogate, 1 to 6.
    box : float
        Relative half-width of the search space.
    conditions : sequence of OperatingCondition or None
        The duty cycle; None for the rated condition of the data sheet.

    Attributes
    ----------
    model : DriveModel
    theta_s : TruncatedNormal
        Its scatter over prototypes, in rad.
    nominal : ndarray, shape (4,)
        The initial design.

    Raises
    ------
    InvalidInput
        For an argument that is not allowed, and for a model whose theta_s could become negative.
    """

    def __init__(
        self,
        model: str | DriveModel,
        order: int,
        box: float,
        conditions: Sequence[OperatingCondition] | None,
    ) -> None:
        if not isinstance(model, DriveModel | str):
            raise InvalidInput("model", model, f"a DriveModel or one of {', '.join(PRESETS)}")
        self.model = model if isinstance(model, DriveModel) else preset(model)
        self._order = whole_number("order", order, 1)
        if self._order > HIGHEST_ORDER:
            limit = f"1 to {HIGHEST_ORDER}, for (order + 1)^5 model runs"
            raise InvalidInput("order", order, limit)
        self._box = real_number("box", box, above=0.0, below=1.0)
        self._given = None if conditions is None else duty_cycle(conditions)
        self.theta_s = theta_s_scatter(self.model)
        self.nominal = self.model.nominal[1:]
        self.nominal.flags.writeable = False

    @property
    def conditions(self) -> tuple[OperatingCondition, ...]:
        """The duty cycle; of one condition if none was given."""
        if self._given is not None:
            return self._given
        return (OperatingCondition(self.model.sheet.input_speed, self.model.sheet.load_torque),)

    @cached_property
    def design_box(self) -> Box:
        """The search space."""
        lower, upper = self.nominal * (1.0 - self._box), self.nominal * (1.0 + self._box)
        return Box(DESIGN_VARIABLES, lower, upper)

    @property
    def variant(self) -> str:
        """Name: the model, its order if not the paper's, and whether it has a duty cycle."""
        order = "" if self._order == PAPERS_ORDER else f"_order{self._order}"
        return self.model.name + order + ("" if self._given is None else "_duty_cycle")

    @property
    def settings(self) -> dict[str, Any]:
        """The values that define the response, JSON-able, without names and descriptions.

        A duty cycle replaces the model's own speed and load.
        """
        left_out = {"name", "description", "provenance", "data_sheet"}
        if self._given is not None:
            left_out |= {"input_speed_rad_s", "load_torque_Nm"}
        fields = {key: value for key, value in self.model.to_dict().items() if key not in left_out}
        return fields | self._duty_cycle() | {"order": self._order, "box": self._box}

    def surrogate(self, tolerance: float) -> ChebyshevSurrogate:
        """Fit the surrogate in arcsec, on a box that bands of that tolerance do not leave.

        Raises
        ------
        UnstableDrive
            If the nominal design, or a corner or node of the box, has no steady state under some
            condition.
        """
        box = surrogate_box(self.model, self.theta_s, self._box, tolerance)
        # The nodes of the fit may miss an unstable nominal design, or corner of the box.
        self._dte_arcsec(
            np.vstack(
                [
                    self.model.nominal,
                    *corners(np.column_stack([box.lower, box.upper]), 2 ** len(box)),
                ]
            )
        )
        provenance = {"model": self.model.to_dict(), "output": "DTE in arcsec"}
        provenance |= self._duty_cycle()
        return ChebyshevSurrogate.fit(self._dte_arcsec, box, self._order, provenance)

    def _dte_arcsec(self, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        return duty_cycle_dte_arcsec(self.model, self.conditions, parameters)

    def _duty_cycle(self) -> dict[str, Any]:
        if self._given is None:
            return {}
        rows = [
            {
                "input_speed_rad_s": condition.input_speed,
                "load_torque_Nm": condition.load_torque,
                "share": round(float(share), _SHARE_DECIMALS),
            }
            for condition, share in zip(self._given, shares(self._given), strict=True)
        ]
        return {"conditions": rows}


def surrogate_box(model: DriveModel, theta_s: TruncatedNormal, box: float, tolerance: float) -> Box:
    """Return the box the surrogate is built on, over `PARAMETERS`.

    +-35 % of the nominal in the dynamic parameters, more where ``box`` and ``tolerance`` reach
    further, and the whole support of ``theta_s``.
    """
    lowest = min(1.0 - SURROGATE_BOX, (1.0 - box) * (1.0 - tolerance))
    highest = max(1.0 + SURROGATE_BOX, (1.0 + box) * (1.0 + tolerance))
    lower, upper = model.nominal * lowest, model.nominal * highest
    lower[0], upper[0] = theta_s.support
    return Box(PARAMETERS, lower, upper)


def theta_s_scatter(model: DriveModel) -> TruncatedNormal:
    """Return the distribution of theta_s over prototypes, in rad.

    Raises
    ------
    InvalidInput
        If theta_s could fall to 0 or below.
    """
    mean, std = model.nominal[0], model.kinematic_error.std
    theta_s = TruncatedNormal(mean, std)
    if theta_s.support[0] <= 0.0:
        limit = f"below {mean / theta_s.cut / ARCSEC:g} arcsec, so that theta_s stays above 0"
        raise InvalidInput("kinematic_error.std in arcsec", std / ARCSEC, limit)
    return theta_s
