"""Grow sets by the score beside a search by the rules: ``python -m experiments.studies.one_score``.

Takes a folder of campaigns, or of logs of mechanisms, with the truth of each in a file of JSON, and
writes a table in which both stand beside each other.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from pathlib import Path
from typing import Any

from experiments.studies.one_score.comparison import compare, with_held_out
from experiments.studies.one_score.table import COLUMNS, row_of
from pymoo_hdte.discrepancy import analyse, read_campaign, read_rig
from pymoo_hdte.discrepancy._selection.fitting import fit
from pymoo_hdte.discrepancy._verdicts import mechanism, rattling


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(prog="python -m experiments.studies.one_score")
    parser.add_argument("campaigns", type=Path)
    parser.add_argument("truth", type=Path)
    parser.add_argument("cases", nargs="*")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--held-out", action="store_true", help="count held-out records as well")
    options = parser.parse_args()
    truth = json.loads(options.truth.read_text(encoding="utf-8"))
    with options.out.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        for case in options.cases or sorted(truth):
            table.writerow(_row(case, options.campaigns / case, truth[case], options.held_out))
            file.flush()


def _row(case: str, folder: Path, truth: dict[str, Any], held_out: bool) -> dict[str, Any]:
    asked = list[tuple[Any, ...]]()
    rattling.judge = _noting(rattling.judge, asked)
    mechanism.judged = _noting(mechanism.judged, asked)
    campaign = (folder / "campaign.toml").is_file()
    measured = read_campaign(folder) if campaign else read_rig(folder)
    started = time.process_time()
    finding: Any = analyse(measured).finding
    seconds = time.process_time() - started
    # What was asked first: before nuisances of the bench joined the base.
    first, second, candidates, *best = asked[0]
    if campaign:
        data = with_held_out(first) if held_out else first
        base = fit(data, start=second.values) if held_out else second
        found = compare(data, base, candidates)
    else:
        found = compare(second, fit(second), candidates, best[0] and best[0].fit)
    return row_of(case, truth, finding.verdict, found, seconds)


def _noting(judge: Any, asked: list[tuple[Any, ...]]) -> Any:
    def noted(*arguments: Any, **named: Any) -> Any:
        asked.append(arguments)
        return judge(*arguments, **named)

    return noted


if __name__ == "__main__":
    main()
