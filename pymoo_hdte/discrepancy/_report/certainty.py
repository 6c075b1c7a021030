"""How sure a verdict is, in words: what it explains, what else could, and how probable it is."""

from __future__ import annotations

from collections.abc import Sequence

from pymoo_hdte._reports.html import number, percent
from pymoo_hdte.discrepancy._evidence.order_lines.parameters import labels_by_order, words_of
from pymoo_hdte.discrepancy._report.words import sure_in_words
from pymoo_hdte.discrepancy._selection.hypothesis import Hypothesis, adequate
from pymoo_hdte.discrepancy._selection.verdict import Verdict
from pymoo_hdte.discrepancy._verdicts.drive_finding import DriveFinding
from pymoo_hdte.effects.sentence_blanks import in_words


def how_sure(finding: DriveFinding) -> str:
    """Return how sure the verdict is, in words."""
    verdict, orders = finding.verdict, finding.campaign.believed.error_orders
    limit = adequate(verdict.degrees_of_freedom, verdict.rules)
    residual = verdict.base.chi_square / verdict.degrees_of_freedom
    if verdict.status == "adequate":
        perhaps = ""
        if (verdict.probability or 0.0) < 0.5 and verdict.alternatives:
            nearest = labels_by_order(verdict.alternatives[0].label, orders)
            perhaps = (
                f" More likely something is, {nearest} first, but these records do not show it."
            )
        return (
            f"{_probably(finding)}{perhaps} The misfit of the nominal drive, fitted within its "
            f"tolerances, has {residual:.2f} times the variance of the noise; up to {limit:.2f} "
            "counts as noise. An effect too small for these records may still be there."
        )
    if verdict.chosen is None:
        return f"{_probably(finding)} No effect comes near it."
    share = percent(verdict.chosen.explained)
    if not verdict.chosen.listed:
        return (
            f"No effect in the library is as likely: this explains {share} of the misfit. An error "
            "of the encoder takes no part in the motion of the drive."
        )
    if verdict.status == "unlisted":
        nearest = labels_by_order(verdict.chosen.label, orders)
        return (
            f"{_probably(finding)} But what it is remains open. The nearest effect, {nearest}, "
            f"explains {share} of the misfit."
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
        return "It shows only in the forces beyond the cutoff, where no other effect was compared."
    share = percent(chosen.explained)
    if verdict.status == "unlisted":
        return (
            "Something is certainly missing, but what it is remains open. The nearest effect, "
            f"{in_words(chosen.label)}, explains {share} of what the library can explain."
        )
    others = _others(verdict, chosen)
    words = [f"It explains {share} of what the library can explain."]
    if verdict.equivalent:
        shares = ", ".join(percent(hypothesis.explained) for hypothesis in verdict.equivalent)
        words.append(f"The indistinguishable alternatives explain {shares}.")
    elif others:
        best = max(others, key=lambda hypothesis: hypothesis.explained)
        words.append(_next_best(best, chosen))
    else:
        words.append("No other set of effects came near enough to be compared.")
    words += _with_more(verdict, chosen)
    if not verdict.shown_in_held_out:
        words.append("The held-out records do not show it.")
    words.append("No probability is given, because real records leave more than noise.")
    return " ".join(words)


def _next_best(best: Hypothesis, chosen: Hypothesis, error_orders: Sequence[float] = ()) -> str:
    """Return what the best other set explains; where that is the same, the BIC tells them apart."""
    share, gap = percent(best.explained), best.bic - chosen.bic
    label = labels_by_order(best.label, error_orders)
    if share == percent(chosen.explained):
        share = "the same share to 0.1 %"
    elif gap > 0.0 and best.explained < chosen.explained:
        return f"The best other explanation, {label}, explains {share}."
    return (
        f"The best other explanation, {label}, explains {share}; its BIC is "
        f"{number(abs(gap))} {'above' if gap > 0.0 else 'below'}."
    )


def _with_more(
    verdict: Verdict, chosen: Hypothesis, error_orders: Sequence[float] = ()
) -> list[str]:
    """Return what the chosen effects explain with others beside them, if the BIC prefers that."""
    richer = [
        hypothesis
        for hypothesis in verdict.alternatives
        if chosen.names < hypothesis.names
        and hypothesis.bic < chosen.bic
        and hypothesis not in verdict.equivalent
    ]
    if not richer:
        return []
    best = min(richer, key=lambda hypothesis: hypothesis.bic)
    label, gap = labels_by_order(best.label, error_orders), number(chosen.bic - best.bic)
    return [
        f"With more beside it, {label}, {percent(best.explained)} are explained and the BIC is "
        f"{gap} below, which is not enough to name more."
    ]


def _evidence(finding: DriveFinding, chosen: Hypothesis, share: str) -> list[str]:
    verdict = finding.verdict
    after = chosen.fit.chi_square / verdict.degrees_of_freedom
    words = [
        f"It explains {share} of the misfit beyond noise; the residual has {after:.3g} times the "
        "variance of the noise."
    ]
    if verdict.leaves_more_than_noise:
        words.append(
            "That is more than noise: the form of the law is not quite right or more is missing, "
            "so values may be off by more than their intervals say."
        )
    orders = finding.campaign.believed.error_orders
    others = _others(verdict, chosen)
    if verdict.equivalent:
        shares = ", ".join(percent(hypothesis.explained) for hypothesis in verdict.equivalent)
        words.append(f"The indistinguishable alternatives explain {shares}.")
    elif others:
        best = min(others, key=lambda hypothesis: hypothesis.bic)
        words.append(_next_best(best, chosen, orders))
    words += _with_more(verdict, chosen, orders)
    bounded = [
        words_of(parameter.name, orders)
        if row < chosen.fit.n_base
        else parameter.name.replace("_", " ")
        for row, (parameter, side) in enumerate(
            zip(chosen.fit.parameters, chosen.fit.bound_sides, strict=True)
        )
        if parameter.limited_at(side)
    ]
    if bounded:
        names = ", ".join(bounded)
        words.append(f"At the bound of its range, and therefore uncertain: {names}.")
    return [_probably(finding), *words]


def _probably(finding: DriveFinding) -> str:
    """Return the probability that a verdict is right, in words, and what decided it."""
    verdict = finding.verdict
    what = {
        "adequate": "no effect in the library is missing",
        "class": "one of these is the cause",
        "partial": "what is named is missing, though perhaps not all of it",
        "unlisted": "something is missing",
    }.get(verdict.status, "this is the cause")
    sure = sure_in_words(verdict.probability or 0.0)
    included = ", those held out included" if finding.campaign.held_out else ""
    return f"Probability that {what}: {sure}, by all records{included}."


def _others(verdict: Verdict, chosen: Hypothesis) -> list[Hypothesis]:
    """Return the alternatives that neither contain the chosen set nor are a part of it."""
    return [
        hypothesis
        for hypothesis in verdict.alternatives
        if not (chosen.names <= hypothesis.names or hypothesis.names <= chosen.names)
    ]
