"""The verdict: whether an effect is missing, which one it is, and how certain the answer is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from pymoo_hdte.discrepancy._selection.excess import HeldOutTest
from pymoo_hdte.discrepancy._selection.fitting import Fit
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, down_to_noise
from pymoo_hdte.discrepancy._selection.reason import (
    HELD_OUT_ERROR_GROWS,
    NOT_VALIDATED,
    Reason,
)
from pymoo_hdte.discrepancy._selection.rules import RULES, Rules

STATUSES = ("adequate", "named", "class", "parameter", "unlisted", "partial")
EXPLAINED = ("named", "class", "parameter", "partial")
"""Statuses that say what is missing."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is missing: its content, from which its ``status`` follows.

    Attributes
    ----------
    base : Fit
        Without any effect.
    chosen : Hypothesis or None
    certain : bool
        Whether the data show that the chosen effects are missing; without a chosen set, that
        nothing is.
    alternatives : tuple of Hypothesis
        Other sets that were fitted.
    equivalent : tuple of Hypothesis
        Those of them that explain the data, or leave the same of them, as well as the chosen one.
    degrees_of_freedom : int
    rules : Rules
        Thresholds of the verdict.
    reasons : tuple of Reason
        What forbids to name the chosen effects plainly; with ``"partial"`` and ``"class"`` they are
        certain as far as they go. In words they are ``caveats`` of an analysis.
    shown_in_held_out : bool
        Whether the records kept out of the fit, if there are any, show what is chosen.
    probability : float or None
        That it is right, by its posterior.
    seen_beyond : tuple of str
        Names of effects that are seen in what no fit holds, as ripple beyond the band of a motion.
    rivals_beyond : tuple of str
        What would explain as much and is in no fit, as the delay of an encoder.
    """

    base: Fit
    chosen: Hypothesis | None
    certain: bool
    alternatives: tuple[Hypothesis, ...]
    equivalent: tuple[Hypothesis, ...]
    degrees_of_freedom: int
    rules: Rules = RULES
    reasons: tuple[Reason, ...] = ()
    shown_in_held_out: bool = True
    probability: float | None = None
    seen_beyond: tuple[str, ...] = ()
    rivals_beyond: tuple[str, ...] = ()

    @property
    def status(self) -> str:
        """One of `STATUSES`, as the content of the verdict allows."""
        chosen = self.chosen
        if chosen is None:
            if not self.certain:
                return "unlisted"
            return "named" if self.seen_beyond else "adequate"
        if not (self.certain and chosen.listed) or self.has_reason(NOT_VALIDATED):
            return "unlisted"
        if self.equivalent or self.rivals_beyond:
            return "class"
        if self.reasons:
            return "partial"
        values_only = all(candidate.is_value for candidate in chosen.candidates)
        # One value that an effect covers is that effect.
        out = values_only and any(name == "parameter" for name, _ in chosen.names)
        return "parameter" if out else "named"

    @property
    def accepted(self) -> Fit:
        """The fit accepted by the verdict: without effects unless some are named."""
        chosen = self.chosen
        return chosen.fit if chosen is not None and self.status in EXPLAINED else self.base

    @property
    def leaves_more_than_noise(self) -> bool:
        """Whether the chosen effects do not explain the data down to the noise."""
        chosen = self.chosen
        degrees_of_freedom, rules = self.degrees_of_freedom, self.rules
        return chosen is not None and not down_to_noise(chosen.fit, degrees_of_freedom, rules)

    def has_reason(self, code: str) -> bool:
        """Tell whether any of its reasons has a code."""
        return any(reason.code == code for reason in self.reasons)

    @property
    def comes_near(self) -> bool:
        """Whether the chosen effects explain at least half of the misfit."""
        chosen = self.chosen
        return chosen is not None and chosen.explained >= self.rules.explained_part_share

    def after_held_out_test(
        self,
        held_out_test: HeldOutTest | None = None,
        worse: Mapping[str, float] | None = None,
        condemned: bool = False,
    ) -> Verdict:
        """Return it as the held-out records leave it; every verdict with such records ends here.

        Parameters
        ----------
        held_out_test : HeldOutTest, optional
            Theirs on the named effects, where it has not been heard yet.
        worse : mapping of str to float, optional
            Prediction errors that grow with the named effects, after over before: see `grows`.
        condemned : bool
            Whether it grows where it matters most.

        Returns
        -------
        Verdict
            ``unlisted`` where they contradict it, and no better than ``partial`` where any error
            of theirs grows.
        """
        if condemned or (held_out_test and held_out_test.denies(self.rules, self.accepted.misfit)):
            reasons = (*self.reasons, Reason(NOT_VALIDATED))
            return replace(self, equivalent=(), reasons=reasons, probability=None)
        shown = self.shown_in_held_out and (
            held_out_test is None or held_out_test.counts(self.rules)
        )
        verdict = replace(self, shown_in_held_out=shown)
        if not worse:
            return verdict
        return verdict.with_caveats([Reason.of(HELD_OUT_ERROR_GROWS, numbers=worse)])

    def with_caveats(self, reasons: Sequence[Reason]) -> Verdict:
        """Return it with further reasons, with which no status is unqualified."""
        return replace(self, reasons=(*self.reasons, *reasons))
