"""Files of a virtual bench on which a series of prototypes was measured."""

from pathlib import Path

import numpy as np

from experiments.paper.bench.rigs import COMPLETE_DRIVE, INPUT_BEARING, OUTPUT_BEARING, TorsionBench
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

TRUTH = {"K": 2.4e4, "B_in": 1.7e-4, "B_fc": 4.4e-4, "B_out": 5.0e-4}
BENCH = TorsionBench()


def write_runs(path, runs):
    lines = ["prototype,repeat,speed_r_min,torque_Nm"]
    for (prototype, repeat), run in runs.items():
        speeds = (run.speed / REVOLUTION_PER_MINUTE).tolist()
        for speed, torque in zip(speeds, run.torque.tolist(), strict=True):
            lines.append(f"{prototype},{repeat},{speed!r},{torque!r}")
    path.write_text("\n".join(lines) + "\n")


def write_series(folder: Path) -> None:
    """Write the files of six prototypes, three repeats each, that scatter by two per cent."""
    rng = np.random.default_rng(20261122)
    folder.mkdir()
    loops = ["prototype,repeat,torque_Nm,torsion_arcsec"]
    runs = {"bearing": {}, "complete": {}, "output": {}}
    for prototype in range(1, 7):
        k, b_in, b_fc, b_out = np.array(list(TRUTH.values())) * rng.normal(1.0, 0.02, 4)
        loop = BENCH.record(k, rng)
        torsion = (loop.torsion / ARCSEC).tolist()
        loops += [
            f"{prototype},1,{torque!r},{angle!r}"
            for torque, angle in zip(loop.torque.tolist(), torsion, strict=True)
        ]
        for repeat in (1, 2, 3):
            runs["bearing"][prototype, repeat] = INPUT_BEARING.record(b_in, rng)
            runs["complete"][prototype, repeat] = COMPLETE_DRIVE.record(b_in + b_fc, rng)
            runs["output"][prototype, repeat] = OUTPUT_BEARING.record(b_out, rng)
    (folder / "torsion_loops.csv").write_text("\n".join(loops) + "\n")
    for name, of_it in runs.items():
        write_runs(folder / f"no_load_{name}.csv", of_it)
    rows = ["prototype,repeat,dFp1_um,mine_um"]
    for prototype in range(1, 7):
        true = rng.normal([8.0, 3.0], [0.9, 0.3])
        for repeat in range(1, 5):
            read = (true + rng.normal(0.0, 0.05, 2)).tolist()
            rows.append(f"{prototype},{repeat},{read[0]!r},{read[1]!r}")
    (folder / "errors.csv").write_text("\n".join(rows) + "\n")
