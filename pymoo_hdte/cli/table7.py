"""``pymoo-hdte table7``: algorithms compared on robust problems, as in the paper or otherwise."""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import BrokenExecutor
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from pymoo_hdte.cli.command import Command, Outcome, Say, heading, outcome_of

if TYPE_CHECKING:
    from pymoo_hdte._comparing.setting import Setting
    from pymoo_hdte._runner.campaign import Campaign

SEEDS = 20
"""Runs of every algorithm: the paper's number, and the default."""
NAME = "table7"
OURS = {NAME, "ioh", "report.html", "runs", "times", ".in-use"}
"""What this command makes in its folder."""
OPEN = {
    "evaluations": "--evaluations",
    "population": "--pop",
    "problems": "--problems",
    "algorithms": "--algorithms",
}
"""Fields of a setting, and the options that give them."""
NAMES = """\
Names are those of this package (calibrated, resonant, toy, the members of robust_dte_family; \
AMP-MOPSO, MOPSO, NSGA-II, A-MOPSO, MP-MOPSO, ElitistSwarm, CompactSwarm, which sizes itself), \
those of pymoo (zdt1; NSGA2), or module:name of a module of yours. The first algorithm is tested \
against the others."""

_DETAILS = f"""example:
  pymoo-hdte table7 --seeds 3 --out results
  pymoo-hdte table7 --problems zdt1,resonant --algorithms CompactSwarm,NSGA2 --evaluations 2000 \\
      --out mine

{NAMES}

DIR gets report.html, tables as CSV and pictures in table7, every improvement of every run in ioh
(IOHprofiler's form for several objectives), and finished runs, from which the same command goes on
after an interrupt; a folder with anything else is refused. Without options it is the experiment
of the paper: 2 problems, 3 algorithms, 20 seeds, 10,000 evaluations each.
Exit codes: 0 a report was written; 2 the input is at fault."""


def add_setting_options(parser: argparse._ActionsContainer) -> None:
    """Add the options that open a comparison to other problems, algorithms and budgets."""
    parser.add_argument(
        "--evaluations", type=positive, metavar="N", help="of every run (default 10000)"
    )
    parser.add_argument(
        "--pop",
        type=positive,
        dest="population",
        metavar="N",
        help="size of the population (default 100)",
    )
    parser.add_argument(
        "--problems", type=listed, metavar="A,B", help="default calibrated,resonant"
    )
    parser.add_argument(
        "--algorithms", type=listed, metavar="A,B", help="default those of the paper's table"
    )


def listed(text: str) -> tuple[str, ...]:
    """Return the names of a list."""
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of names like a,b")
    return names


def counted(text: str) -> range:
    """Return what a number, from 1 on, or a range stands for."""
    start, dash, end = text.partition("-")
    if not dash:
        return range(1, positive(text) + 1)
    numbers = range(positive(start), positive(end) + 1)
    if not numbers:
        raise argparse.ArgumentTypeError(f"{text!r} is not a range that rises, like 21-40")
    return numbers


def positive(text: str) -> int:
    """Return a whole number of at least 1."""
    allowed = f"{text!r} is not a whole number of at least 1"
    try:
        number = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(allowed) from None
    if number < 1:
        raise argparse.ArgumentTypeError(allowed)
    return number


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seeds",
        type=counted,
        default=range(1, SEEDS + 1),
        metavar="N",
        help=f"runs of every algorithm (default {SEEDS}), or their seeds: 21-40",
    )
    add_setting_options(parser)
    parser.add_argument(
        "--workers", type=positive, metavar="N", help="processes (default: one a usable core)"
    )
    parser.add_argument("--dask", metavar="ADDRESS", help="run on this Dask scheduler instead")


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte._comparing.named import check_setting
    from pymoo_hdte._comparing.setting import Setting
    from pymoo_hdte._interrupts import orderly
    from pymoo_hdte._reports.in_use import in_use
    from pymoo_hdte._runner.campaign import Campaign
    from pymoo_hdte._runner.workers import WorkerLost, WrongWorker, make_executor
    from pymoo_hdte.surrogate.threads import usable_cores

    out, seeds = options.out, options.seeds
    # Modules of users are found where they work, as by ``python -m``.
    sys.path.insert(0, str(Path.cwd()))
    given = {name: getattr(options, name) for name in OPEN if getattr(options, name) is not None}
    setting = Setting(first_seed=seeds[0], **given)
    check_setting(setting)
    check_folder(out)
    out.mkdir(parents=True, exist_ok=True)
    try:
        with orderly(), in_use(out / ".in-use", "--out", out):
            executor = make_executor(options.workers or usable_cores(), options.dask)
            with executor or nullcontext():
                campaign = Campaign(out, executor, silent=True if options.quiet else None)
                return _compared(setting, seeds, campaign, say)
    except KeyboardInterrupt:
        kept = f"what is finished is kept in {out}; the same command goes on from there"
        raise KeyboardInterrupt(kept) from None
    except (BrokenExecutor, WorkerLost, WrongWorker) as error:
        raise ChildProcessError(" ".join([str(error), *getattr(error, "__notes__", [])])) from error


def _compared(setting: Setting, seeds: range, campaign: Campaign, say: Say) -> Outcome:
    from pymoo_hdte._comparing import table7
    from pymoo_hdte._comparing.ioh import ioh_files
    from pymoo_hdte._comparing.published import QUESTION
    from pymoo_hdte._reports.folder import PAGE_FILE
    from pymoo_hdte._runner.page import result_page
    from pymoo_hdte._runner.store import RESULT, TIMES, load, save, write_atomically

    say("running the algorithms")
    out, comparisons = campaign.out, table7.run(setting, seeds, campaign)
    say("measuring and drawing")
    result = table7.result(setting, comparisons, f"pymoo-hdte {NAME}")
    save(out, NAME, result)
    for path, text in ioh_files(comparisons, setting):
        write_atomically(out / "ioh" / path, text.encode())
    if (stored := load(out, NAME)) is None:
        raise RuntimeError(f"{out / NAME} was changed while it was written")
    page = result_page(stored, QUESTION, f"{NAME}/", f"{TIMES}/{NAME}/")
    write_atomically(out / PAGE_FILE, page.encode())
    answer = filter(None, (stored.first_sentence, stored.further_sentences))
    document = heading("comparison", list(answer), [])
    document |= json.loads((out / NAME / RESULT).read_text(encoding="utf-8"))
    return outcome_of(document, out)


def check_folder(out: Path) -> None:
    """Refuse a folder that holds anything but what this command makes.

    Raises
    ------
    InvalidInput
        It does, or is no folder.
    OSError
        It cannot be read.
    """
    from pymoo_hdte.checks import InvalidInput

    if out.exists() and not (out.is_dir() and {path.name for path in out.iterdir()} <= OURS):
        raise InvalidInput("--out", str(out), f"a folder that is new, empty or made by {NAME}")


TABLE_7 = Command(
    NAME,
    "compare optimisers, by default as in the paper's Table 7",
    _DETAILS,
    _add_arguments,
    _run,
    ("DIR", "folder for the report and the finished runs"),
)
