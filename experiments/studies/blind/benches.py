"""Paired blind campaigns: what a case is called on an ideal bench and on one with nuisances.

``python -m experiments.studies.blind.benches --cases 3,11,24 --benches ideal,mild,lag,wander=4e-4``
runs each case on each bench, goes on where it was interrupted, and prints alarms and lost names. A
bench is ``ideal``, a level with all nuisances, or one group of them alone at the level ``mild``,
whose leading number another one may replace. With ``--protocol`` the cases are `protocol_cases`:
forty pairs of the ideal bench and the level ``mild``, and five with each of `TOLD_AS` alone.

``experiments/data/blind_benches.csv`` has 38 of the forty pairs; ``single 1252`` and ``1262`` had
no end in ten minutes.
"""

from __future__ import annotations

import argparse
import csv
import json
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from experiments.studies.blind.campaigns import IDEAL, campaign_of, hiding
from experiments.studies.blind.cases import Case, all_cases
from experiments.studies.blind.data import outcome
from experiments.studies.blind.outcome import Outcome
from experiments.studies.blind.rig.nuisances import GROUPS, LEVELS, MILD, Nuisances
from experiments.studies.blind.scoring import COLUMNS, verdict_scores
from experiments.studies.blind.truth import may_be_named
from pymoo_hdte._runner.campaign import Campaign, Run
from pymoo_hdte._runner.provenance import environment
from pymoo_hdte._runner.workers import make_executor
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.discrepancy._answers.bench_faults import (
    COARSE,
    SATURATED,
    SPEED_WANDERS,
    bench_faults,
)
from pymoo_hdte.discrepancy._verdicts.drive import examine_drive

IDEAL_BENCH = "ideal"
TOLD = "told"
ALONE = tuple(group for group in GROUPS if MILD.has(group))
"""Groups that the level has, each a bench of its own."""
TOLD_AS: Mapping[str, frozenset[str]] = {
    "lag": frozenset({"loop_lag"}),
    "wander": frozenset({SPEED_WANDERS}),
    "input_coupling": frozenset({"coupling_ripple"}),
    # On a load that hardly gives way both sides of its torque sensor are one place.
    "output_coupling": frozenset({"torque_ripple", "gravity"}),
    "cogging": frozenset({"cogging"}),
    "mount": frozenset({"bench_resonance"}),
    "shaft": frozenset({"load_shaft"}),
    "brake_ripple": frozenset({"torque_ripple", "brake_ripple"}),
    "gravity": frozenset({"torque_ripple", "gravity"}),
    "warming": frozenset({"warming"}),
    "drift": frozenset({"input_torque_drift", "output_torque_drift"}),
    "zeros": frozenset({"new_zero", "new_input_torque_zero", "new_output_torque_zero"}),
    "saturation": frozenset({SATURATED}),
    "resolution": frozenset({COARSE}),
}
"""Names of nuisances and faults of a bench in a verdict, any of which tells a group."""
PAIRS, CLEAN, EACH = 40, 16, 5
"""Paired campaigns, those of them that hide nothing, and campaigns with one nuisance alone."""
SEEN = range(3001, 3421)
"""Places in the list of cases that were looked at before."""


def protocol_cases(cases: Sequence[Case]) -> list[int]:
    """Return the places of the first `CLEAN` clean cases of `SEEN`, then of the first others."""
    clean = [place for place in SEEN if cases[place - 1].truth == "none"]
    others = [
        place
        for place in SEEN
        if cases[place - 1].truth != "none" and cases[place - 1].kind != "unlisted"
    ]
    return [*clean[:CLEAN], *others[: PAIRS - CLEAN]]


