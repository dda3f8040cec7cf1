"""Pictures of uncertainty: profiles with their threshold, correlations, samples in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bondgraph.support.errors import UnusableInput
from identification.report.canvas import drawing, label
from identification.report.style import BAD, FLOOR, MEASURED
from identification.uncertainty.information import Information
from identification.uncertainty.profile import Profile
from identification.uncertainty.sampling import Sample

INK, MARK, PALE = MEASURED, BAD, FLOOR


def profile_figure(profiles: Sequence[Profile], columns: int = 3) -> Any:
    """Return a figure with one panel a profile: rise, threshold, interval, shape in words.

    The rise is cut at three thresholds, so that all panels read alike.
    """
    if not profiles:
        raise UnusableInput("profile figure: there is no profile to draw")
    wide = min(columns, len(profiles))
    high = -(-len(profiles) // wide)
    with drawing("profiles", 2.7 * high, 3.4 * wide, paper=True) as canvas:
        for i, p in enumerate(profiles, start=1):
            _profile(canvas.figure.add_subplot(high, wide, i), p)
    return canvas.figure


def _profile(ax: Any, p: Profile) -> None:
    share = p.cost / p.threshold
    ax.plot(p.grid, share, "-o", color=INK, markersize=3, linewidth=1)
    ax.axhline(1.0, color=MARK, linewidth=0.8, linestyle="--")
    ax.axvline(p.value, color=PALE, linewidth=0.8)
    low = max(p.interval[0], float(p.grid[0]))
    ends = min(p.interval[1], float(p.grid[-1]))
    ax.axvspan(low, ends, color=PALE, alpha=0.18, linewidth=0)
    if p.better is not None:
        ax.plot([p.better], [-p.drop / p.threshold], "v", color=MARK)
    if p.log and p.grid[-1] > 30 * p.grid[0] > 0:
        ax.set_xscale("log")
    else:
        _few_ticks(ax.xaxis)
    ax.set_ylim(min(-0.1, float(share.min()) - 0.1), 3.0)
    ax.set_title(f"{p.name}: {p.shape}")
    ax.set_xlabel(label(p.name, "" if p.unit == "1" else p.unit))
    ax.set_ylabel("rise over 95 % threshold")
    ax.tick_params(labelsize=7)


def correlation_figure(information: Information) -> Any:
    """Return a figure of the correlation matrix; open parameters are left blank."""
    names = information.names
    size = max(2.6, 0.5 * len(names) + 1.6)
    rho = information.correlation
    with drawing("correlation", size, size + 0.6, paper=True) as canvas:
        _matrix(canvas.ax, names, rho)
    return canvas.figure


def _matrix(ax: Any, names: Sequence[str], rho: Any) -> None:
    ax.grid(False)
    picture = ax.imshow(np.ma.masked_invalid(rho), vmin=-1, vmax=1, cmap="RdBu_r")
    ax.set_xticks(range(len(names)), names, rotation=60, fontsize=8)
    ax.set_yticks(range(len(names)), names, fontsize=8)
    for i in range(len(names)):
        for j in range(len(names)):
            if np.isfinite(rho[i, j]) and len(names) <= 12:
                dark = abs(rho[i, j]) > 0.6
                ax.text(
                    j, i, f"{rho[i, j]:.2f}", ha="center", va="center", fontsize=7,
                    color="white" if dark else INK,
                )  # fmt: skip
    ax.figure.colorbar(picture, ax=ax, shrink=0.8)
    ax.set_title("correlation of the estimates")


def sample_figure(sample: Sample, most: int = 3000) -> Any:
    """Return a figure of a sample: histograms on the diagonal, pairs below."""
    n = len(sample.names)
    draws = sample.flat
    thin = draws[:: max(1, draws.shape[0] // most)]
    marks = np.quantile(draws, (0.025, 0.5, 0.975), axis=0)
    with drawing("sample", 1.8 * n + 0.8, 1.8 * n + 0.8, paper=True) as canvas:
        for i, j in zip(*np.tril_indices(n), strict=True):
            ax = canvas.figure.add_subplot(n, n, i * n + j + 1)
            if i == j:
                ax.hist(draws[:, i], bins=40, color=PALE)
                for k, style in enumerate((":", "-", ":")):
                    ax.axvline(marks[k, i], color=MARK, linewidth=0.8, linestyle=style)
                ax.set_yticks([])
                ax.set_title(sample.names[i])
            else:
                ax.plot(thin[:, j], thin[:, i], ".", color=INK, markersize=1, alpha=0.3)
            ax.tick_params(labelsize=6)
            _few_ticks(ax.xaxis)
            if i == n - 1:
                ax.set_xlabel(sample.names[j])
            if j == 0 and i > 0:
                ax.set_ylabel(sample.names[i])
    return canvas.figure


def _few_ticks(axis: Any) -> None:
    """Keep numbers of many digits apart."""
    from matplotlib.ticker import MaxNLocator

    axis.set_major_locator(MaxNLocator(3))
