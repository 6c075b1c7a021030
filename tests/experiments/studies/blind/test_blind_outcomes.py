"""Committed outcomes of blind cases: a part of the list, and what the code says today."""

import numpy as np
import pytest

from experiments.runner.committed import DATA, read_rows
from experiments.studies.blind.campaigns import campaign_of, hiding
from experiments.studies.blind.cases import Case, all_cases
from experiments.studies.blind.data import outcome, read_outcomes
from experiments.studies.blind.experiment import OUTCOMES, SECONDS
from experiments.studies.blind.scoring import COLUMNS, verdict_scores
from pymoo_hdte._runner.campaign import Run
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive

DOZEN = 12
"""Cases that the nightly run takes, spread over the list; the gate runs the cheapest one anew."""


@pytest.fixture(scope="module")
def outcomes():
    return read_outcomes(DATA / OUTCOMES, DATA / SECONDS)


def test_they_stand_together_in_the_list(outcomes):
    first = all_cases().index(outcomes[0].case)
    assert [one.case for one in outcomes] == all_cases()[first : first + len(outcomes)]
    stored = [(row["truth"], row["forms"], row["stress"]) for row in read_rows(DATA / OUTCOMES)]
    drawn = [(one.truth, one.forms, one.stress) for one in (each.case for each in outcomes)]
    assert stored == drawn


def same_again(stored):
    hidden = hiding(stored.case)
    verdict = examine_drive(campaign_of(hidden, hidden.session)).verdict
    scores = verdict_scores(stored.case, verdict)
    row = [scores.get(column, np.nan) for column in COLUMNS]
    found = outcome(stored.case, Run(COLUMNS, np.array([row]), 0.0))
    assert (found.status, found.chosen) == (stored.status, stored.chosen), stored.case.key
    assert found.equivalents == stored.equivalents, stored.case.key


@pytest.mark.nightly
def test_the_cheapest_ends_as_it_is_stored(outcomes):
    same_again(min(outcomes, key=lambda one: sum(one.seconds) or 1e9))


@pytest.mark.nightly
def test_a_dozen_ends_as_it_is_stored(outcomes):
    step = max(len(outcomes) // DOZEN, 1)
    for stored in outcomes[::step][:DOZEN]:
        same_again(stored)


@pytest.mark.nightly
def test_no_plain_name_leaves_more_than_another_that_was_compared():
    # Half of the records, play in another form: a pair that left 1.9 times the noise was named
    # plainly, although one that left nothing had been compared.
    case = next(one for one in all_cases() if (one.kind, one.number) == ("stressed", 45))
    hidden = hiding(case)
    verdict = examine_drive(campaign_of(hidden, hidden.session)).verdict
    answers = verdict.chosen, *verdict.equivalent
    assert ("clearance_variation", "mesh") in {name for one in answers for name in one.names}
    left = max(one.fit.chi_square for one in answers)
    assert left < 1.2 * verdict.degrees_of_freedom
    assert left < 1.2 * min(one.fit.chi_square for one in verdict.alternatives)


@pytest.mark.nightly
@pytest.mark.parametrize("number", [101, 103])
def test_harmonics_of_a_narrow_crest_are_no_effects_of_their_own(number):
    # Orders and readings may leave open whether the mesh errs or the encoder.
    hidden = hiding(Case("single", number))
    verdict = examine_drive(campaign_of(hidden, hidden.session)).verdict
    answers = verdict.chosen, *verdict.equivalent
    assert Case("single", number).names[0] in {name for one in answers for name, _ in one.names}
    assert {len(one.candidates) for one in answers} == {1}
