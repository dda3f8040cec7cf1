"""Figures of the studies of the stack; matplotlib is imported with this file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from matplotlib.figure import Figure

from actuators.stack.charge_study import DriveComparison
from actuators.stack.loading_curve import LoadingCurve
from bondgraph.support.ops import FloatArray

Curves = Mapping[str, tuple[FloatArray, FloatArray]]


def _panels(count: int) -> tuple[Figure, Any]:
    figure = Figure(figsize=(9.3, 3.6), layout="constrained")
    return figure, figure.subplots(1, count, squeeze=False)[0]


def loading_figure(curves: Mapping[str, LoadingCurve]) -> Figure:
    """Draw loading curves, and their distance from the first one."""
    figure, (left, right) = _panels(2)
    first = next(iter(curves.values()))
    for name, curve in curves.items():
        rise = curve.displacement - curve.displacement[0]
        off = rise - (first.displacement - first.displacement[0])
        left.plot(curve.volt[::50], 1e6 * curve.displacement[::50], label=name)
        right.plot(curve.volt[::50], 1e9 * off[::50])
    left.set(xlabel="V_in (V)", ylabel="x (um)", title="Loading curve")
    right.set(xlabel="V_in (V)", ylabel="nm", title="Rise less the rise of a virgin stack")
    left.legend()
    return figure


def charge_figure(rows: Iterable[DriveComparison]) -> Figure:
    """Draw displacement over the command, voltage beside charge, of the bond graph with Ang."""
    figure, (left, right) = _panels(2)
    for row in (r for r in rows if "bond graph" in r.name):
        volt, x = row.curves["voltage"]
        left.plot(volt, 1e6 * x, label=row.load)
        charge, x = row.curves["charge"]
        right.plot(1e6 * charge, 1e6 * x)
    left.set(xlabel="voltage (V)", ylabel="x (um)", title="Voltage drive (bond graph, Ang)")
    right.set(xlabel="charge (uC)", ylabel="x (um)", title="Charge drive")
    left.legend()
    return figure


def clock_figure(loops: Mapping[str, Curves]) -> Figure:
    """Draw a panel for each key: command against displacement, before and after."""
    figure, axes = _panels(len(loops))
    for ax, (title, curves) in zip(axes, loops.items(), strict=True):
        for name, (u, x) in curves.items():
            ax.plot(u, 1e6 * x, label=name)
        ax.set(xlabel="V_in (V)", title=title)
    axes[0].set_ylabel("x (um)")
    axes[0].legend()
    return figure
