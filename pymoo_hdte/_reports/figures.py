"""Figures of the reports: colours, and pictures that are embedded in the page."""

from __future__ import annotations

import base64
import io

import matplotlib
from matplotlib.figure import Figure

# Okabe and Ito's palette, told apart by colour-blind readers.
BEFORE, AFTER = "#D55E00", "#0072B2"
GREY, FAINT = "#5B6570", "#E4E8EC"


def svg(figure: Figure) -> str:
    """Return a figure as SVG; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "pymoo_hdte"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue().decode()


def svg_uri(text: str) -> str:
    """Return a picture in SVG as the address of an inline one."""
    return "data:image/svg+xml;base64," + base64.b64encode(text.encode()).decode()


def data_uri(figure: Figure) -> str:
    """Return a figure as the address of an inline SVG."""
    return svg_uri(svg(figure))
