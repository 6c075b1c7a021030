"""Fig. 4: Pearson correlations of the error sources as heat maps."""

from __future__ import annotations

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from pymoo_hdte.identification import ErrorStatistics

TITLES = ("independent prototypes", "with a planted correlation")


def heat_maps(*campaigns: ErrorStatistics) -> Figure:
    """Draw the correlation matrix of each campaign; significant pairs are framed."""
    figure = Figure(figsize=(6.2 * len(campaigns), 5.6), layout="constrained")
    axes = figure.subplots(1, len(campaigns), squeeze=False)[0]
    for axis, campaign, title in zip(axes, campaigns, TITLES, strict=True):
        image = axis.imshow(campaign.correlation, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
        for (i, j), value in _entries(campaign):
            colour = "white" if abs(value) > 0.6 else "black"
            axis.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=6.5, color=colour)
        for i, j in campaign.correlated_pairs:
            for x, y in ((i, j), (j, i)):
                frame = Rectangle((x - 0.5, y - 0.5), 1, 1, fill=False, linewidth=2.5)
                axis.add_patch(frame)
        ticks = range(len(campaign.symbols))
        axis.set_xticks(ticks, campaign.symbols, rotation=60, fontsize=8)
        axis.set_yticks(ticks, campaign.symbols, fontsize=8)
        axis.set_title(title, fontsize=10)
    figure.colorbar(image, ax=axes, shrink=0.8, label="Pearson's r")
    return figure


def _entries(campaign: ErrorStatistics) -> list[tuple[tuple[int, int], float]]:
    size = len(campaign.symbols)
    return [((i, j), campaign.correlation[i, j]) for i in range(size) for j in range(size)]
