"""Figures of the stack experiments, as SVG files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators.stack.loading_curve import LoadingCurve

__all__ = ["charge_figure", "clock_figure", "loading_figure"]

FloatArray = NDArray[np.float64]
Curves = Mapping[str, tuple[FloatArray, FloatArray]]


def _write(svg: str, path: Path) -> None:
    from bondgraph.support.whole_file import write_atomically

    write_atomically(path, svg + "\n")
    print(path)


def loading_figure(curves: Mapping[str, LoadingCurve], path: Path) -> None:
    """Draw loading curves, and their distance from the first one."""
    from identification.report.canvas import drawing

    with drawing("loading", 3.6) as canvas:
        left, right = canvas.rows(1, columns=2)[0]
        first = next(iter(curves.values()))
        for name, curve in curves.items():
            rise = curve.displacement - curve.displacement[0]
            off = rise - (first.displacement - first.displacement[0])
            left.plot(curve.volt[::50], 1e6 * curve.displacement[::50], label=name)
            right.plot(curve.volt[::50], 1e9 * off[::50])
        left.set(xlabel="V_in (V)", ylabel="x (um)", title="Loading curve")
        right.set(xlabel="V_in (V)", ylabel="nm", title="Rise less the rise of a virgin stack")
        left.legend()
    _write(canvas.svg, path)


def charge_figure(curves: Curves, path: Path) -> None:
    """Draw displacement over the command, voltage beside charge."""
    from identification.report.canvas import drawing

    with drawing("charge", 3.6) as canvas:
        left, right = canvas.rows(1, columns=2)[0]
        for name, (command, x) in curves.items():
            title, kind = name.rsplit(": ", 1)
            if kind == "voltage":
                left.plot(command, 1e6 * x, label=title)
            else:
                right.plot(1e6 * command, 1e6 * x)
        left.set(xlabel="voltage (V)", ylabel="x (um)", title="Voltage drive (bond graph, Ang)")
        right.set(xlabel="charge (uC)", ylabel="x (um)", title="Charge drive")
        left.legend()
    _write(canvas.svg, path)


def clock_figure(loops: Mapping[str, Curves], path: Path) -> None:
    """Draw a panel for each key: command against displacement, before and after."""
    from identification.report.canvas import drawing

    with drawing("clock", 3.6) as canvas:
        axes = canvas.rows(1, columns=len(loops))[0]
        for ax, (title, curves) in zip(axes, loops.items(), strict=True):
            for name, (u, x) in curves.items():
                ax.plot(u, 1e6 * x, label=name)
            ax.set(xlabel="V_in (V)", title=title)
        axes[0].set_ylabel("x (um)")
        axes[0].legend()
    _write(canvas.svg, path)