def nuisances_of(bench: str) -> Nuisances:
    """Return the nuisances of a bench by its name.

    Raises
    ------
    InvalidInput
        For an unknown name, or a number that is none.
    """
    if bench == IDEAL_BENCH:
        return IDEAL
    if bench in LEVELS:
        return LEVELS[bench]
    group, given, number = bench.partition("=")
    if group not in GROUPS:
        raise InvalidInput("bench", bench, ", ".join((IDEAL_BENCH, *LEVELS, *GROUPS)))
    if group == "sensor_at_brake":
        return Nuisances(sensor_at_brake=True)
    alone = MILD.alone(group)
    if not given:
        return alone
    try:
        changed: dict[str, Any] = {GROUPS[group][0]: float(number)}
    except ValueError:
        raise InvalidInput("bench", bench, f"{group}= and a number") from None
    return replace(alone, **changed)


@dataclass(frozen=True)
class BenchJob:
    """A case on a bench; its run has one row of `scoring.COLUMNS`, nan beyond the verdict.

    A further column has the groups of `TOLD_AS` that the verdict tells, as bits.
    """

    case: Case
    bench: str

    @property
    def key(self) -> str:
        """Case and bench in one name."""
        return f"{self.case.key}_{self.bench}"

    def execute(self) -> Run:
        """Run and analyse; seconds are those of the processor."""
        hidden = hiding(self.case, nuisances_of(self.bench))
        campaign = campaign_of(hidden, hidden.session)
        begin = time.process_time()
        finding = examine_drive(campaign)
        scores = verdict_scores(self.case, finding.verdict)
        seconds = time.process_time() - begin
        names = {nuisance.name for nuisance, _ in finding.nuisances}
        names |= {fault.name for fault in bench_faults(finding)}
        bits = sum(1 << k for k, group in enumerate(TOLD_AS) if TOLD_AS[group] & names)
        row = [*(scores.get(column, np.nan) for column in COLUMNS), float(bits)]
        return Run((*COLUMNS, TOLD), np.array([row]), seconds, (seconds,))


@dataclass(frozen=True)
class Comparison:
    """A case on the ideal bench and on another, with the groups of nuisances told there."""

    bench: str
    ideal: Outcome
    real: Outcome
    told: frozenset[str] = frozenset()

    @property
    def alarm(self) -> bool:
        """Whether nothing is hidden, and the nuisances alone are called something.

        A case that the ideal bench raises an alarm for too says nothing about nuisances.
        """
        adequate = self.ideal.status == "adequate"
        return not self.ideal.hidden and adequate and self.real.status != "adequate"

    @property
    def lost(self) -> frozenset[str]:
        """Hidden names that are given on the ideal bench and not on the other."""
        return (self.ideal.hidden & set(self.ideal.names)) - set(self.real.names)

    @property
    def wrong(self) -> frozenset[str]:
        """Names that are given on the other bench only, and are wrong there."""
        allowed = may_be_named(self.real.case) | set(self.ideal.names)
        return frozenset(self.real.names) - allowed


def compare(cases: Sequence[Case], benches: Sequence[str], campaign: Campaign) -> list[Comparison]:
    """Run cases on benches, or read those that have run."""
    names = list(dict.fromkeys((IDEAL_BENCH, *benches)))
    jobs = [BenchJob(case, bench) for bench in names for case in cases]
    runs = campaign.run(jobs, "benches")
    outcomes, told = {}, {}
    for job, run in zip(jobs, runs, strict=True):
        outcomes[job.case, job.bench] = outcome(job.case, run)
        bits = int(run.values[0, run.columns.index(TOLD)])
        told[job.case, job.bench] = frozenset(
            group for place, group in enumerate(TOLD_AS) if bits >> place & 1
        )
    return [
        Comparison(bench, outcomes[case, IDEAL_BENCH], outcomes[case, bench], told[case, bench])
        for bench in names
        if bench != IDEAL_BENCH
        for case in cases
    ]


