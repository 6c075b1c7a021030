"""Every public name has shapes, units, errors and source: what a machine can check of that.

It cannot check whether they are right. The rules are tested on faulty docstrings below; each fault
must be found. The published methods are listed by hand, with a word of the source they must name.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from docstring_rules import docstring, faults
from numpy.typing import ArrayLike, NDArray
from public_names import PACKAGES, public_constants, public_objects

from pymoo_hdte.checks import InvalidInput, real_number

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


class Planted:
    """A class whose methods lack what their names say."""

    def docstring(self) -> None:
        pass

    def parameter(self, length: float, width: float) -> None:
        """Do something.

        Parameters
        ----------
        length : float
            m.
        """

    def obvious_parameter(self, path: str) -> None:
        """Do something."""

    def shape(self, length: ArrayLike) -> None:
        """Do something.

        Parameters
        ----------
        length : array_like
            m.
        """

    def shape_of_result(self, length: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the squares, m, of length, shape (n,)."""

    def shape_of_listed_result(self) -> NDArray[np.float64]:
        """Return the lengths of n things, shape (n,) in m.

        Returns
        -------
        ndarray
            m.
        """

    def unit_of_listed_result(self) -> NDArray[np.float64]:
        """Return the lengths of n things in m.

        Returns
        -------
        ndarray, shape (n,)
        """

    def length_of_tuple(self) -> tuple[float, ...]:
        """Return what is measured, in m."""

    def unit(self, length: float) -> None:
        """Do something.

        Parameters
        ----------
        length : float
            How long it is.
        """

    def unit_of_result(self) -> float:
        """Return how long it is."""

    @property
    def unit_of_property(self) -> float:
        """How long it is."""

    def error(self, length: float) -> None:
        """Do something with a length in m."""
        raise InvalidInput("length", length, "nothing")

    def error_of_a_check(self, length: float) -> None:
        """Do something with a length in m."""
        real_number("length", length)

    def error_of_a_helper(self, length: float) -> None:
        """Do something with a length in m."""
        self._refuse(length)

    def _refuse(self, length: float) -> None:
        raise ArithmeticError(length)

    def error_of_another_kind(self, length: float) -> None:
        """Do something with a length in m.

        Raises
        ------
        KeyError
            Never.
        """
        raise InvalidInput("length", length, "nothing")

    def source(self) -> None:
        """Solve a = b + c / d."""

    def delegated(self, other: float) -> None:
        """Do something.

        Parameters as in `unit`.
        """


@dataclass(frozen=True)
class PlantedFields:
    """Fields and a constant of a class.

    Attributes
    ----------
    listed : float
        m.
    """

    STRENGTH = 2
    listed: float
    below: float
    """m."""
    missing: float

    def __post_init__(self) -> None:
        real_number("listed", self.listed)


class PlantedAttribute:
    """A class that does not tell all it holds.

    Parameters
    ----------
    length : float
        m.
    """

    def __init__(self, length: float) -> None:
        self.length = length
        self.square = length**2


FOUND = {
    "docstring": "has no docstring",
    "parameter": "does not document width",
    "obvious_parameter": "does not document path",
    "shape": "does not say the shape of length",
    "shape_of_result": "does not say the shape of what it takes or returns",
    "shape_of_listed_result": "does not say the shape of what it returns",
    "unit_of_listed_result": "does not say the unit of what it returns",
    "length_of_tuple": "does not say the shape of what it takes or returns",
    "unit": "does not say the unit of length",
    "unit_of_result": "does not say the unit of what it takes or returns",
    "unit_of_property": "does not say the unit of what it takes or returns",
    "error": "does not tell that it raises InvalidInput",
    "error_of_a_check": "does not tell that it raises InvalidInput",
    "error_of_a_helper": "does not tell that it raises ArithmeticError",
    "error_of_another_kind": "does not tell that it raises InvalidInput",
    "source": "does not say where 'a = b + ' is from",
    "delegated": "does not document other",
}


@pytest.mark.parametrize("method", FOUND)
def test_planted_fault_is_found(method):
    target = vars(Planted)[method]
    assert faults(getattr(target, "fget", target), Planted) == [FOUND[method]]


def test_planted_faults_of_fields_are_found():
    assert faults(PlantedFields) == [
        "does not document STRENGTH",
        "does not document missing",
        "does not tell that it raises InvalidInput",
    ]


def test_planted_attribute_is_found():
    assert faults(PlantedAttribute) == ["does not document square"]
