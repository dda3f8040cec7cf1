"""Instruments by name: ordinary sensors with the fields that a data sheet gives.

What a sensor reads, and in which order it is changed, is said at `bondgraph.graph.elements.Sensor`.
What is a `Value` may be the name of a declared parameter or an expression of such.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np
import sympy as sp

from bondgraph.graph.elements import MSe, Se, Source, Value
from bondgraph.graph.modulation import displacement, effort, flow
from bondgraph.graph.sensors import Da, Df, Dq, Reading, Sensor
from bondgraph.laws.wrapping import Wrapping
from bondgraph.support.errors import GraphError


def encoder(
    name: str,
    counts: int,
    *,
    turn: float = 2 * math.pi,
    unit: str = "rad",
    counted: bool = False,
    wraps: bool = False,
) -> Dq:
    """Return an encoder for the 1-junction of a shaft, or of a carriage with its scale.

    Parameters
    ----------
    counts : int
        Counts of a turn, all edges.
    turn : float
        One turn, or the length of the scale, in `unit`.
    counted : bool
        It reads counts, not `unit`.
    wraps : bool
        It begins anew after each turn. Fits and diagnoses take it straight, as long as it turns by
        less than half a turn from one sample to the next.
    """
    if not (_is_above_zero(counts, int, np.integer) and _is_above_zero(turn)):
        raise GraphError(
            f"{name}: an encoder has counts and a turn above 0, not {counts!r}, {turn!r}; counts "
            "are whole"
        )
    turn, counts = float(turn), int(counts)
    step = turn / counts
    law = Wrapping(turn, -0.5 * step) if wraps else None  # what is rounded ends before the turn
    if counted:
        return Dq(name, unit="1", law=law, gain=1 / step, resolution=1.0)
    return Dq(name, unit=unit, law=law, resolution=step)


def tachometer(name: str, constant: Value, *, lag: Value | None = None, unit: str = "V") -> Df:
    """Return a tachometer for the 1-junction of a shaft; `constant` in V s/rad, `lag` in s."""
    return Df(name, unit=unit, gain=constant, lag=lag)


def accelerometer(
    name: str,
    natural_frequency: Value,
    damping_ratio: Value = 0.7,
    *,
    sensitivity: Value | None = None,
    unit: str = "m/s^2",
) -> Da:
    """Return an accelerometer for the 1-junction of its base: a seismic mass on a spring.

    Its reading is the acceleration behind ``w^2 / (s^2 + 2 z w s + w^2)``.

    Parameters
    ----------
    natural_frequency : float, str or expression
        ``w`` of the mounted instrument, rad/s.
    damping_ratio : float, str or expression
    sensitivity : float, str or expression, optional
        `unit` over m/s^2.
    """
    return Da(
        name, unit=unit, gain=sensitivity, natural_frequency=natural_frequency,
        damping_ratio=damping_ratio,
    )  # fmt: skip


def force_cell(
    name: str,
    of: str,
    *,
    sensitivity: Value | None = None,
    natural_frequency: Value | None = None,
    damping_ratio: Value | None = None,
    unit: str = "N",
) -> Reading:
    """Return a force cell that reads the effort at `of`: a one-port, 0-junction or ``tail>head``.

    `sensitivity` is in `unit` over N; frequency (rad/s) and damping are those of the cell.
    """
    return Reading(
        name, effort(of), unit=unit, gain=sensitivity, natural_frequency=natural_frequency,
        damping_ratio=damping_ratio,
    )  # fmt: skip


def strain_gauge(
    name: str,
    spring: str,
    length: float | sp.Expr,
    *,
    factor: float | sp.Expr | None = None,
    arms: int = 1,
) -> Reading:
    """Return a strain gauge on the C `spring` of the given length, m: a number or a symbol.

    It reads the strain; with a gauge `factor` the ratio of a bridge with so many active `arms`,
    ``arms factor strain / 4``.
    """
    for what, held in (("length", length), ("gauge factor", factor), ("number of arms", arms)):
        if not (held is None or isinstance(held, sp.Expr) or _is_above_zero(held)):
            raise GraphError(
                f"{name}: the {what} {held!r} is no number above 0; give one, or the symbol that "
                "parameter() returns"
            )
    gain = None if factor is None else 0.25 * arms * factor
    return Reading(name, displacement(spring) / length, unit="1", gain=gain)


def monitor(name: str, source: Source, ratio: Value | None = None, *, unit: str = "") -> Reading:
    """Return the monitor of a source: the copy of what it gives, behind its drive.

    `ratio` is what it reads over what the source gives; a command may have none, one or several.
    """
    if not isinstance(source, Source):
        raise GraphError(f"{name}: monitors {source!r}, which is no source; give the element")
    value = (effort if isinstance(source, Se | MSe) else flow)(source.name)
    return Reading(name, value, unit=unit or source.unit, gain=ratio)


def _is_above_zero(value: object, *kinds: type) -> bool:
    """Whether a value is a finite number above 0, of one of the kinds if they are given."""
    number = isinstance(value, kinds or (int, float, np.number)) and not isinstance(value, bool)
    return number and 0 < value < math.inf  # type: ignore[operator]


INSTRUMENTS: Final[Mapping[str, Callable[..., Sensor]]] = {
    f.__name__: f for f in (accelerometer, encoder, force_cell, monitor, strain_gauge, tachometer)
}
"""All of them by name."""
