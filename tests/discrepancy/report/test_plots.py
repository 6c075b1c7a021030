"""Plots beside a report: the files hold what is drawn, and the page links them."""

import csv
import io
import json

import numpy as np
import pytest
from measured_oscillator import cubic_analysis
from quick_campaigns import ripple_analysis_and_report

from pymoo_hdte.discrepancy._report.plots_drive import drive_plots
from pymoo_hdte.discrepancy._report.plots_mechanism import mechanism_plots


def rows_of(text):
    return list(csv.DictReader(io.StringIO(text)))


def drive():
    analysis, files = ripple_analysis_and_report()
    document = json.loads(files["verdict.json"])
    return drive_plots(analysis.finding, analysis.revised_model(), document), files


def mechanism():
    analysis, files = cubic_analysis()
    return mechanism_plots(analysis.finding), files


@pytest.mark.parametrize("made", [drive, mechanism])
def test_the_table_holds_what_is_drawn_and_the_page_links_it(made):
    plots, files = made()
    assert plots
    page = files["report.html"].decode()
    entries = {entry["name"]: entry for entry in json.loads(files["verdict.json"])["plots"]}
    assert set(entries) == {plot.name for plot in plots}
    for plot in plots:
        entry = entries[plot.name]
        rows = rows_of(files[entry["csv"]].decode())
        drawn = [
            line.get_xydata()
            for axis in plot.figure().axes
            for line in axis.lines
            # The line of zero spans the axes and is no series.
            if list(line.get_xdata()) != [0, 1]
        ]
        points = np.concatenate(drawn)
        table = np.array([[float(row["x"]), float(row["y"])] for row in rows])
        assert np.array_equal(table, points)
        for name in (entry["csv"], entry["picture"]):
            assert f'href="{name}"' in page
            assert files[name]


def test_orders_and_resonance_of_a_drive_meet_where_their_frequencies_are_equal():
    plots, _ = drive()
    (campbell,) = (plot for plot in plots if plot.name == "campbell")
    (panel,) = campbell.panels
    resonance = next(series.y[0] for series in panel.series if series.label == "resonance")
    for series in panel.series:
        if series.label.startswith("order "):
            order = float(series.label.removeprefix("order "))
            assert series.y == pytest.approx(order * series.x / 60.0, rel=1e-3)
        if series.drawn == "points":
            assert np.all(series.y == resonance)


def test_friction_of_a_drive_without_dry_friction_is_its_drag():
    plots, _ = drive()
    (friction,) = (plot for plot in plots if plot.name == "friction")
    (panel,) = friction.panels
    points = np.concatenate([[s.x, s.y] for s in panel.series if s.drawn != "line"], axis=1)
    slope, level = np.polyfit(*points, 1)
    analysis, _ = ripple_analysis_and_report()
    accepted = analysis.verdict.accepted
    names = [parameter.name for parameter in accepted.parameters]
    drag = accepted.values[names.index("input_damping")] * 2.0 * np.pi / 60.0
    assert slope == pytest.approx(drag, rel=0.05)
    assert abs(level) < 0.1 * points[1].max()
