"""Robust design for pymoo: minimise mean and standard deviation of an uncertain response."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.problem import Problem

from pymoo_hdte.checks import one_of
from pymoo_hdte.surrogate import (
    Box,
    ChebyshevSurrogate,
    ExactMoments,
    SampledMoments,
    TruncatedNormal,
    UniformBand,
    VariableBandMoments,
    latin_hypercube,
)
from pymoo_hdte.surrogate.box import corners
from pymoo_hdte.surrogate.sign import sign_at_nodes
from pymoo_hdte.surrogate.trust import UntrustedSurrogate, region_of

MOMENTS = ("exact", "sample")

_LOOKED_AT = 256
"""Corners of the box at most, and designs within it, at which the sign of the mean is looked at."""


def make_moments(
    kind: str,
    surrogate: ChebyshevSurrogate,
    inputs: Sequence[TruncatedNormal | UniformBand],
    design_box: Box,
    n_samples: int,
    sample_seed: int,
) -> ExactMoments | SampledMoments:
    """Return the moments of one of the `MOMENTS`; only sampled ones need number and seed.

    Raises
    ------
    InvalidInput
        For another kind, and as `ExactMoments` and `SampledMoments`.
    """
    if one_of("moments", kind, MOMENTS) == "exact":
        return ExactMoments(surrogate, inputs, design_box)
    return SampledMoments(surrogate, inputs, design_box, n_samples, sample_seed)


class RobustProblem(Problem):
    """Minimise f1 = mean and f2 = standard deviation of a response (Eqs. 29 and 30).

    The design box of the moments is the search space. All designs are evaluated at once, so pymoo's
    runners have nothing to parallelise. Ask for ``dF`` (shape (n, 2, n_var)) in
    ``return_values_of`` to get exact gradients.

    Parameters
    ----------
    moments : ExactMoments, SampledMoments or VariableBandMoments
        Moments of the response, over the designs.
    obj_names : tuple of str
        Names of the objectives: of these two, and of those that a subclass adds.
    units : dict of str
        Unit of every variable and objective, by name.
    positive : bool or None
        Whether the response cannot be negative. Then a mean below 0 is refused. Without a word
        on it, a mean is refused whose sign is none of those that the response has at any node of
        its surrogate; False refuses nothing.

    Attributes
    ----------
    positive : bool or None
        As given.
    var_names, obj_names : tuple of str
        Names in the order of X, shape (n, n_var), and F, shape (n, n_obj).
    units : dict of str
        Unit of each, by name.

    Raises
    ------
    UntrustedSurrogate
        If the mean of some design has a sign that the response cannot have; tells where.

    Notes
    -----
    Evaluating a design outside the box, or one that is NaN, raises `ExtrapolationError`. One that
    is outside only because its values were printed with four digits is evaluated on the boundary
    (`Box.settle`).

    Examples
    --------
    >>> isinstance(RobustDTE(), RobustProblem)
    True
    """

    def __init__(
        self,
        moments: ExactMoments | SampledMoments | VariableBandMoments,
        obj_names: tuple[str, ...],
        units: dict[str, str],
        positive: bool | None = None,
    ) -> None:
        box: Box = moments.design_box
        self.positive = positive
        n_obj = len(obj_names)
        super().__init__(n_var=len(box), n_obj=n_obj, xl=box.lower.copy(), xu=box.upper.copy())
        self.moments = moments
        self.var_names = box.names
        self.obj_names = obj_names
        self.units = units
        self._refuse_wrong_sign()

    def _refuse_wrong_sign(self) -> None:
        sign = 1.0 if self.positive else sign_at_nodes(self.moments.surrogate)
        if self.positive is False or not sign:
            return
        box: Box = self.moments.design_box
        ends = np.column_stack([box.lower, box.upper])
        designs = np.vstack([corners(ends, _LOOKED_AT), latin_hypercube(box, _LOOKED_AT, 0)])
        mean, _ = self.moments(designs)
        wrong = sign * mean < 0.0
        if wrong.any():
            region = region_of(box.names, designs[wrong], np.array([box.lower, box.upper]))
            worst = float(sign * np.min(sign * mean))
            side = "above" if sign > 0.0 else "below"
            allowed = f"{side} 0, but {100.0 * wrong.mean():.0f} % of the designs are not"
            field = f"{self.obj_names[0]} on the surrogate"
            raise UntrustedSurrogate(field, worst, allowed, region)

    def _evaluate(
        self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any
    ) -> None:
        """Fill ``F``, and ``dF`` if requested.

        Raises
        ------
        ExtrapolationError
            If a design is outside the box or NaN: the surrogate knows nothing there, and a NaN
            objective would pass for a non-dominated one.
        """
        designs = self.moments.design_box.settle(x)
        out["F"] = np.column_stack(self.moments(designs))
        if "dF" in out:
            out["dF"] = np.stack(self.moments.gradient(designs), axis=1)
