"""Command line of the experiments; see ``python -m experiments --help``."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence
from concurrent.futures import BrokenExecutor
from contextlib import ExitStack, nullcontext
from pathlib import Path

from experiments.runner.catalogue import EXPERIMENTS
from experiments.runner.registry import Context, Experiment, ExtraMissing
from experiments.runner.report import check_page, report_fingerprint, write_report
from pymoo_hdte._comparing.setting import Setting
from pymoo_hdte._interrupts import INTERRUPTED, orderly
from pymoo_hdte._reports.in_use import in_use
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.store import save
from pymoo_hdte._runner.workers import WorkerLost, WrongWorker, make_executor
from pymoo_hdte.checks import InvalidInput
from pymoo_hdte.cli.command import OneLineParser
from pymoo_hdte.cli.table7 import NAMES, OPEN, SEEDS, add_setting_options, counted, positive
from pymoo_hdte.surrogate.threads import usable_cores

FAILED = 1
"""Exit code where the workers or the disk fail, or a stored outcome or an extra is missing."""
SMALL = [experiment for experiment in EXPERIMENTS if experiment.has_small_version]
STORED = [experiment for experiment in EXPERIMENTS if experiment.reads_outcome]
SEEDED = [experiment for experiment in EXPERIMENTS if experiment.takes_seeds]
LIMITED = [experiment for experiment in EXPERIMENTS if experiment.takes_cases]
IN_USE = ".in-use"
"""File that a run holds in its folder, so that a second one does not write there."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the experiments that the command line asks for; return the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    if options.list:
        print(_list_of_experiments())
        return 0
    chosen = _chosen(options.name, parser)
    if options.quick and not (options.name and chosen[0].has_small_version):
        parser.error(f"--quick is for {_names(SMALL)}")
    if options.full and options.name and not chosen[0].reads_outcome:
        parser.error(f"--full is for {_names(STORED)}")
    if options.seeds and options.name and not chosen[0].takes_seeds:
        parser.error(f"--seeds is for {_names(SEEDED)}")
    given = {name: getattr(options, name) for name in OPEN if getattr(options, name) is not None}
    if given and not (options.name and chosen[0].takes_seeds):
        parser.error(f"{OPEN[next(iter(given))]} is for {_names(SEEDED)}")
    if options.cases and not (options.full and options.name and chosen[0].takes_cases):
        parser.error(f"--cases is for {_names(LIMITED)} with --full")
    seeds = options.seeds or range(1, SEEDS + 1)
    try:
        setting = Setting(first_seed=seeds[0], **given)
        if given:
            chosen[0].check(setting)
        check_page(options.out)
    except (InvalidInput, OSError) as error:
        parser.error(str(error))
    with ExitStack() as held:
        held.enter_context(orderly())
        try:
            options.out.mkdir(parents=True, exist_ok=True)
            if not os.access(options.out, os.W_OK | os.X_OK):
                parser.error(f"--out {options.out} cannot be written to")
            held.enter_context(in_use(options.out / IN_USE, "--out", options.out))
            executor = make_executor(options.workers, options.dask)
        except OSError as error:
            parser.error(f"--out {options.out} cannot be made a folder: {error.strerror}")
        except InvalidInput as error:
            parser.error(str(error))
        held.enter_context(executor or nullcontext())
        campaign = Campaign(options.out, executor)
        extent = options.full, options.quick, options.cases
        context = Context(len(seeds), options.out, campaign, *extent, setting)
        return _run(chosen, context)


def _run(chosen: Sequence[Experiment], context: Context) -> int:
    for experiment in chosen:
        print(f"{experiment.name}: {experiment.summary}", file=sys.stderr)
        try:
            save(context.out, experiment.name, experiment.run(context), report_fingerprint())
            report = write_report(context.out)
        except KeyboardInterrupt:
            # Further presses of Ctrl-C must not interrupt the orderly end of the workers.
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            message = (
                f"Interrupted during {experiment.name}. What is finished is kept in {context.out}; "
                "the same command goes on from there."
            )
            print(f"\n{message}", file=sys.stderr)
            write_report(context.out, notice=message)
            return INTERRUPTED
        except BrokenPipeError:
            # Nobody reads on: no failure, and nobody to tell.
            raise
        except (BrokenExecutor, WorkerLost, WrongWorker, ExtraMissing, OSError) as error:
            # An OSError is a full disk, a folder that is no longer there, or no stored outcome.
            notes = getattr(error, "__notes__", [])
            print("\n" + "\n".join([f"{experiment.name}: {error}", *notes]), file=sys.stderr)
            return FAILED
    print(report)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = OneLineParser(
        prog="python -m experiments",
        description="Reproduce the tables and figures of the paper and write a report.",
        epilog=_list_of_experiments(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("name", nargs="?", help="one experiment; without it, the quick set")
    parser.add_argument("--list", action="store_true", help="list the experiments and stop")
    parser.add_argument(
        "--seeds",
        type=counted,
        help=f"runs of every algorithm in {_names(SEEDED)} (default {SEEDS}), or their seeds: "
        "21-40",
    )
    about = f"another setting than the paper's, for {_names(SEEDED)}"
    add_setting_options(parser.add_argument_group(about, NAMES))
    parser.add_argument(
        "--workers",
        type=positive,
        default=usable_cores(),
        help="processes (default: as many as there are cores to use)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("results"), help="folder of the results (default results)"
    )
    parser.add_argument(
        "--cases",
        type=counted,
        help=f"with --full, only the first so many cases of {_names(LIMITED)}, or some: 97-192",
    )
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument(
        "--full",
        action="store_true",
        help=f"run the long campaign behind {_names(STORED)} instead of reading its stored "
        "outcome; without a name, those of the quick set",
    )
    extent.add_argument(
        "--quick",
        action="store_true",
        help=f"run a small version of {_names(SMALL)}, minutes",
    )
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="run the jobs on this Dask scheduler instead"
    )
    return parser


def _chosen(name: str | None, parser: argparse.ArgumentParser) -> list[Experiment]:
    if name is None:
        return [experiment for experiment in EXPERIMENTS if experiment.by_default]
    chosen = [experiment for experiment in EXPERIMENTS if experiment.name == name]
    if not chosen:
        known = ", ".join(experiment.name for experiment in EXPERIMENTS)
        parser.error(f"unknown experiment {name!r}, known: {known}")
    return chosen


def _names(experiments: Sequence[Experiment]) -> str:
    return ", ".join(experiment.name for experiment in experiments)


def _list_of_experiments() -> str:
    width = max(len(experiment.name) for experiment in EXPERIMENTS)
    return "\n".join(
        f"  {experiment.name:{width}}  {experiment.summary}"
        + ("" if experiment.by_default else " (by name only)")
        for experiment in EXPERIMENTS
    )
