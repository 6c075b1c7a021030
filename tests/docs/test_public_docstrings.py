"""Every public name has shapes, units, errors and source: what a machine can check of that.

It cannot check whether they are right. The published methods are listed by hand, with a word of the
source they must name.
"""

from __future__ import annotations

import pytest
from docstring_rules import docstring, faults
from public_names import PACKAGES, public_constants, public_objects

PUBLIC = public_objects()
CONSTANTS = public_constants()

SOURCES = {
    "drive.DataSheet.error_orders": "Eq. (1)",
    "drive.MeshStiffnessVariation": "Gu, Tong",
    "drive.floquet_multipliers": "Nayfeh and Mook",
    "drive.harmonic_balance": "Cameron and Griffin",
    "drive.low_pass": "Section 4",
    "drive.measured_dte": "Section 4",
    "drive.quasi_static_torsion": "Section 3",
    "drive.sample_static_error": "Section 2.1",
    "drive.simulate_drive": "Eq. (9)",
    "drive.hill_steady_state": "Hill's method (Nayfeh and Mook",
    "surrogate.Accuracy": "Table 5",
    "surrogate.ChebyshevSurrogate": "Eqs. 14-25",
    "surrogate.ExactMoments": "Eqs. (29) and (30)",
    "surrogate.SampledMoments": "Section 5.1",
    "surrogate.SobolIndices": "Sobol",
    "surrogate.VariableBandMoments": "Xiu\nand Karniadakis",
    "surrogate.latin_hypercube": "McKay",
    "surrogate.sobol_indices": "Sudret",
    "identification.ErrorStatistics": "Shapiro and Wilk",
    "identification.bearing_damping": "Eq. 26",
    "identification.detectable_correlation": "Holm",
    "identification.draw_errors": "Nelsen",
    "identification.find_outliers": "Section 2.1",
    "identification.fit_line": "Draper and Smith",
    "identification.largest_deviation": "Samuelson",
    "identification.mesh_damping": "Eq. 27",
    "identification.series": "Table 3",
    "identification.stiffness": "Section 3",
    "problems.RobustDTE": "Section 5.1",
    "problems.RobustDTETolerance": "Chase",
    "problems.RobustProblem": "Eqs. 29 and 30",
    "algorithms.AMOPSO": "Section 5.2",
    "algorithms.AMPMOPSO": "Section 5.1",
    "algorithms.CompactSwarm": "Li, Zhang",
    "algorithms.ElitistSwarm": "Deb et al. 2002",
    "algorithms.EntropyWeight": "Coello Coello",
    "algorithms.Flat": "Kennedy and Eberhart",
    "algorithms.LeaderArchive": "Deb, Pratap",
    "algorithms.LinearDecrease": "Shi, R. C. Eberhart",
    "algorithms.MOPSO": "Coello Coello",
    "algorithms.MPMOPSO": "Section 5.2",
    "algorithms.ParticleSwarm": "Nebro et al. 2009",
    "algorithms.Pyramid": "Section 5.1",
    "decision.WeightedUtopia": "Eqs. (37)-(41)",
    "decision.deviation_degree": "Eq. 42",
    "decision.tolerance_band": "Eq. (41)",
    "discrepancy.order_lines": "Lomb",
    "discrepancy.residual_spectrum": "Scargle",
    "mechanism.Loop": "Astrom and Murray",
    "mechanism.Mechanism": "Eqs. (3) to (9)",
    "discrepancy.analyse": "Schwarz",
    "validation.validation_metrics": "Section 4",
}
"""Methods that others published, or the paper's own, and a part of the source they must name."""


def owner_of(name: str) -> object:
    return PUBLIC.get(name.rpartition(".")[0])


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_lack_nothing(package):
    names = [name for name in PUBLIC if name.startswith(f"{package}.")]
    assert names
    lacking = [f"{name} {one}" for name in names for one in faults(PUBLIC[name], owner_of(name))]
    assert not lacking, "\n".join(lacking)


def test_constants_have_a_string_below():
    assert [name for name, text in CONSTANTS.items() if not text] == []


def test_published_methods_name_their_sources():
    sourceless = [name for name in SOURCES if SOURCES[name] not in docstring(PUBLIC[name])]
    assert sourceless == []


def test_what_is_walked():
    """Functions, classes, methods, properties, inherited members and calls are all there."""
    assert {
        "drive.simulate_drive",
        "drive.DriveModel",
        "drive.DriveModel.dte_arcsec",
        "drive.DataSheet.ratio",
        "problems.RobustDTE.settings",
        "surrogate.ExactMoments.__call__",
        "surrogate.ChebyshevSurrogate.fit",
        "validation.ValidationMetrics",
    } <= set(PUBLIC)
    assert len(PUBLIC) > 200
    assert "drive.PARAMETERS" in CONSTANTS
