"""Every generic way in which a port may depend on its own variables, without naming any."""

from __future__ import annotations

import numpy as np

from bondgraph.hysteresis import play_record
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.memory.creep import lagged
from identification.diagnosis.screening.port_history import PortHistory

PLAYS = (0.05, 0.15, 0.35, 0.7)
LAGS = (0.01, 0.05, 0.25)
CORNER = 0.02
"""Rates below this share of the largest count as standing still, softly."""


def generic_columns(past: PortHistory) -> dict[str, Array]:
    """Return labelled groups of columns made of one port's own variables only.

    Groups: ``linear`` (argument and one), ``odd`` and ``even`` powers of the argument, ``rate``
    (its derivative), ``rate_odd``, ``rate_even`` (powers of it), ``sign`` (of the argument, and its
    square with the sign), ``reversal`` (sign of the rate), ``memory`` (plays on the argument),
    ``slow`` (lags of it), ``product`` (argument times rate), ``time`` (trend, and the argument
    times time).

    Returns
    -------
    dict of str to ndarray, shape (N, k)
        Columns of order one, by group.

    Examples
    --------
    >>> past = PortHistory(np.sin(np.arange(100.0)), np.zeros(100))
    >>> generic_columns(past)["odd"].shape
    (100, 2)
    """
    x = (past.argument - past.centre) / past.half
    scale = float(np.sqrt(np.mean(past.rate**2))) or 1.0
    v = past.rate / scale
    fastest = float(np.abs(v).max()) or 1.0
    w = v / fastest
    t = np.linspace(-1.0, 1.0, past.n)
    one = np.ones(past.n)
    widths = np.array(PLAYS)
    plays = play_record(np.ascontiguousarray(x), widths, np.full(widths.size, x[0]))
    lags = [lagged(x, s * past.dt * past.n, past.dt) for s in LAGS]
    z = past.argument / (float(np.abs(past.argument).max()) or 1.0)
    groups: dict[str, list[Array]] = {
        "linear": [x, one],
        "odd": [x**3, x**5],
        "even": [x**2, x**4],
        "rate": [v],
        "rate_odd": [w**3, w**5],
        "rate_even": [w**2, w**4],
        "sign": [np.tanh(z / CORNER), np.abs(z) * z],
        "reversal": [np.tanh(w / CORNER)],
        "memory": list(plays.T),
        "slow": lags,
        "product": [x * w, x**2 * w, x * w**2],
        "time": [t, t**2, x * t, x * t**2],
    }
    return {name: np.stack(columns, axis=1) for name, columns in groups.items()}
