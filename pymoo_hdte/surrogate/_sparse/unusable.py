"""Why an object is no distribution of one continuous variable, in the words of its user."""

from __future__ import annotations

from typing import Any


def unusable(given: Any) -> str | None:
    """Return what is wrong with a distribution, None if nothing is seen without asking it.

    Parameters
    ----------
    given : object
        What a user passed for a distribution of `chaospy` or `scipy.stats`.
    """
    if isinstance(given, type) or hasattr(given, "freeze"):
        name = given.__name__ if isinstance(given, type) else getattr(given, "name", "this one")
        return f"a distribution with its numbers, as Normal(0, 1): {name} has none"
    # Discrete ones of chaospy, of scipy.stats, and the newer ones of scipy.stats.
    frozen = getattr(given, "dist", None)
    if getattr(given, "interpret_as_integer", False) or hasattr(frozen, "pmf"):
        return f"a continuous distribution, not one of whole numbers{named(given)}"
    joint = hasattr(given, "inv") and len(given) != 1
    if joint or (hasattr(given, "logpdf") and not hasattr(given, "cdf")) or hasattr(given, "dim"):
        return "a distribution of one variable; one of several belongs to a tuple of their names"
    old = all(hasattr(given, name) for name in ("ppf", "cdf", "pdf"))
    new = all(hasattr(given, name) for name in ("icdf", "cdf", "pdf"))
    if not (old or new):
        return "a continuous distribution of chaospy or a frozen one of scipy.stats"
    return None


def named(given: Any) -> str:
    """Return name and numbers of a frozen distribution, whose own text has neither, as a clause."""
    frozen: Any = getattr(given, "dist", None)
    if not hasattr(frozen, "name") or not hasattr(given, "kwds"):
        return ""
    numbers = [f"{argument!r}" for argument in given.args] + [
        f"{k}={v!r}" for k, v in given.kwds.items()
    ]
    return f"; this is {frozen.name}({', '.join(numbers)})"
