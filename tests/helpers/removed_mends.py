"""Mends of the verdict that can be taken out again, to see what goes wrong without each.

Each function takes a ``MonkeyPatch``, whose end puts the mend back.
"""

from dataclasses import replace

from pymoo_hdte.discrepancy.campaign.rows.findings import RowFindings
from pymoo_hdte.discrepancy.drive import analysis, evidence
from pymoo_hdte.discrepancy.drive.misfit import location
from pymoo_hdte.discrepancy.engine import fitting, verdict
from pymoo_hdte.discrepancy.engine.candidate import Candidate
from pymoo_hdte.discrepancy.engine.search import Search


def three_steps(patch):
    """Fits end after three steps, converged or not."""
    minimum = fitting.minimum

    def unfinished(problem, start, steps, settled=0.0):
        return minimum(problem, start, 3, settled)

    patch.setattr(fitting, "minimum", unfinished)


def ranking_fits_decide(patch):
    """Fits that end early, where they are good enough to rank sets, are what sets are judged by."""
    patch.setattr(Search, "_finish", lambda self, one, *starts: one)


def one_start(patch):
    """Nothing is fitted again from believed values or from further starts."""
    patch.setattr(Search, "_from_other_starts", lambda self, one: None)


def contained_laws_are_rivals(patch):
    """A law that contains the chosen one and fits no better counts as another explanation."""
    patch.setattr(verdict, "contains", lambda one, other: False)


def no_special_cases(patch):
    """What is a special case of the best law is not fitted for its own sake."""
    patch.setattr(Search, "_special_cases", lambda self, one: None)


def no_proof(patch):
    """The held-out records have no say."""
    doubts_of = verdict.doubts_of

    def without_proof(search, chosen):
        return [one for one in doubts_of(search, chosen) if one != verdict.NOT_PROVEN]

    patch.setattr(verdict, "doubts_of", without_proof)


def no_doubts(patch):
    """Neither the held-out records nor bounds and intervals have a say."""
    patch.setattr(verdict, "doubts_of", lambda search, chosen: [])


def one_parameter_at_a_time(patch):
    """Of base parameters out of tolerance only one is freed."""
    patch.setattr(Search, "_parameters", lambda self: None)


def rows_are_believed(patch):
    """Rows and stated noise are taken on faith."""
    patch.setattr(
        analysis, "examined_rows", lambda campaign, expected, rules: (campaign, RowFindings())
    )


def one_effect_at_a_port(patch):
    """A second effect at the same port is barred."""
    patch.setattr(Candidate, "goes_with", lambda self, other: self.port != other.port)


def one_effect(patch):
    """Sets of several effects are not tried."""
    patch.setattr(Search, "grow", lambda self: None)


def no_exchange(patch):
    """No member of a set is replaced by what would do as much beside the others."""
    patch.setattr(Search, "_exchange", lambda self, one: None)


def amplitudes_are_never_wrong(patch):
    """Amplitudes of the believed static error cannot be out of tolerance."""
    names = evidence.out_of_tolerance

    def without_lines(base, at_bounds, error_orders, together=False):
        bounds = [name for name in at_bounds if not name.startswith("error_amplitude")]
        return names(base, bounds, error_orders, together)

    patch.setattr(evidence, "out_of_tolerance", without_lines)


def quadratic_drag_only(patch):
    """Drag grows with the square of the speed."""

    def quadratic(one):
        if one.name != "nonlinear_drag":
            return one
        level, exponent = one.parameters
        exponent = replace(exponent, lower=2.0 - 1e-6, upper=2.0 + 1e-6, start=2.0)
        return replace(one, parameters=(level, exponent), starts=((level.start, 2.0),))

    _with_library(patch, lambda found: [quadratic(one) for one in found if not one.form])


def no_friction_that_grows_with_load(patch):
    """Friction in proportion to the load is in no list."""
    name = "load_dependent_friction"
    _with_library(patch, lambda found: [one for one in found if one.name != name])


def freed_values_are_believed(patch):
    """What a fit freed of its tolerance counts as believed where the misfit is located."""
    patch.setattr(location, "within_tolerance", lambda data, values: values[: len(data.base)])


def _with_library(patch, change):
    library = analysis.drive_candidates
    patch.setattr(analysis, "drive_candidates", lambda *given: change(library(*given)))
