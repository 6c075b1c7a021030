"""What a set of effects leaves unexplained if each of its laws may have any form.

No library holds the exact form of a real law. The corrections of a form span what other forms can
do, to first order around the fitted set. What remains beyond them and all parameters is no error of
form. If that is significant, something else is missing, and an effect that removes it is
significant however small it is beside the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.fitting import Fit, JudgedEvidence
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    adequate,
    down_to_noise,
    gains_enough,
)
from pymoo_hdte.discrepancy._selection.released import in_free_form
from pymoo_hdte.discrepancy._selection.screening import Screened, basis_of, reduced, varied


@dataclass(frozen=True, eq=False)
class UnexplainedResidual:
    """What a fit leaves beyond its parameters and the forms of its laws.

    Attributes
    ----------
    directions : ndarray, shape (n, k)
        Orthonormal basis of the changes that parameters and forms can make.
    residual : ndarray, shape (n,)
        Residual orthogonal to these directions.
    excess : float
        Chi-square of the residual beyond its degrees of freedom.
    noise : float
        Largest excess that noise alone gives with these degrees of freedom.
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
    data : JudgedEvidence
    base : Fit
        Fit without effects.

    Attributes
    ----------
    degrees_of_freedom : int
        Degrees of freedom of the base.
    excess : float
        Chi-square of the base beyond its degrees of freedom.
    """

    def __init__(self, data: JudgedEvidence, base: Fit) -> None:
        self.data, self.base = data, base
        self.degrees_of_freedom = len(base.residuals) - len(base.values)
        self.excess = base.chi_square - self.degrees_of_freedom
        self._residuals: dict[Fit, UnexplainedResidual | None] = {}
        self._free_fits: dict[Fit, Fit] = {}
        self._forms_by_place: dict[tuple[str, str, float | None], NDArray[np.float64]] = {}

    def forms_are_known(self, candidates: Sequence[Candidate]) -> bool:
        """Tell whether other forms of all these laws are known; of a user's effect they are not."""
        return all(self.data.corrections(candidate) for candidate in candidates)

    def unexplained(self, fitted: Fit) -> UnexplainedResidual | None:
        """Return what a fit leaves; None if that says nothing.

        It says nothing if no corrections of a law are known, or if parameters and forms together
        could follow any data.
        """
        if fitted not in self._residuals:
            self._residuals[fitted] = self._compute_unexplained(fitted)
        return self._residuals[fitted]

    def unexplained_is_noise(self, fitted: Fit) -> bool:
        """Tell whether a fit leaves nothing but noise and errors of form."""
        return (unexplained := self.unexplained(fitted)) is not None and unexplained.is_noise

    def explains(self, hypothesis: Hypothesis) -> bool:
        """Tell whether a set removes most of the misfit and leaves nothing but errors of form.

        Laws whose forms are known exactly leave no more than their model's own error.
        """
        rules = self.data.rules
        share = rules.exact_share if hypothesis.exact else rules.explained_share
        enough = hypothesis.explained >= share and gains_enough(hypothesis, self.base, rules)
        return enough and self.unexplained_is_noise(hypothesis.fit)

    def explains_in_another_form(self, hypothesis: Hypothesis) -> bool:
        """Tell whether a set explains the misfit in another form, however little as listed.

        The base may imitate what the listed form shares with others. Friction that grows with a
        power of the load is nearly a gain of the torque sensor: the misfit shows only the power.
        Every curve and harmonic of the form counts as an unknown.
        """
        rules, (fitted, unexplained) = self.data.rules, self._closest_fit(hypothesis)
        if unexplained is None or not unexplained.is_noise:
            return False
        removed = self.excess - unexplained.excess
        unknowns = unexplained.directions.shape[1] - np.sum(
            fitted.bound_sides[: fitted.n_base] == 0.0
        )
        gain = removed - unknowns * np.log(len(unexplained.residual))
        return removed >= rules.partial_share * self.excess and bool(gain >= rules.bic_gain)

    def share_in_another_form(self, hypothesis: Hypothesis) -> float:
        """Return the share of the misfit that a set removes in another form of its laws, 0 to 1."""
        _, unexplained = self._closest_fit(hypothesis)
        excess = (
            self.excess if unexplained is None else np.clip(unexplained.excess, 0.0, self.excess)
        )
        return float(1.0 - excess / self.excess)

    def _closest_fit(self, hypothesis: Hypothesis) -> tuple[Fit, UnexplainedResidual | None]:
        """Return the fit around which forms of a set leave least, and what they leave.

        This is the fit of the listed form, unless little is left to first order, but more than
        noise: the true form may then be far from the listed one.
        """
        unexplained = self.unexplained(hypothesis.fit)
        least = self.data.rules.explained_share * self.excess
        if unexplained is None or unexplained.is_noise or self.excess - unexplained.excess < least:
            return hypothesis.fit, unexplained
        fitted = self.in_free_form(hypothesis.fit)
        return fitted, self.unexplained(fitted)

    def in_free_form(self, fitted: Fit) -> Fit:
        """Return a fit with the form of its laws free, as `released.in_free_form` does."""
        if fitted not in self._free_fits:
            self._free_fits[fitted] = in_free_form(self.data, fitted)
        return self._free_fits[fitted]

    def shortlisted_in_another_form(self, screened: Sequence[Screened]) -> list[Screened]:
        """Return the effects that may explain the misfit of the base in some form of their laws.

        They are ranked by what they leave to first order. The best is returned with all that leave
        about as little. Signatures of ``screened`` effects are those beside the base.
        """
        rules = self.data.rules
        columns = [
            np.column_stack(
                [self._of_base, effect.signatures.T, self._forms_of(effect.candidate).T]
            )
            for effect in screened
        ]
        residuals = [self._beyond(directions, self.base.residuals) for directions in columns]
        excesses = np.array(
            [np.inf if residual is None else residual.excess for residual in residuals]
        )
        smallest = max(excesses.min(initial=np.inf), self._noise(self.degrees_of_freedom))
        limit = min(rules.form_ratio * smallest, (1.0 - rules.second_hope_share) * self.excess)
        shortlist = [screened[k] for k in np.argsort(excesses) if excesses[k] <= limit]
        return varied(shortlist, rules.most_of_one_name)[: rules.most_fitted]

    @cached_property
    def _of_base(self) -> NDArray[np.float64]:
        """Orthonormal basis of the changes that the base's parameters can make, shape (n, k)."""
        return basis_of(self.base.jacobian[:, self.base.bound_sides == 0.0])

    def is_significant(self, hypothesis: Hypothesis, simpler: Hypothesis) -> bool:
        """Tell whether a member is significant: what is left without it is no error of form.

        Either the set leaves only noise beyond its forms, and the member removes most of what the
        ``simpler`` set without it leaves, more than noise or the model's own error can be. Or the
        member in its listed form removes nearly all of what contradicts the simpler set in every
        form, and no contradiction remains. Nothing follows an error of another's form so well.
        """
        after, before = self.unexplained(hypothesis.fit), self.unexplained(simpler.fit)
        if after is None or before is None:
            return False
        rules, removed = self.data.rules, before.excess - after.excess
        labels = {candidate.label for candidate in simpler.candidates}
        member = [candidate for candidate in hypothesis.candidates if candidate.label not in labels]
        if after.is_noise and removed >= self._required_gain(simpler, member, before):
            return True
        contradicting = (rules.contradicting_chi_square - 1.0) * self.degrees_of_freedom
        return (
            after.excess < contradicting < before.excess
            and removed >= rules.beyond_forms_share * before.excess
            and self.forms_are_known(
                [candidate for candidate in simpler.candidates if not candidate.exact]
            )
            and not self.only_in_another_form(hypothesis, simpler)
        )

    def only_in_another_form(self, hypothesis: Hypothesis, simpler: Hypothesis) -> bool:
        """Tell whether a member removes much less in its listed form than in any other form."""
        after, before = self.unexplained(hypothesis.fit), self.unexplained(simpler.fit)
        if after is None or before is None:
            return False
        in_any = before.excess - after.excess
        listed = simpler.fit.chi_square - hypothesis.fit.chi_square
        return listed < self.data.rules.explained_part_share * in_any

    def shortlisted_beside(
        self, hypothesis: Hypothesis, screened: Sequence[Screened]
    ) -> list[Screened]:
        """Return the effects that may remove most of what a set leaves beyond its forms.

        If none does in its listed form and little is left, those that do in any form are returned.

        Parameters
        ----------
        hypothesis : Hypothesis
        screened : sequence of Screened
            Effects that may be added, with their signatures beside the base.
        """
        unexplained = self.unexplained(hypothesis.fit)
        if unexplained is None or not screened:
            return []
        rules = self.data.rules
        effects = [
            reduced(effect, unexplained.directions, unexplained.residual) for effect in screened
        ]
        effects.sort(key=lambda effect: -effect.reduction)
        required = [
            (effect, self._required_gain(hypothesis, (effect.candidate,), unexplained))
            for effect in effects
        ]
        if not self.leaves_noise(hypothesis):
            required = [
                (effect, least) for effect, least in required if unexplained.excess >= least
            ]
        ranked = [effect for effect, _ in required]
        shortlist = [effect for effect, least in required if effect.reduction >= least]
        little = hypothesis.explained >= rules.explained_share
        if not shortlist and little and not unexplained.is_noise:
            gains = [self._in_any_form(effect, unexplained) for effect in ranked]
            places = [
                k
                for k in np.argsort(gains)[::-1]
                if unexplained.excess - gains[k] <= unexplained.noise
            ]
            shortlist = [ranked[k] for k in places]
        return varied(shortlist, 1)[: rules.most_seconds]

    def _required_gain(
        self, hypothesis: Hypothesis, member: Sequence[Candidate], unexplained: UnexplainedResidual
    ) -> float:
        """Return the chi-square that a further member has to remove beyond the forms of a set.

        It has to exceed what noise gives, and the model's own error. For laws with memory that
        error is a share of the whole misfit. For others it is that of exact forms if the listed
        forms leave only noise, and otherwise the square of the share that they leave.
        """
        rules, to_noise = self.data.rules, self.leaves_noise(hypothesis)
        error = rules.exact_model_accuracy**2
        if not hypothesis.exact:
            # The corrections of a form need not span all that a real law does at the same port.
            if any(
                candidate.shares_port_with(present)
                for candidate in member
                for present in hypothesis.candidates
            ):
                error = rules.second_form_share
            elif any(candidate.remembers for candidate in hypothesis.candidates):
                error = self.data.model_error_share
            elif not to_noise:
                # Corrections are of first order, so that their own error is of second order.
                share = (hypothesis.fit.chi_square - self.degrees_of_freedom) / self.excess
                error = min(max(error, share**2), self.data.model_error_share)
        least = max(rules.single_effect_gain, error * self.excess)
        return least if to_noise else max(least, rules.explained_part_share * unexplained.excess)

    def leaves_noise(self, hypothesis: Hypothesis) -> bool:
        """Tell whether a set explains the data down to the noise in its listed forms."""
        return down_to_noise(hypothesis.fit, self.degrees_of_freedom, self.data.rules)

    def _compute_unexplained(self, fitted: Fit) -> UnexplainedResidual | None:
        forms = [self.data.corrections(candidate) for candidate in fitted.candidates]
        if any(form is None for form in forms):
            return None
        response = self.data.response(fitted)
        columns = [response((correction,)) for form in forms for correction in form or ()]
        released = fitted.bound_sides == 0.0
        # A bound of an effect's own unknowns limits the listed form only.
        released[fitted.n_base :] = True
        parameters = fitted.jacobian[:, released]
        return self._beyond(np.column_stack([parameters, *columns]), fitted.residuals)

    def _beyond(
        self, columns: NDArray[np.float64], residuals: NDArray[np.float64]
    ) -> UnexplainedResidual | None:
        """Return what columns (n, m) leave of residuals (n,); None if they can follow any data."""
        directions = basis_of(columns)
        residual = residuals - directions @ (directions.T @ residuals)
        freedom = len(residual) - directions.shape[1]
        if freedom < 1:
            return None
        excess = float(residual @ residual) - freedom
        return UnexplainedResidual(directions, residual, excess, self._noise(freedom))

    def _noise(self, freedom: int) -> float:
        """Return the excess chi-square up to which so many degrees of freedom are noise."""
        return (adequate(freedom, self.data.rules) - 1.0) * freedom

    def _in_any_form(self, effect: Screened, unexplained: UnexplainedResidual) -> float:
        """Return the chi-square that an effect in any form removes, beyond that of noise."""
        directions = np.concatenate([effect.signatures, self._forms_of(effect.candidate)])
        beyond = directions - (directions @ unexplained.directions) @ unexplained.directions.T
        basis = basis_of(beyond.T)
        return float(np.sum((basis.T @ unexplained.residual) ** 2)) - basis.shape[1]

    def _forms_of(self, candidate: Candidate) -> NDArray[np.float64]:
        """Return the responses to corrections of a candidate's form, shape (k, n)."""
        place = (candidate.name, candidate.port, candidate.order)
        if place not in self._forms_by_place:
            response = self.data.response(self.base)
            corrections = self.data.corrections(candidate) or ()
            changes = [response((correction,)) for correction in corrections]
            self._forms_by_place[place] = np.array(changes).reshape(-1, len(self.base.residuals))
        return self._forms_by_place[place]
