"""Values out of tolerance beside effects are told in one sentence."""

from pymoo_hdte.discrepancy._report.words import what_is_missing
from pymoo_hdte.discrepancy._selection.candidate import out_of_tolerance


def test_several_values_out_of_tolerance_are_one_sentence():
    values = [out_of_tolerance(name, name) for name in ("stiffness", "damping")]
    assert what_is_missing(values[:1]) == "The stiffness lies outside its tolerance."
    assert what_is_missing(values) == "The stiffness and damping lie outside their tolerances."
