"""What is assumed of the unknowns of a fit before the data speak."""

from types import SimpleNamespace

import numpy as np
import pytest

from pymoo_hdte.discrepancy._selection.candidate import Candidate
from pymoo_hdte.discrepancy._selection.linearised import linearise
from pymoo_hdte.discrepancy._selection.score import score
from pymoo_hdte.effects.unknowns import unknown, wave

N = 40


def ripple_known_to(precision, harmonics=(1,), *further):
    """A fitted ripple of which the data show the first line alone, as a hypothesis."""
    parameters = (*wave("amplitude", largest=80.0, typical=1.0, harmonics=harmonics), *further)
    candidate = Candidate("ripple", "", parameters, (), lambda values: (), "", exact=True)
    columns = np.linalg.qr(np.random.default_rng(4).normal(size=(N, 4)))[0] / precision
    values = np.array([2.0, -1.0, 0.0, 0.0])[: len(parameters)]
    fitted = SimpleNamespace(
        candidates=(candidate,),
        places=[(candidate, slice(0, len(values)))],
        jacobian=columns[:, : len(values)] * [parameter.scale for parameter in parameters],
        parameters=parameters,
        values=values,
        residuals=np.zeros(N),
        n_base=0,
    )
    return linearise(fitted, np.zeros(N, int), lambda *_: (), 0.0)


@pytest.mark.parametrize("precision", 10.0 ** -np.arange(1.0, 8.0))
def test_a_harmonic_that_is_absent_costs_little_however_well_that_is_known(precision):
    """A ripple of order 2 was told as one of order 1, to do without a third harmonic.

    Its scale lies anywhere between nothing and its largest, by the logarithm, and as well below
    the noise as not.
    """
    line, both = (score(ripple_known_to(precision, which)).ln for which in ((1,), (1, 2)))
    assert -3.0 < both - line < 0.0


@pytest.mark.parametrize(("may_vanish", "low", "high"), [(True, -2.0, 0.0), (False, -np.inf, -7.0)])
def test_a_size_that_a_law_cannot_do_without_has_to_be_visible(may_vanish, low, high):
    """Friction that varies about nothing took the place of a coupling that is out of line."""
    mean = unknown("mean", 0.0, 80.0, 1.0, linear=True, may_vanish=may_vanish)
    line, both = (score(ripple_known_to(1e-4, (1,), *which)).ln for which in ((), (mean,)))
    assert low < both - line < high
