"""``python -m experiments.studies.one_score CAMPAIGNS TRUTH.json --out TABLE.csv [CASE ...]``.

Analyse the campaigns of a folder as ever, score the sets that were fitted, and write a table of
both answers beside the truth. TRUTH.json maps the name of a campaign to its ``effects``.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from pathlib import Path
from typing import Any

from experiments.studies.one_score.comparison import compare
from experiments.studies.one_score.table import COLUMNS, row_of
from pymoo_hdte.discrepancy import analyse, read_campaign, read_rig
from pymoo_hdte.discrepancy._verdicts import drive, mechanism_choice, rattling


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
    searched: list[Any] = []
    for module in (drive, rattling, mechanism_choice):
        # The candidates of a search are in no finding.
        module.judge = _noting(module.judge, searched)  # type: ignore[attr-defined]
    campaign = (folder / "campaign.toml").is_file()
    measured = read_campaign(folder) if campaign else read_rig(folder)
    started = time.process_time()
    finding: Any = analyse(measured).finding
    seconds = time.process_time() - started
    found = compare(finding.data, finding.verdict, searched, held_out)
    return row_of(case, truth, finding.verdict, found, seconds)


def _noting(judge: Any, searched: list[Any]) -> Any:
    def noted(data: Any, base: Any, candidates: Any, *further: Any, **named: Any) -> Any:
        searched[:] = candidates
        return judge(data, base, candidates, *further, **named)

    return noted


if __name__ == "__main__":
    main()
