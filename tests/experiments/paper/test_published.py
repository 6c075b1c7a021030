"""What the printed equations give under both readings of theta_s."""

import numpy as np
import pytest

from experiments.paper import published
from experiments.paper.published import READINGS, printed_equations
from experiments.published_values import TABLE_8
from pymoo_hdte.drive import preset, transfer_function
from pymoo_hdte.surrogate import TruncatedNormal
from pymoo_hdte.units import ARCSEC


@pytest.fixture(scope="module")
def printed():
    return printed_equations()


def test_a_semi_amplitude_doubles_the_dte_and_its_scatter(printed):
    """The equations are linear in theta_s."""
    low, high = (printed[reading] for reading in READINGS)
    assert (high.dte, high.mean, high.std) == pytest.approx(
        (2.0 * low.dte, 2.0 * low.mean, 2.0 * low.std), rel=1e-6
    )


def test_both_are_theta_s_times_the_gain_of_the_printed_drive(printed):
    model = preset("published")
    drive = model.coefficients(model.nominal[None])
    gain = np.abs(transfer_function(drive, drive.error_orders)[0])
    low, high = (printed[reading] for reading in READINGS)
    theta_s = model.nominal[0] / ARCSEC
    assert gain.min() * theta_s < low.dte < gain.max() * theta_s
    nodes, weights = TruncatedNormal(0.0, 1.0).quadrature(2)
    cut = np.sqrt(weights @ nodes**2) * model.kinematic_error.std / ARCSEC
    assert high.std == pytest.approx(2.0 * cut * low.dte / theta_s, rel=1e-3)
    assert (low.dte, high.dte) == pytest.approx((36.4, 72.8), abs=0.05)


def test_the_page_says_both_and_that_neither_is_the_paper_s(printed):
    table = published._readings(printed)
    (finding,) = table.findings
    assert not finding.agrees
    assert finding.answers
    clause = published.of_the_first_page(printed)
    for value in (*(one.dte for one in printed.values()), TABLE_8["initial"].mean_arcsec):
        assert f"{value:.1f}" in finding.sentence
        assert f"{value:.1f}" in clause
