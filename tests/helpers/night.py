"""Cases of parametrised tests of which only some run in the gate."""

from collections.abc import Iterable

import pytest


def others_at_night(cases: Iterable, *now) -> list:
    """Return all cases; those that are not among ``now`` are marked for nightly runs."""
    return [one if one in now else pytest.param(one, marks=pytest.mark.nightly) for one in cases]
