"""Which records a verdict is of, where a clearance would rattle in some of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from planted_features import known_data, library, listed, measured, with_sweep

from pymoo_hdte.discrepancy.drive import rattling

CONDITIONS = [(rpm, load) for rpm in (10.0, 2000.0) for load in (0.0, 10.0, 20.0, 40.0)]


def answer(*names, status="named", more=False):
    effects = [SimpleNamespace(name=name, listed=True) for name in names]
    chosen = SimpleNamespace(effects=effects)
    return SimpleNamespace(status=status, chosen=chosen, equivalent=(), leaves_more_than_noise=more)


SOFT = answer("soft_windup", "hardening_stiffness", more=True)
PLAY = answer("backlash", "hardening_stiffness")


@pytest.mark.parametrize(
    ("of_all", "of_loaded", "kept"),
    [
        (SOFT, PLAY, 6),
        # Nothing is left that a clearance could be missing from.
        (answer("soft_windup"), PLAY, 8),
        # The loaded records name no clearance, or do not explain everything by it.
        (SOFT, answer("soft_windup"), 8),
        (SOFT, answer("backlash", more=True), 8),
        (SOFT, answer("backlash", status="unlisted"), 8),
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
