"""Faults of a bench that are no effects: its loop, its set speed and its sensors."""

from dataclasses import replace

import numpy as np
import pytest
from planted_features import FEW, analysed

from pymoo_hdte.discrepancy._answers.bench_faults import bench_faults
from pymoo_hdte.discrepancy._records.cleaning.findings import (
    NoiseFinding,
    RowFault,
    RowFindings,
)
from pymoo_hdte.discrepancy._report.document import nuisances_of
from pymoo_hdte.discrepancy._selection.candidate import Layout


def on_loop(lag, seed=0):
    """Records of a drive whose input moves as its loop lets it, with noise."""
    lines = np.zeros((len(FEW.features.records), len(FEW.features.orders)))
    conditions = replace(FEW.features.conditions, lead=lines + 0j, lead_share=lines)
    data = replace(FEW, features=replace(FEW.features, conditions=conditions))
    layout = Layout(data.base)
    truth = layout.array("start")
    truth[layout.index("loop_lag")] = lag
    noise = np.random.default_rng(seed).standard_normal(data.features.values.shape)
    values = data.predict(truth[None], ())[0] + np.einsum("rij,rj->ri", data.whiteners, noise)
    return replace(data, features=replace(data.features, values=values))


def test_a_loop_that_is_late_is_told_with_its_interval():
    (fault,) = bench_faults(analysed(on_loop(4e-3), "adequate"))
    assert fault.name == "loop_lag"
    assert fault.value == pytest.approx(4e-3, abs=4.0 * fault.variance**0.5)
    assert fault.variance**0.5 < 4e-4


def test_a_loop_as_stated_is_not_told():
    assert bench_faults(analysed(on_loop(0.0), "adequate")) == []


def test_what_sensors_and_set_speed_do_is_told_once_each():
    finding = analysed(on_loop(0.0), "adequate")
    wander = np.zeros(finding.data.features.orders.shape) + np.zeros((len(FEW.features.records), 1))
    wander[2, 0] = 1e-9
    features = replace(finding.data.features, wander=wander)
    faults = tuple(
        RowFault(record, "saturated", "output_torque", row, 4, 41.0, "left out")
        for record, row in (("run_0", 5), ("run_0", 90), ("run_3", 2))
    )
    noise = NoiseFinding("angle_noise", 1e-7, 2e-6, 2e-6, "read in steps", 6e-6)
    finding = replace(
        finding,
        data=replace(finding.data, features=features),
        rows=RowFindings(100, faults, (), (noise,)),
    )
    told = {entry["name"]: entry for entry in nuisances_of(finding)}
    assert list(told) == ["speed_wanders", "saturated_sensor", "coarse_sensor"]
    assert told["speed_wanders"]["port"] == "run_2"
    assert told["saturated_sensor"]["parameters"]["value"]["value"] == 41.0
    assert told["coarse_sensor"]["parameters"]["value"]["unit"] == "rad"
