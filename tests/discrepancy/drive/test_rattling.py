"""Which records a verdict is of, where a clearance would rattle in some of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from planted_features import known_data, library, listed, measured, with_sweep

from pymoo_hdte.discrepancy.drive import rattling

CONDITIONS = [(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 10.0, 20.0, 40.0)]


def named(*names):
    return SimpleNamespace(effects=[SimpleNamespace(name=name, listed=True) for name in names])


def answer(*names, status="named", more=False, rivals=()):
    return SimpleNamespace(
        status=status, chosen=named(*names), equivalent=rivals, leaves_more_than_noise=more
    )


HARDENING = "hardening_stiffness"
SOFT = answer("soft_windup", HARDENING, more=True)
PLAY = answer("backlash", HARDENING)


@pytest.mark.parametrize(
    ("of_all", "of_loaded", "kept"),
    [
        (SOFT, PLAY, 6),
        (answer("soft_windup", status="unlisted"), PLAY, 6),
        (SOFT, answer("soft_windup", HARDENING, rivals=[named("backlash", HARDENING)]), 6),
        # All records are explained: there is no reason to leave any out.
        (answer("soft_windup"), PLAY, 8),
        # The loaded records show no clearance beside another effect, or it leaves more than noise.
        (SOFT, answer("soft_windup", HARDENING), 8),
        (SOFT, answer("backlash"), 8),
        (SOFT, answer("backlash", HARDENING, more=True), 8),
        (SOFT, answer("backlash", HARDENING, status="unlisted"), 8),
    ],
)
def test_records_that_rattle_count_unless_a_clearance_explains_all_others(
    monkeypatch, of_all, of_loaded, kept
):
    """A play with a soft skin beside a hardening was named a soft wind-up beside it."""
    rng = np.random.default_rng(5)
    data, _ = measured((), rng, known_data(CONDITIONS))
    data = with_sweep(data, listed(data, "soft_windup").build((0.3, 3e-4, 3.0)), rng)
    assert rattling.leading_sweep_effect(data, rattling.fit(data), library(data)) == "soft_windup"

    def judge(some, base, candidates):
        return of_all if len(some.features.records) == len(CONDITIONS) else of_loaded

    monkeypatch.setattr(rattling, "judge", judge)
    found, _, verdict = rattling.judged(data, lambda some, base: library(some))
    assert len(found.features.records) == kept
    assert verdict is (of_all if kept == len(CONDITIONS) else of_loaded)


@pytest.mark.parametrize(("name", "kept"), [("backlash", 6), (None, 8)])
def test_records_that_rattle_do_not_count_where_sweeps_speak_for_a_clearance(
    monkeypatch, name, kept
):
    data = known_data(CONDITIONS)
    monkeypatch.setattr(rattling, "leading_sweep_effect", lambda *_: name)
    monkeypatch.setattr(rattling, "judge", lambda *_: SOFT)
    found, _, _ = rattling.judged(data, lambda some, base: [])
    assert len(found.features.records) == kept
