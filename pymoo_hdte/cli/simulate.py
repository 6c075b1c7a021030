"""``pymoo-hdte simulate``: what a drive does under one condition, and where it resonates."""

from __future__ import annotations

import argparse

from pymoo_hdte.cli.command import Command, Outcome, Say, outcome_of
from pymoo_hdte.cli.drive_arguments import DRIVE_DETAILS, add_drive_arguments, read_drive

FASTEST_INPUT = 50_000.0
"""Largest speed that is accepted, r/min: no strain wave gear turns faster."""
LARGEST_LOAD = 1e6
"""Largest load that is accepted, N.m: no strain wave gear bears more."""

_DETAILS = f"""example:
  pymoo-hdte simulate hs_20_100 --speed 1500 --load 20 --out reports/at-1500
  pymoo-hdte simulate hs_20_100 --map --out reports/map

{DRIVE_DETAILS}
DIR gets report.html, simulation.json, transmission_error.csv (one output turn, integrated in time),
order_lines.csv (the steady state) and speeds.csv (DTE over speed at this load); with --map also
map.csv and map.svg (error, torque ripple, efficiency and resonances over speed, load and direction,
up to this load, whether it opposes or drives). An earlier report there is replaced, anything else
refused.
Exit codes: 0 simulated; 2 the input is at fault, or the drive has no steady state there."""


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    add_drive_arguments(parser)
    parser.add_argument(
        "--speed", type=float, metavar="R_MIN", help="of the input, r/min (default: rated)"
    )
    parser.add_argument(
        "--load",
        type=float,
        metavar="N_M",
        help="torque at the output, N.m (default: rated); negative where it drives",
    )
    parser.add_argument("--map", action="store_true", help="also over speed, load and direction")


def _run(options: argparse.Namespace, say: Say) -> Outcome:
    from pymoo_hdte.checks import real_number
    from pymoo_hdte.cli.drive_arguments import exceeded
    from pymoo_hdte.cli.simulation import simulate_condition
    from pymoo_hdte.cli.simulation_report import FOLDER, write_simulation_report
    from pymoo_hdte.units import REVOLUTION_PER_MINUTE

    with FOLDER.held(options.out):
        model, page, notes = read_drive(options)
        speed, load = model.sheet.input_speed, model.sheet.load_torque
        if options.speed is not None:
            given = real_number("--speed", options.speed, above=0.0, at_most=FASTEST_INPUT)
            speed = given * REVOLUTION_PER_MINUTE
        if options.load is not None:
            load = real_number("--load", options.load, at_least=-LARGEST_LOAD, at_most=LARGEST_LOAD)
        say("integrating the equations of motion, and the steady state over all speeds")
        if page is not None:
            notes += exceeded(page, speed, load)
        simulation = simulate_condition(model.at(speed, load), options.map, page)
        return outcome_of(write_simulation_report(simulation, notes, options.out), options.out)


SIMULATE = Command(
    "simulate",
    "give the transmission error of a drive at a speed and load",
    _DETAILS,
    _add_arguments,
    _run,
)
