"""What a set of effects leaves if each of its laws may have any form.

A real law has no form that a library holds exactly. The corrections of its form span what other
forms of it can do, to first order around the fitted set. What is left beyond them and all
parameters is no error of form: if it is significant, something else is missing, and an effect that
takes it away is earned however little it is beside the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Evidence, Fit
from pymoo_hdte.discrepancy._selection.freed import in_free_form
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    adequate,
    down_to_noise,
    gains_enough,
)
from pymoo_hdte.discrepancy._selection.screening import Screened, basis_of, reduced, varied


@dataclass(frozen=True, eq=False)
class Rest:
    """What a fit leaves beyond its parameters and the forms of its laws.

    Attributes
    ----------
    directions : ndarray, shape (n, k)
        What these can do, orthonormal.
    residual : ndarray, shape (n,)
        Beyond them.
    excess : float
        Its chi-square beyond the degrees of freedom that it has.
    noise : float
        Excess up to which it is noise, by these degrees of freedom.
    """

    directions: NDArray[np.float64]
    residual: NDArray[np.float64]
    excess: float
    noise: float

    @property
    def is_noise(self) -> bool:
        """Whether nothing but noise is left."""
        return self.excess <= self.noise


class AnyForm:
    """Sets of effects whose laws may have any form.

    Parameters
    ----------
    data : Evidence
    base : Fit
        Without effects.

    Attributes
    ----------
    degrees_of_freedom : int
        Of the base.
    excess : float
        Chi-square of the base beyond them.
    """

    def __init__(self, data: Evidence, base: Fit) -> None:
        self.data, self.base = data, base
        self.degrees_of_freedom = len(base.residuals) - len(base.values)
        self.excess = base.chi_square - self.degrees_of_freedom
        self._rests: dict[Fit, Rest | None] = {}
        self._free: dict[Fit, Fit] = {}
        self._by_place: dict[tuple[str, str, float | None], NDArray[np.float64]] = {}

    def known(self, candidates: Sequence[Candidate]) -> bool:
        """Tell whether other forms of all these laws are known: not of an effect of one's own."""
        return all(self.data.corrections(one) for one in candidates)

    def rest(self, fitted: Fit) -> Rest | None:
        """Return what a fit leaves; None where that says nothing.

        For machines whose laws have no known corrections, and where parameters and forms together
        could follow any data.
        """
        if fitted not in self._rests:
            self._rests[fitted] = self._rest(fitted)
        return self._rests[fitted]

    def rest_is_noise(self, fitted: Fit) -> bool:
        """Tell whether a fit leaves nothing but noise and errors of form."""
        return (rest := self.rest(fitted)) is not None and rest.is_noise

    def explains(self, one: Hypothesis) -> bool:
        """Tell whether a set removes most of the misfit and leaves nothing but errors of form.

        Laws whose forms are known exactly leave no more than their model's own error.
        """
        rules = self.data.rules
        share = rules.exact_share if one.exact else rules.explained_share
        enough = one.explained >= share and gains_enough(one, self.base, rules)
        return enough and self.rest_is_noise(one.fit)

    def explains_in_another(self, one: Hypothesis) -> bool:
        """Tell whether a set explains the misfit in another form, however little as listed.

        The base may imitate what the listed form shares with others: of a friction that grows with
        a power of the load nearly all is a gain of the torque sensor, and the power is the misfit.
        Every curve and harmonic of the form counts as an unknown.
        """
        rules, (fitted, rest) = self.data.rules, self._nearest(one)
        if rest is None or not rest.is_noise:
            return False
        removed = self.excess - rest.excess
        unknowns = rest.directions.shape[1] - np.sum(fitted.bound_sides[: fitted.n_base] == 0.0)
        gain = removed - unknowns * np.log(len(rest.residual))
        return removed >= rules.partial_share * self.excess and bool(gain >= rules.bic_gain)

    def share_in_another(self, one: Hypothesis) -> float:
        """Return the share of the misfit that a set removes in another form of its laws, 0 to 1."""
        _, rest = self._nearest(one)
        left = self.excess if rest is None else np.clip(rest.excess, 0.0, self.excess)
        return float(1.0 - left / self.excess)

    def _nearest(self, one: Hypothesis) -> tuple[Fit, Rest | None]:
        """Return the fit around which forms of a set leave least, and what they leave.

        That of the listed form, unless little but more than noise is left to first order: the other
        may be far from it.
        """
        rest, least = self.rest(one.fit), self.data.rules.explained_share * self.excess
        if rest is None or rest.is_noise or self.excess - rest.excess < least:
            return one.fit, rest
        fitted = self.in_free_form(one.fit)
        return fitted, self.rest(fitted)

    def in_free_form(self, fitted: Fit) -> Fit:
        """Return a fit with the form of its laws free: see `freed`."""
        if fitted not in self._free:
            self._free[fitted] = in_free_form(self.data, fitted)
        return self._free[fitted]

    def hopeful_in_another(self, known: Sequence[Screened]) -> list[Screened]:
        """Return the effects that may explain the misfit of the base in some form of their laws.

        To first order beside the base: what comes nearest to it, and what comes about as near, of
        effects that are ``known`` with their signatures beside the base.
        """
        rules = self.data.rules
        columns = [
            np.column_stack([self._of_base, each.signatures.T, self._forms_of(each.candidate).T])
            for each in known
        ]
        rests = [self._beyond(each, self.base.residuals) for each in columns]
        left = np.array([np.inf if one is None else one.excess for one in rests])
        least = max(left.min(initial=np.inf), self._noise(self.degrees_of_freedom))
        most = min(rules.form_ratio * least, (1.0 - rules.second_hope_share) * self.excess)
        found = [known[k] for k in np.argsort(left) if left[k] <= most]
        return varied(found, rules.most_of_one_name)[: rules.most_fitted]

    @cached_property
    def _of_base(self) -> NDArray[np.float64]:
        """What the base's parameters can do, orthonormal, shape (n, k)."""
        return basis_of(self.base.jacobian[:, self.base.bound_sides == 0.0])

    def earns(self, one: Hypothesis, without: Hypothesis) -> bool:
        """Tell whether a member is earned: what is left without it is no error of form.

        The set leaves nothing but noise beyond its forms, and most of what it leaves ``without``
        the member is gone, more than noise and the model's own error can be. Or nearly all is gone
        of what contradicts the others in every form, by the listed form of the member, so that no
        contradiction is left: nothing follows the remainder of another's form so well.
        """
        both, left = self.rest(one.fit), self.rest(without.fit)
        if both is None or left is None:
            return False
        rules, removed = self.data.rules, left.excess - both.excess
        kept = {each.label for each in without.candidates}
        member = [each for each in one.candidates if each.label not in kept]
        if both.is_noise and removed >= self._least(without, member, left):
            return True
        contradicting = (rules.contradicting_chi_square - 1.0) * self.degrees_of_freedom
        return (
            both.excess < contradicting < left.excess
            and removed >= rules.beyond_forms_share * left.excess
            and self.known([each for each in without.candidates if not each.exact])
            and not self.only_in_another(one, without)
        )

    def only_in_another(self, one: Hypothesis, without: Hypothesis) -> bool:
        """Tell whether a member takes less in its listed form than in any, of what others leave."""
        both, left = self.rest(one.fit), self.rest(without.fit)
        if both is None or left is None:
            return False
        in_any = left.excess - both.excess
        listed = without.fit.chi_square - one.fit.chi_square
        return listed < self.data.rules.explained_part_share * in_any

    def beside(self, one: Hypothesis, known: Sequence[Screened]) -> list[Screened]:
        """Return the effects that may remove most of what a set leaves beyond its forms.

        Where none does in its listed form, and little is left, those that do in any form.

        Parameters
        ----------
        one : Hypothesis
        known : sequence of Screened
            Effects that may be added, with their signatures beside the base.
        """
        rest = self.rest(one.fit)
        if rest is None or not known:
            return []
        rules = self.data.rules
        found = [reduced(each, rest.directions, rest.residual) for each in known]
        found.sort(key=lambda each: -each.reduction)
        asked = [(each, self._least(one, (each.candidate,), rest)) for each in found]
        if not self.leaves_noise(one):
            asked = [(each, least) for each, least in asked if rest.excess >= least]
        ranked = [each for each, _ in asked]
        hopeful = [each for each, least in asked if each.reduction >= least]
        little = one.explained >= rules.explained_share
        if not hopeful and little and not rest.is_noise:
            gains = [self._in_any_form(each, rest) for each in ranked]
            places = [k for k in np.argsort(gains)[::-1] if rest.excess - gains[k] <= rest.noise]
            hopeful = [ranked[k] for k in places]
        return varied(hopeful, 1)[: rules.most_seconds]

    def _least(self, one: Hypothesis, member: Sequence[Candidate], rest: Rest) -> float:
        """Return what a further member has to remove beyond the forms of a set.

        Of laws with memory the model's own error is a share of the whole misfit. Of others it is
        that of exact forms where the listed forms leave no more than noise, and the square of the
        share that they leave elsewhere. A gain that noise alone does not give is the least.
        """
        rules, to_noise = self.data.rules, self.leaves_noise(one)
        error = rules.exact_model_accuracy**2
        if not one.exact:
            # At one port the corrections of a form need not hold all that a real law does.
            if any(each.beside(other) for each in member for other in one.candidates):
                error = rules.second_form_share
            elif any(each.remembers for each in one.candidates):
                error = self.data.remainder
            elif not to_noise:
                # Corrections are of first order: what they leave of a form is of the second.
                left = (one.fit.chi_square - self.degrees_of_freedom) / self.excess
                error = min(max(error, left**2), self.data.remainder)
        least = max(rules.single_effect_gain, error * self.excess)
        return least if to_noise else max(least, rules.explained_part_share * rest.excess)

    def leaves_noise(self, one: Hypothesis) -> bool:
        """Tell whether a set explains the data down to the noise, in its listed forms."""
        return down_to_noise(one.fit, self.degrees_of_freedom, self.data.rules)

    def _rest(self, fitted: Fit) -> Rest | None:
        forms = [self.data.corrections(one) for one in fitted.candidates]
        if any(form is None for form in forms):
            return None
        response = self.data.response(fitted)
        columns = [response((one,)) for form in forms for one in form or ()]
        free = fitted.bound_sides == 0.0
        # A bound of an effect's own unknowns limits the listed form only.
        free[fitted.n_base :] = True
        parameters = fitted.jacobian[:, free]
        return self._beyond(np.column_stack([parameters, *columns]), fitted.residuals)

    def _beyond(self, columns: NDArray[np.float64], residuals: NDArray[np.float64]) -> Rest | None:
        """Return what residuals (n,) hold beyond columns (n, m); None if these follow any data."""
        directions = basis_of(columns)
        residual = residuals - directions @ (directions.T @ residuals)
        freedom = len(residual) - directions.shape[1]
        if freedom < 1:
            return None
        excess = float(residual @ residual) - freedom
        return Rest(directions, residual, excess, self._noise(freedom))

    def _noise(self, freedom: int) -> float:
        """Return the excess chi-square up to which so many degrees of freedom are noise."""
        return (adequate(freedom, self.data.rules) - 1.0) * freedom

    def _in_any_form(self, one: Screened, rest: Rest) -> float:
        """Return what an effect removes in any form, less what noise gives so many unknowns."""
        directions = np.concatenate([one.signatures, self._forms_of(one.candidate)])
        beyond = directions - (directions @ rest.directions) @ rest.directions.T
        free = basis_of(beyond.T)
        return float(np.sum((free.T @ rest.residual) ** 2)) - free.shape[1]

    def _forms_of(self, candidate: Candidate) -> NDArray[np.float64]:
        """Return the corrections of a candidate's form beside the base, shape (k, n)."""
        place = (candidate.name, candidate.port, candidate.order)
        if place not in self._by_place:
            response = self.data.response(self.base)
            found = [response((one,)) for one in self.data.corrections(candidate) or ()]
            self._by_place[place] = np.array(found).reshape(-1, len(self.base.residuals))
        return self._by_place[place]
