"""Verdicts of a status, made without an analysis."""

from dataclasses import replace
from types import SimpleNamespace

from pymoo_hdte.discrepancy._selection.reason import MORE_MISSING, Reason
from pymoo_hdte.discrepancy._selection.verdict import Verdict


def made_verdict(
    status, base, chosen=None, alternatives=(), equivalent=(), freedom=1, reasons=(), **others
):
    """Return a verdict whose content leads to a status."""
    if status == "partial" and not reasons:
        reasons = (Reason.of(MORE_MISSING, numbers={"outside": 0.5}),)
    rivals = ("encoder_delay",) if status == "class" and not equivalent else ()
    verdict = Verdict(
        base,
        chosen,
        status != "unlisted",
        alternatives,
        equivalent,
        freedom,
        reasons=reasons,
        rivals_beyond=rivals,
        **others,
    )
    assert verdict.status == status
    return verdict


def with_status(verdict, status, **content):
    """Return an analysed verdict with other content that leads to a status."""
    reasons = (Reason.of(MORE_MISSING, numbers={"outside": 0.5}),) if status == "partial" else ()
    content = {"certain": status != "unlisted", "reasons": reasons, **content}
    changed = replace(verdict, **content)
    assert changed.status == status
    return changed


def made_set(fit=None, *names, listed=True):
    """Return what stands for a set of effects in a verdict."""
    names = names or ("torque_ripple",)
    candidates = [SimpleNamespace(name=name, is_value=name == "parameter") for name in names]
    placed = frozenset((name, "") for name in names)
    return SimpleNamespace(fit=fit, listed=listed, candidates=candidates, names=placed)
