"""How sure a verdict is, in words: what it explains, what else could, and how probable it is."""

from __future__ import annotations

from collections.abc import Sequence

from pymoo_hdte._reports.html import number, percent
from pymoo_hdte.discrepancy._evidence.order_lines.evidence import PARTS
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import labels_by_order, words_of
from pymoo_hdte.discrepancy._report.words import doubts
from pymoo_hdte.discrepancy._selection.hypothesis import (
    Hypothesis,
    adequate,
    contradicted_parts,
    explains,
)
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.effects.sentence_blanks import in_words, listed


def how_sure(finding: DriveFinding) -> str:
    """Return how sure the verdict is, in words."""
    verdict, orders = finding.verdict, finding.campaign.believed.error_orders
    limit = adequate(verdict.degrees_of_freedom, verdict.rules)
    residual = verdict.base.chi_square / verdict.degrees_of_freedom
    if verdict.status == "adequate":
        return (
            f"{_probably(verdict)} The misfit of the believed drive, fitted within its tolerances, "
            f"has {residual:.2f} times the variance of the noise; up to {limit:.2f} counts as "
            "noise. An effect too small for these records may still be there."
        )
    if verdict.chosen is None:
        return "That something is missing is certain; no effect was there to be tried."
    share = percent(verdict.chosen.explained)
    if not verdict.chosen.listed:
        return (
            f"No effect of the list is as likely: this explains {share} of the misfit. An error of "
            "the encoder takes no part in the motion of the drive."
        )
    if verdict.status == "unlisted":
        certain = "That something is missing is certain; what it is, is not."
        if not verdict.comes_near:
            most = labels_by_order(verdict.chosen.label, orders)
            return f"{certain} The most that was explained is {share}, by {most}."
        return (
            f"{certain} The nearest known effect, "
            f"{labels_by_order(verdict.chosen.label, orders)}, explains {share} of the misfit, "
            f"{_too_little(finding, verdict.chosen)}."
            + "".join(f" Against it: {one}." for one in doubts(verdict, orders))
        )
    return " ".join(_evidence(finding, verdict.chosen, share))


def how_sure_of_records(verdict: Verdict) -> str:
    """Return how sure the verdict on measured records is, in words.

    Without a probability: what a model of a real machine leaves is no noise, so that its evidence
    counts for more than it is worth.
    """
    chosen = verdict.chosen
    if verdict.status == "adequate":
        return "An effect too small for these records may still be there."
    if chosen is None:
        return "It is seen in the forces beyond the cutoff only, and no rival was compared."
    share = percent(chosen.explained)
    if verdict.status == "unlisted":
        return (
            "That something is missing is certain; what it is, is not. The nearest known effect, "
            f"{in_words(chosen.label)}, explains {share} of what known effects can explain."
        )
    others = _others(verdict, chosen)
    words = [f"It explains {share} of what known effects can explain."]
    if verdict.equivalent:
        shares = ", ".join(percent(one.explained) for one in verdict.equivalent)
        words.append(f"What these records cannot tell from it explains {shares}.")
    elif others:
        best = max(others, key=lambda one: one.explained)
        words.append(_next_best(best, chosen))
    else:
        words.append("No other set of effects came near enough to be compared.")
    if not verdict.shown_in_held_out:
        words.append("The records kept out of the fit do not show it.")
    words.append("Real records leave more than noise, so that no probability is given.")
    return " ".join(words)


def _next_best(best: Hypothesis, chosen: Hypothesis, error_orders: Sequence[float] = ()) -> str:
    """Return what the best other set explains; where that is the same, the BIC tells them apart."""
    share, gap = percent(best.explained), best.bic - chosen.bic
    label = labels_by_order(best.label, error_orders)
    if share == percent(chosen.explained):
        share = "as much to a tenth of a per cent"
    elif gap > 0.0 and best.explained < chosen.explained:
        return f"The best other explanation, {label}, explains {share}."
    return (
        f"The best other explanation, {label}, explains {share}; its BIC is "
        f"{number(abs(gap))} {'above' if gap > 0.0 else 'below'}."
    )


def _too_little(finding: DriveFinding, nearest: Hypothesis) -> str:
    """Return why the nearest effect is not named."""
    residual = contradicted_parts(finding.data, finding.verdict.base, nearest.fit)
    if residual.any():
        parts = [
            part.replace("_", " ") for part, missed in zip(PARTS, residual, strict=True) if missed
        ]
        return f"but not what shows in the {listed(parts)}"
    rules = finding.verdict.rules
    if explains(finding.data, nearest, finding.verdict.base, finding.verdict.degrees_of_freedom):
        return "but a name needs more than that"
    share = rules.exact_share if nearest.exact else rules.explained_share
    return f"where a name takes {100.0 * share:g} %, or what is left to be noise"


def _evidence(finding: DriveFinding, chosen: Hypothesis, share: str) -> list[str]:
    verdict = finding.verdict
    after = chosen.fit.chi_square / verdict.degrees_of_freedom
    words = [
        f"It explains {share} of the misfit that is not noise; what is left has {after:.3g} times "
        "the variance of the noise."
    ]
    if verdict.leaves_more_than_noise:
        words.append(
            "That is more than noise: its form is not quite right or more is missing, and values "
            "may be off by more than their intervals say."
        )
    orders = finding.campaign.believed.error_orders
    others = _others(verdict, chosen)
    if verdict.equivalent:
        shares = ", ".join(percent(hypothesis.explained) for hypothesis in verdict.equivalent)
        words.append(f"What these data cannot tell from it explains {shares}.")
    elif verdict.in_another_form is not None:
        words.append(
            f"In another form of its law it explains {percent(verdict.in_another_form)}, and "
            "nothing else that was compared comes down to the noise in any form."
        )
    elif others:
        best = min(others, key=lambda hypothesis: hypothesis.bic)
        words.append(_next_best(best, chosen, orders))
    bounded = [
        words_of(one.name, orders) if row < chosen.fit.n_base else one.name.replace("_", " ")
        for row, (one, side) in enumerate(
            zip(chosen.fit.parameters, chosen.fit.bound_sides, strict=True)
        )
        if one.limited_at(side)
    ]
    if bounded:
        names = ", ".join(bounded)
        words.append(f"At the bound of its range, and therefore uncertain: {names}.")
    return [_probably(verdict), *words]


def _probably(verdict: Verdict) -> str:
    """Return the probability that a verdict is right, in words."""
    what = {
        "adequate": "nothing of the list is missing",
        "class": "one of these is the cause",
        "partial": "what is named is missing, if not all",
    }.get(verdict.status, "this is the cause")
    if verdict.status == "class" and verdict.leaves_more_than_noise:
        what = "one of these is missing, if not all"
    whole = int(100.0 * (verdict.probability or 0.0))
    return (
        f"The probability that {what} is {whole} %, by the evidence of "
        "everything that was compared and by how often such verdicts were right on campaigns with "
        "a known truth."
    )


def _others(verdict: Verdict, chosen: Hypothesis) -> list[Hypothesis]:
    """Return the alternatives that neither contain the chosen set nor are a part of it."""
    return [
        one
        for one in verdict.alternatives
        if not (chosen.names <= one.names or one.names <= chosen.names)
    ]
