"""The report on a simulation: page, document and the curves as CSV, all or nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._reports.figures import AFTER, BEFORE, GREY, svg, svg_uri
from pymoo_hdte._reports.folder import ReportFolder
from pymoo_hdte._reports.html import change, number, page
from pymoo_hdte.cli.command import heading
from pymoo_hdte.cli.drive_arguments import near_resonances
from pymoo_hdte.cli.simulation import FASTEST, Simulation
from pymoo_hdte.drive import Comparison, OperatingMap
from pymoo_hdte.drive.catalogue import figure_text
from pymoo_hdte.drive.dte_map import DIRECTIONS, neighbouring_resonances
from pymoo_hdte.units import ARCSEC, REVOLUTION_PER_MINUTE

TURN_FILE = "transmission_error.csv"
LINES_FILE = "order_lines.csv"
SPEEDS_FILE = "speeds.csv"
MAP_FILE, MAP_PICTURE = "map.csv", "map.svg"
FOLDER = ReportFolder(
    "simulation.json", (TURN_FILE, LINES_FILE, SPEEDS_FILE), (MAP_FILE, MAP_PICTURE)
)

_APART = 0.01
"""Share by which the two solvers may differ before the report mentions it."""
_SMALL = 1e-3
"""Lines below this share of the largest are left out of figure and table."""


def write_simulation_report(
    simulation: Simulation, notes: Sequence[str], out: Path
) -> dict[str, Any]:
    """Write a report and return its document; errors as `ReportFolder.write`.

    ``notes`` are sentences on the drive that belong to the limits of the result.
    """
    document = simulation_document(simulation, notes)
    run = simulation.run
    turn = [run.time, run.input_angle, run.input_speed, run.transmission_error / ARCSEC]
    columns = ("time_s", "input_angle_rad", "input_speed_rad_s", "transmission_error_arcsec")
    speeds = np.column_stack([simulation.speeds.speeds, simulation.speeds.dte[0]])
    others = {
        TURN_FILE: csv_text(columns, np.column_stack(turn).tolist()),
        LINES_FILE: csv_text(("order", "amplitude_arcsec"), simulation.lines.items()),
        SPEEDS_FILE: csv_text(("input_speed_r_min", "dte_arcsec"), speeds.tolist()),
    }
    pictures = {
        "turn": svg(_turn_figure(simulation)),
        "lines": svg(_lines_figure(simulation)),
        "speeds": svg(_speeds_figure(simulation)),
    }
    if simulation.map is not None:
        pictures["map"] = svg(map_figure(simulation.map))
        others |= {MAP_FILE: map_table(simulation.map), MAP_PICTURE: pictures["map"]}
    FOLDER.write(out, _page(simulation, document, pictures), document, others)
    return document


def map_table(mapped: OperatingMap) -> str:
    """Return an operating map as CSV, a row a condition; unknown values are empty."""
    columns = (
        "direction", "input_speed_r_min", "load_Nm", "dte_arcsec", "torque_ripple_Nm",
        "motor_torque_Nm", "efficiency",
    )  # fmt: skip
    rows = [
        (
            direction,
            speed,
            load,
            *(
                None if np.isnan(values[place, row, column]) else float(values[place, row, column])
                for values in (mapped.dte, mapped.ripple, mapped.motor_torque, mapped.efficiency)
            ),
        )
        for place, direction in enumerate(DIRECTIONS)
        for row, load in enumerate(mapped.loads.tolist())
        for column, speed in enumerate((mapped.speeds / REVOLUTION_PER_MINUTE).tolist())
    ]
    return csv_text(columns, rows)


def simulation_document(simulation: Simulation, notes: Sequence[str]) -> dict[str, Any]:
    """Return what ``simulation.json`` holds."""
    return heading("simulation", sentences(simulation), limits(simulation, notes)) | {
        "input_speed_r_min": simulation.speed,
        "load_torque_Nm": simulation.model.sheet.load_torque,
        "dte_arcsec": {
            "steady_state": simulation.steady,
            "integrated": simulation.run.dte_arcsec(),
        },
        "order_lines_arcsec": {f"{order:g}": size for order, size in simulation.lines.items()},
        "torsional_mode": {
            "frequency_Hz": simulation.mode.frequency,
            "damping_ratio": simulation.mode.damping_ratio,
        },
        "efficiency": None if np.isnan(simulation.efficiency) else simulation.efficiency,
        "starting_torque_Nm": simulation.starting,
        "back_driving_torque_Nm": (
            simulation.back_driving if np.isfinite(simulation.back_driving) else None
        ),
        "printed_figures": [
            {
                "figure": comparison.figure.name,
                "printed": comparison.figure.value,
                "limit": comparison.figure.limit,
                "tolerance": comparison.figure.tolerance,
                "predicted": comparison.value,
                "interval90": [comparison.low, comparison.high],
                "holds": comparison.holds,
            }
            for comparison in simulation.printed
        ],
        "resonances": [
            {"order": order, "input_speed_r_min": speed} for order, speed in simulation.resonances
        ],
        "model": simulation.model.to_dict(),
    }


def sentences(simulation: Simulation) -> list[str]:
    """Say how large the DTE is, of what it is made, and where the drive resonates."""
    largest = sorted(_moving(simulation).items(), key=lambda line: -line[1])[:3]
    made_of = ", ".join(f"order {order:g} ({number(size, 3)} arcsec)" for order, size in largest)
    places = ", ".join(
        f"order {order:g} at {speed:.0f} r/min" for order, speed in simulation.resonances
    )
    if simulation.mode.resonates:
        mode = (
            f"The torsional mode at {simulation.mode.frequency:.0f} Hz (damping ratio "
            f"{number(simulation.mode.damping_ratio, 2)}) is met by {places}."
        )
    else:
        mode = "The torsional mode is damped too much to resonate."
    said = [
        f"DTE {simulation.steady:.2f} arcsec peak-to-peak at {simulation.speed:.0f} r/min and "
        f"{number(simulation.model.sheet.load_torque)} N.m.",
        f"Its largest lines, by order of the input turn: {made_of}.",
        mode,
        _torques(simulation),
    ]
    if simulation.printed:
        said.append(_of_printed(simulation.printed))
    if simulation.map is not None:
        said.append(_of_map(simulation.map))
    return said


def _of_printed(printed: Sequence[Comparison]) -> str:
    """Say how many printed figures are met, and which are not."""
    off = [
        f"{comparison.figure.name.replace('_', ' ')} "
        f"({figure_text(comparison.figure.name, comparison.value)} against "
        f"{'at most ' if comparison.figure.limit else ''}"
        f"{figure_text(comparison.figure.name, comparison.figure.value)})"
        for comparison in printed
        if not comparison.holds
    ]
    said = (
        f"Of {len(printed)} printed figures that were not entered, the model meets "
        f"{len(printed) - len(off)}" + (f"; it does not meet {', '.join(off)}." if off else ".")
    )
    accuracy = [c for c in printed if c.figure.name == "transmission_accuracy" and not c.holds]
    if accuracy:
        said += (
            " The accuracy follows from the errors of the parts. No page prints them, and those of "
            "the HS-20-100 stand in: enter the printed accuracy below [catalogue]."
        )
    return said


def _torques(simulation: Simulation) -> str:
    """Say what the drive loses, and which torque starts it from either side."""
    starting = f"{number(1e3 * simulation.starting, 3)} mN.m start the unloaded input"
    back = (
        f"and {number(simulation.back_driving, 3)} N.m at the output drive it back"
        if np.isfinite(simulation.back_driving)
        else "and no torque at the output drives it back"
    )
    if np.isnan(simulation.efficiency):
        return f"{starting}, {back}."
    return f"Efficiency {number(100.0 * simulation.efficiency, 3)} %; {starting}, {back}."


def _of_map(mapped: OperatingMap) -> str:
    """Say where the map has its largest error and which loads the motor cannot let drive."""
    place, row, column = np.unravel_index(np.nanargmax(mapped.dte), mapped.dte.shape)
    speed = mapped.speeds[column] / REVOLUTION_PER_MINUTE
    said = (
        f"Over the map the DTE is largest, {mapped.dte[place, row, column]:.0f} arcsec, "
        f"{list(DIRECTIONS)[place]} at {speed:.0f} r/min and "
        f"{number(mapped.loads[row], 3)} N.m"
    )
    torques = mapped.motor_torque[:, mapped.loads < 0.0]
    pushed = np.mean(torques[np.isfinite(torques)] > 0.0)
    return (
        f"{said}; {100.0 * pushed:.0f} % of the conditions with a driving load still need a motor."
    )


def limits(simulation: Simulation, notes: Sequence[str]) -> list[str]:
    """Say what a reader should know before quoting the result; ``notes`` are of the drive."""
    said = [*notes, *near_resonances(simulation.model)]
    if abs(simulation.difference) > _APART:
        said.append(
            "The integration in time differs from the steady state by "
            f"{change(100.0 * simulation.difference)}: "
            "the input angle itself fluctuates, or the motion has not settled."
        )
    if simulation.map is not None and simulation.map.not_found:
        said.append(
            f"At {simulation.map.not_found} of {simulation.map.dte.size} conditions of the map no "
            "steady state was found."
        )
    if simulation.speeds.unstable:
        said.append(
            f"At {simulation.speeds.unstable} of {simulation.speeds.dte.size} speeds the drive "
            "has no steady state."
        )
    return said


def _moving(simulation: Simulation) -> dict[float, float]:
    """Return the lines that are large enough to show, without the mean."""
    lines = {order: size for order, size in simulation.lines.items() if order}
    least = _SMALL * max(lines.values(), default=0.0)
    return {order: size for order, size in lines.items() if size >= least}


def _page(simulation: Simulation, document: dict[str, Any], pictures: dict[str, str]) -> str:
    return page(
        "pymoo_hdte.cli",
        "simulation.html.j2",
        simulation=simulation,
        model=simulation.model,
        document=document,
        lines=_moving(simulation),
        fastest=FASTEST,
        figure_text=figure_text,
        pictures={name: svg_uri(text) for name, text in pictures.items()},
    )


def _turn_figure(simulation: Simulation) -> Figure:
    """Draw the transmission error over the output turn, about its mean."""
    figure = Figure(figsize=(11.0, 3.0), layout="constrained")
    axis = figure.subplots()
    degrees = np.degrees(simulation.run.input_angle) / simulation.run.ratio
    error = simulation.run.transmission_error / ARCSEC
    axis.plot(degrees, error - error.mean(), color=AFTER, linewidth=0.7)
    axis.set_xlim(0.0, 360.0)
    axis.set_xlabel("output angle [deg]")
    axis.set_ylabel("transmission error [arcsec]")
    return figure


def _lines_figure(simulation: Simulation) -> Figure:
    lines = _moving(simulation)
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axis = figure.subplots()
    axis.stem(list(lines), list(lines.values()), linefmt=GREY, markerfmt="o", basefmt=" ")
    axis.set_yscale("log")
    axis.set_xlabel("order [cycles per input turn]")
    axis.set_ylabel("amplitude [arcsec]")
    return figure


def _speeds_figure(simulation: Simulation) -> Figure:
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axis = figure.subplots()
    axis.plot(simulation.speeds.speeds, simulation.speeds.dte[0], color=AFTER)
    axis.plot(simulation.speed, simulation.steady, "x", color=BEFORE, markersize=9, mew=2.2)
    for orders, speed in neighbouring_resonances(
        simulation.model, float(simulation.speeds.speeds[-1])
    ):
        axis.axvline(speed, color=GREY, linestyle="-.", linewidth=1.0)
        axis.annotate(
            f"order {orders}",
            (speed, 0.98),
            xycoords=axis.get_xaxis_transform(),
            rotation=90,
            ha="right",
            va="top",
            fontsize=8,
        )
    # Above the curve there is room for the words.
    axis.set_ylim(0.0, 1.5 * float(np.nanmax([simulation.steady, *simulation.speeds.dte[0]])))
    axis.set_xlabel("input speed [r/min]")
    axis.set_ylabel("DTE [arcsec]")
    return figure


def map_figure(mapped: OperatingMap) -> Figure:
    """Draw error, torque ripple and efficiency over speed and load, a row for each direction."""
    speeds = mapped.speeds / REVOLUTION_PER_MINUTE
    figure = Figure(figsize=(11.0, 6.4), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True, sharey=True)
    parts = (
        ("DTE [arcsec]", mapped.dte, "viridis"),
        ("torque ripple [N.m]", mapped.ripple, "viridis"),
        ("efficiency", mapped.efficiency, "cividis"),
    )
    resonances = mapped.resonances()
    for column, (label, values, colours) in enumerate(parts):
        low, high = (0.0, 1.0) if label == "efficiency" else np.nanquantile(values, [0.0, 0.98])
        for place, direction in enumerate(DIRECTIONS):
            axis = axes[place, column]
            mesh = axis.pcolormesh(
                speeds, mapped.loads, values[place], vmin=low, vmax=high, cmap=colours,
                shading="nearest", rasterized=True,
            )  # fmt: skip
            axis.set_title(f"{label}, {direction}", fontsize=10)
            if label != "efficiency":
                _draw_resonances(axis, mapped, resonances)
        figure.colorbar(mesh, ax=axes[:, column], extend="max" if high != 1.0 else "neither")
    for axis in axes[:, 0]:
        axis.set_ylabel("load against the motion [N.m]")
    for axis in axes[-1]:
        axis.set_xlabel("input speed [r/min]")
    return figure


def _draw_resonances(
    axis: Axes, mapped: OperatingMap, resonances: Mapping[float, NDArray[np.float64]]
) -> None:
    """Draw the speed of each resonance over the load, named at the top."""
    fastest = mapped.speeds[-1] / REVOLUTION_PER_MINUTE
    for order, at in resonances.items():
        speeds = at / REVOLUTION_PER_MINUTE
        if speeds.min() > fastest or order % 1.0:
            continue
        axis.plot(speeds, mapped.loads, color="white", linestyle="--", linewidth=1.0)
        axis.annotate(
            f"order {order:g}",
            (min(speeds[-1], fastest), mapped.loads[-1]),
            xytext=(-3, -3),
            textcoords="offset points",
            color="white",
            fontsize=8,
            rotation=90,
            ha="right",
            va="top",
        )
    axis.set_xlim(0.0, fastest)
