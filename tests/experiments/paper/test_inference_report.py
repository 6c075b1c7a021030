"""The stored outcome of the searches, and the report that is made of it."""

import pytest

from experiments.paper.calibrating.ladder import WIDE, Candidate
from experiments.paper.inference import experiment
from experiments.paper.inference.data import fits_of, format_fits, read_fits
from experiments.paper.inference.experiment import (
    FITS,
    FULL,
    NAME,
    SEED,
    SMALL,
    noisy_searches,
    searches,
)
from experiments.paper.inference.likelihood import OBSERVED
from experiments.paper.inference.node_noise import LARGEST
from experiments.paper.inference.rungs import RIGID, Rung, all_rungs, noisy_rungs
from experiments.paper.inference.search import Effort, Search
from experiments.paper.inference.verdicts import (
    chosen_fits,
    gives_trade_off,
    rigid,
    steps_of,
    undominated,
    with_noise,
    without_noise,
)
from experiments.runner.committed import committed_file
from experiments.runner.registry import Context
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import OF_MODELS, significant


@pytest.fixture(scope="module")
def fits():
    return read_fits(committed_file(FITS, NAME))


def test_every_search_is_in_the_stored_outcome(fits):
    best = {
        (one.target, one.rung): tuple(one.rung.searched(one.parameters))
        for one in fits
        if one.target == "common"
    }
    jobs = [*searches(), *noisy_searches(best)]
    assert [(one.target, one.rung.name, one.effort) for one in fits] == [
        (job.target, job.rung.name, job.effort.name) for job in jobs
    ]
    assert {job.rung for job in jobs if job.target == "common"} == set(all_rungs())


def test_stored_fits_are_as_likely_as_they_say(fits):
    for named in chosen_fits(fits):
        one = named.fit
        assert one.evaluation.deviance(one.target) == pytest.approx(one.deviance, abs=0.05)


@pytest.mark.parametrize("target", ["common", "noise"])
@pytest.mark.parametrize("bands", ["R1", "R2"])
def test_a_stored_search_of_the_rigid_drive_runs_again(fits, target, bands):
    rung = Rung(Candidate((), "semi_amplitude", bands), RIGID)
    (stored,) = (one for one in fits if (one.target, one.rung) == (target, rung))
    job = Search(rung, target, SEED, SMALL)
    (again,) = fits_of([job], [job.execute()])
    assert again.deviance == pytest.approx(stored.deviance, abs=0.01)
    assert again.parameters == pytest.approx(stored.parameters, rel=1e-2)
    assert again.node_noise == pytest.approx(stored.node_noise, abs=0.01)


def test_stored_fits_with_noise_are_as_likely_as_they_say(fits):
    noisy = with_noise(fits)
    assert {one.rung for one in noisy} == set(noisy_rungs())
    for one in (noisy[0], noisy[-1], rigid(noisy)):
        assert one.evaluation.deviance("noise") == pytest.approx(one.deviance, abs=0.05)
        assert 0.0 <= one.node_noise <= LARGEST
        (quiet,) = (f for f in fits if (f.target, f.rung) == ("common", one.rung))
        # The size of the noise is one parameter more, which may be 0.
        assert one.n_parameters == quiet.n_parameters + 1
        assert one.deviance < quiet.deviance + 0.05


def test_steps_of_the_paper_are_those_of_table_8():
    assert steps_of(OBSERVED) == pytest.approx([0.484, 0.468, -0.460, -0.136])


@pytest.mark.nightly
def test_the_report_says_what_the_fits_say(tmp_path, fits):
    result = experiment.run(Context(1, tmp_path, Campaign(tmp_path)))
    meeting = [one for one in fits if one.target == "common" and gives_trade_off(one)]
    quiet, noisy = without_noise(fits), with_noise(fits)
    both = [one for one in quiet if gives_trade_off(one) and undominated(one)]
    searched = sum(one.target == "common" for one in fits)
    assert f"of {searched} drive models" in result.answer
    assert f"{len(meeting)} give" in result.answer
    given = sum(map(gives_trade_off, noisy))
    assert f"{given} of {len(noisy)} models give" in result.answer
    assert f"{given} of {len(noisy)} give" in result.first_page[OF_MODELS]
    # A model that is fitted to two targets is one model.
    assert len({one.rung for one in fits}) == searched
    assert f"of {searched} fitted drive models" in result.first_page[OF_MODELS]
    assert (not both) == (f"one of {searched} drive models gives both" in result.answer)
    least = min(meeting, key=lambda one: one.bic)
    assert f"by {significant(least.evaluation.depths.max(), 2)} widths" in result.answer
    ladder = result.tables[2]
    assert len(ladder.rows) == searched
    heights = [row[6] for row in ladder.rows]
    assert heights == sorted(heights)
    assert heights[0] == 0.0


def test_fits_survive_their_csv(tmp_path):
    rung = FULL["R1"]
    job = Search(rung, "common", 5, Effort(1, (1, 1, 1)))
    written = fits_of([job], [job.execute()])
    path = tmp_path / FITS
    path.write_text(format_fits(written), encoding="utf-8")
    (read,) = read_fits(path)
    assert read.parameters == pytest.approx(written[0].parameters, rel=1e-8)
    assert (read.rung, read.starts, read.reached) == (rung, 1, 1)


@pytest.mark.nightly
def test_the_full_campaign_leaves_what_the_report_reads(tmp_path, monkeypatch):
    tiny = Effort(1, (1, 1, 1))
    for name in ("LARGE", "FRONT", "MIDDLE", "SMALL"):
        monkeypatch.setattr(experiment, name, tiny)
    closed = [Rung(rung.candidate, ("torsion",)) for rung in FULL.values()]
    plain = Rung(Candidate((), "semi_amplitude", WIDE), RIGID)
    monkeypatch.setattr(experiment, "all_rungs", lambda: [*FULL.values(), *closed, plain])
    monkeypatch.setattr(experiment, "noisy_rungs", lambda: [plain])
    context = Context(1, tmp_path, Campaign(tmp_path), full=True)
    first = experiment.run(context)
    assert len(read_fits(tmp_path / NAME / FITS)) == len(searches()) + 1
    # A second run finds every job on disk and reports the same.
    runs = {path: path.stat().st_mtime_ns for path in (tmp_path / "runs").rglob("*.csv")}
    assert experiment.run(context).tables == first.tables
    assert {path: path.stat().st_mtime_ns for path in runs} == runs
