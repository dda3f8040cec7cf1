"""Colours and settings of the figures; the style sheet of the page is beside the templates."""

from __future__ import annotations

from typing import Any

MEASURED = "#1f2933"
BEFORE = "#d97706"
AFTER = "#0f6cbd"
FLOOR = "#6b7280"
BAND = "#cbd5e1"
MUTED = "#9aa5b1"
SOFT = "#52606d"
GOOD, BAD = "#15803d", "#c2410c"

# matplotlib types the keys as literals
PLOT: Any = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.edgecolor": "#7b8794",
    "axes.labelcolor": MEASURED,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.prop_cycle": "cycler('color', ['0f6cbd', 'd97706', '15803d', '6d28d9', '52606d'])",
    "axes.unicode_minus": True,
    "axes.formatter.use_mathtext": False,
    "axes.formatter.limits": (-4, 5),
    "grid.color": "#e4e7eb",
    "grid.linewidth": 0.6,
    "xtick.color": "#3e4c59",
    "ytick.color": "#3e4c59",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.2,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "mathtext.fontset": "cm",
    "path.simplify": True,
    "path.simplify_threshold": 0.2,
}