def text_of(comparisons: Sequence[Comparison]) -> str:
    """Return a line for each comparison, and one for each bench with its counts."""
    lines = []
    for bench in dict.fromkeys(comparison.bench for comparison in comparisons):
        chosen = [comparison for comparison in comparisons if comparison.bench == bench]
        lines += [_line(comparison) for comparison in chosen]
        clean = sum(not comparison.ideal.hidden for comparison in chosen)
        alarms = sum(comparison.alarm for comparison in chosen)
        lost = sum(len(comparison.lost) for comparison in chosen)
        named = sum(len(c.ideal.hidden & set(c.ideal.names)) for c in chosen)
        wrong = sum(len(comparison.wrong) for comparison in chosen)
        if bench in TOLD_AS:
            count = sum(bench in comparison.told for comparison in chosen)
            lines.append(f"{bench}: told in {count} of {len(chosen)}")
        lines.append(
            f"{bench}: {alarms} alarms in {clean} clean campaigns, {lost} of {named} names lost, "
            f"{wrong} new wrong names\n"
        )
    return "\n".join(lines)


def write_table(comparisons: Sequence[Comparison], path: Path) -> None:
    """Write a row a comparison as CSV, below a line with date and versions."""
    made = {"date": time.strftime("%Y-%m-%d")} | environment()
    with path.open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {json.dumps(made)}\n")
        table = csv.writer(file, lineterminator="\n")
        table.writerow(
            ("bench", "case", "truth", "ideal", "named_ideal", "real", "named_real", "told")
        )
        for comparison in comparisons:
            ideal, real = comparison.ideal, comparison.real
            table.writerow(
                (
                    comparison.bench,
                    f"{ideal.case.kind} {ideal.case.number}",
                    ideal.case.truth,
                    *(
                        part
                        for judged in (ideal, real)
                        for part in (judged.status, " ".join(judged.chosen))
                    ),
                    " ".join(sorted(comparison.told)),
                )
            )


def _line(comparison: Comparison) -> str:
    case = comparison.ideal.case
    said = [
        f"{each.status} {' '.join(each.chosen) if each.names else ''}".strip()
        for each in (comparison.ideal, comparison.real)
    ]
    told = f" [{' '.join(sorted(comparison.told))}]" if comparison.told else ""
    what = f"{case.kind} {case.number} ({case.truth})"
    return f"  {comparison.bench:16} {what}: {' -> '.join(said)}{told}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    chosen_cases = parser.add_mutually_exclusive_group(required=True)
    chosen_cases.add_argument(
        "--cases", type=_numbers, help="places in the list of cases: 3,11,24 or 1-24"
    )
    chosen_cases.add_argument("--protocol", action="store_true", help="the forty pairs, and alone")
    parser.add_argument(
        "--benches",
        default="mild",
        help=f"of {IDEAL_BENCH}, {', '.join((*LEVELS, *GROUPS))}; alone for each nuisance alone",
    )
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("results"), help="default results")
    options = parser.parse_args(arguments)
    benches: list[str] = []
    for bench in options.benches.split(","):
        benches += ALONE if bench == "alone" else (bench,)
    try:
        for bench in benches:
            nuisances_of(bench)
    except InvalidInput as error:
        parser.error(str(error))
    cases = all_cases()
    if options.protocol:
        options.cases, benches = protocol_cases(cases), ["mild"]
    if not all(1 <= number <= len(cases) for number in options.cases):
        parser.error(f"--cases must lie between 1 and {len(cases)}")
    options.out.mkdir(parents=True, exist_ok=True)
    executor = make_executor(options.workers, None)
    with executor or nullcontext():
        chosen = [cases[number - 1] for number in options.cases]
        campaign = Campaign(options.out, executor)
        comparisons = compare(chosen, benches, campaign)
        print(text_of(comparisons), flush=True)
        if options.protocol:
            alone = compare(chosen[:EACH], list(TOLD_AS), campaign)
            print(text_of(alone))
            comparisons += alone
        write_table(comparisons, options.out / "benches.csv")
    return 0


def _numbers(text: str) -> list[int]:
    numbers: list[int] = []
    for part in text.split(","):
        begin, dash, end = part.partition("-")
        numbers += range(int(begin), int(end if dash else begin) + 1)
    return numbers


if __name__ == "__main__":
    raise SystemExit(main())
