"""``pymoo-hdte robust``: from a study in a TOML file to the robust designs of a simulator."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pymoo_hdte.cli.command import Command, Outcome, Say, outcome_of

if TYPE_CHECKING:
    from pymoo_hdte.cli.robust_study import RobustStudy

_DETAILS = """example:
  pymoo-hdte robust study.toml --example
  pymoo-hdte robust study.toml --out report

The first call writes a study and a simulator to begin with, and replaces nothing. A simulator is a
function of a Python module beside the study, or a program, which is started without a shell.
Finished runs are kept beside the study in STUDY_runs.jsonl: after a kill or with a larger budget
the same command goes on from there.
DIR gets report.html, robust.json, front.csv (designs of the front, their statistics with errors)
and runs.csv (all runs of the simulator); an earlier report there is replaced, anything else
refused.
Exit codes: 0 a report was written; 2 the input is at fault, or the surrogate is not as accurate as
the study asks for."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("study", type=Path, metavar="STUDY", help="TOML file of the study")
    output = parser.add_mutually_exclusive_group(required=True)
    output.add_argument("--out", type=Path, metavar="DIR", help="folder for the report")
    output.add_argument(
        "--example", action="store_true", help="write a first study to STUDY, and its simulator"
    )


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    if options.example:
        from pymoo_hdte.cli.first_study import write_first_study

        first, simulator = write_first_study(options.study)
        sentences = [
            f"Wrote {first} and its simulator {simulator}.",
            f"Next: pymoo-hdte robust {first} --out report",
        ]
        return Outcome({"written": [str(first), str(simulator)]}, "\n".join(sentences))
    from pymoo_hdte._interrupts import orderly
    from pymoo_hdte.cli.robust_report import FOLDER, write_robust_report
    from pymoo_hdte.cli.robust_study import read_study

    with FOLDER.held(options.out), read_study(options.study) as study:
        runs = options.study.with_name(f"{options.study.stem}_runs.jsonl")
        # As `say`: progress is for a terminal that is not to be quiet.
        shown = not options.quiet and sys.stderr.isatty()
        try:
            with orderly(), warnings.catch_warnings(record=True) as noted:
                warnings.simplefilter("always", RuntimeWarning)
                problem = _problem(study, runs, shown)
                say("searching the front")
                result = _searched(problem, study)
        except KeyboardInterrupt:
            kept = f"finished runs are kept in {runs}; the same command goes on from there"
            raise KeyboardInterrupt(kept) from None
        # A simulator may warn in every run.
        kinds = RuntimeWarning, UserWarning
        messages = [str(entry.message) for entry in noted if entry.category in kinds]
        said = list(dict.fromkeys(messages))
        say("writing the report")
        document = write_robust_report(study.title, problem, result, said, options.out)
        return outcome_of(document, options.out)


def _problem(study: RobustStudy, runs: Path, progress: bool) -> Any:
    """Return the problem; a simulator that always fails is the input's fault."""
    from pymoo_hdte.checks import InvalidInput
    from pymoo_hdte.problems import SimulatorFailed, robust_problem

    try:
        return robust_problem(
            study.simulator,
            **study.inputs,
            **study.goals,
            **study.settings,
            cache=runs,
            progress=progress,
        )
    except SimulatorFailed as error:
        allowed = f"one that runs somewhere ({' '.join(str(error).split())})"
        raise InvalidInput("simulator", study.title, allowed) from error


def _searched(problem: Any, study: RobustStudy) -> Any:
    from pymoo.optimize import minimize

    return minimize(problem, study.algorithm, ("n_gen", study.generations), seed=study.seed)


ROBUST = Command(
    "robust",
    "find robust designs of a simulator of your own",
    _DETAILS,
    _add_arguments,
    _run,
    out=None,
)
