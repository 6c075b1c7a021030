"""Published shares of COCO's targets on bbob-biobj, to hold ours against.

They are read from the runtime profiles of COCO's data archive (Brockhoff, Tusar, Auger and others,
2016 and 2017), all 55 functions and their instances, every evaluation counted; accurate to some
.01. The whole curves lie beside the repository; only what demands cite is kept in it.
"""

from __future__ import annotations

from pathlib import Path

from experiments.runner.committed import read_rows

ANCHORS = Path(__file__).resolve().parents[5] / "shared" / "anchors" / "bbob_biobj.csv"
BEST = "HMO-CMA-ES"
CITED = {
    **{(10, 500): 0.214, (10, 2000): 0.295, (10, 10_000): 0.372, (10, 25_000): 0.414},
    **{(20, 500): 0.183, (20, 2000): 0.250, (20, 10_000): 0.334, (20, 25_000): 0.377},
}
"""Shares of HMO-CMA-ES (Loshchilov, Glasmachers 2016) by dimension and evaluations."""
SHOWN = {
    BEST: "HMO-CMA-ES",
    "best 2016": "best 2016",
    "RM-MEDA": "RM-MEDA",
    "SMS-EMOA-SA": "SMS-EMOA-",
    "NSGA-II (MATLAB)": "NSGA-II-MATLAB",
    "random in [-5, 5]": "RANDOMSEARCH-5",
}
"""Curves that are drawn, with the beginnings of their names in the archive."""
_PREFIX = "share_at_"


def curves(dimension: int, path: Path = ANCHORS) -> dict[str, dict[int, float]]:
    """Return published shares by name and number of evaluations; without the file what is cited."""
    if not path.is_file():
        cited = {n: share for (d, n), share in CITED.items() if d == dimension}
        return {BEST: cited}
    found: dict[str, dict[int, float]] = {}
    rows = [row for row in read_rows(path) if int(row["dimension"]) == dimension]
    for shown, beginning in SHOWN.items():
        for row in rows:
            if row["algorithm"].startswith(beginning) and _of_the_right_year(row):
                found[shown] = {
                    int(name.removeprefix(_PREFIX)): float(value)
                    for name, value in row.items()
                    if name.startswith(_PREFIX) and value
                }
    return found


def _of_the_right_year(row: dict[str, str]) -> bool:
    """Leave out what stands there twice: the best of 2016 again in 2017."""
    return row["year"] == ("2017" if row["algorithm"] == "SMS-EMOA-" else "2016")
