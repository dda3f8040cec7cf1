"""Physics without a name: what a port may add by its kind, as columns with free weights.

A kind says what the addition depends on (its own displacement, its flow, its past, time). The
columns span far more than any law of the catalogue; what they leave is no matter of the law's
shape, and what they explain is the most that any law of that kind could.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bondgraph.graph.elements import GY, TF, C, Element, I, R, Source, TwoPort
from bondgraph.graph.sensors import Sensor
from bondgraph.hysteresis import play_record
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Signature
from identification.diagnosis.catalogue.memory.creep import lagged
from identification.diagnosis.catalogue.places import CAPACITORS, HEAT_STORES, TANKS, has_unit
from identification.diagnosis.catalogue.transduction.nonlinear_ratio import (
    current_of_two_port,
    way_of_two_port,
)
from identification.diagnosis.screening.port_history import PortHistory

KINDS = (
    "restoring", "dissipative", "surface", "memory", "slow", "mode", "ratio", "command", "sensing",
    "time", "exogenous",
)  # fmt: skip
"""Kinds of physics, in the order in which they are told."""
SORTS = {
    "restoring": "a force that depends on the displacement",
    "dissipative": "a loss that depends on the flow",
    "surface": "an effort that depends on displacement and flow together",
    "memory": "a memory",
    "slow": "a slow after-effect",
    "mode": "a resonance",
    "ratio": "a ratio that is not constant",
    "command": "a distortion of the command",
    "sensing": "an error of the reading",
    "time": "a coefficient that changes in time",
    "exogenous": "an influence from outside",
}
"""Kinds of physics in words."""
HATS = 9
"""Columns of a curve over its argument."""
WIDTHS = (0.02, 0.06, 0.15, 0.3, 0.5, 0.75)
"""Widths of plays over half of their argument's range."""
SLOW = (0.004, 0.02, 0.08, 0.3)
"""Time constants of slow relaxations over the duration of the record."""
QUICK = (1.0, 3.0, 10.0)
"""Time constants of short filters, samples."""
FILTERS = ("slow", "mode")
"""Kinds that are linear in the motion."""
WAVES = 10
"""Periods in a record up to which a coefficient may swing, along known histories."""
TIMES = 7
"""Columns of a coefficient that changes in time."""


def sort_anywhere(kind: str) -> str:
    """Return a kind of physics in words that hold in every domain.

    Examples
    --------
    >>> sort_anywhere("restoring")
    'an effort that depends on the displacement'
    """
    known = SORTS | {"restoring": "an effort that depends on the displacement"}
    return known.get(kind, f"something {kind}")


def flexible_forms(element: Element, past: PortHistory) -> Mapping[str, Signature]:
    """Return the columns of every kind that makes sense at an element, SI, of order one.

    Additions to the output of the port along its history, as signatures of effects are. Those of a
    two-port have both sides: a ratio that changes keeps the power. A command that stands still has
    none: it tells nothing of what the drive makes of it.
    """
    q = _unit(past.argument)
    match element:
        case C():
            keeps = has_unit(element, (*TANKS, *CAPACITORS, *HEAT_STORES))
            made = {
                "restoring": [curve(q)],
                "memory": [plays(q), plays(past.output)],
                "surface": [curve(q), products(q, _unit(np.gradient(q)))],
                "slow": [slow(q, past.dt), *([seeped(q)] if keeps else [])],
                "time": [in_time(q)],
            }
        case R():
            moved = _unit(past.moved) if past.moved is not None else q
            made = {
                "dissipative": [curve(q), dry(q)],
                "memory": [plays(moved), dry(q)],
                "surface": [curve(q), dry(q), products(moved, q)],
                "slow": [slow(q, past.dt), lagged_power(past)],
                "time": [in_time(q)],
            }
        case TF() | GY():
            return {"ratio": ratio(element, past)}
        case Source() if not np.ptp(past.argument) > 0:
            made = {}
        case Source():
            kind = "sensing" if element.measured else "command"
            made = {kind: [curve(q), quick(q, past.dt), rates(q)]}
        case Sensor():
            made = {"sensing": [curve(q), quick(q, past.dt), rates(q), drifts(past.n)]}
        case _:
            made = {}
    return {kind: Signature(np.hstack(parts)) for kind, parts in made.items()}


def rich_forms(element: Element, past: PortHistory) -> Mapping[str, Signature]:
    """Return the forms for known histories.

    The coefficient of the flow may be any curve of the displacement, and any coefficient may swing:
    along wrong histories so many columns would imitate what they please. What follows a command has
    to be no linear filter, nor may anything follow the motion as one: what was added has made the
    motion, so that some filter always fits.
    """
    forms = {k: f for k, f in flexible_forms(element, past).items() if k not in FILTERS}
    if "surface" in forms:
        where = past.argument if isinstance(element, C) else past.moved
        flow = past.rate if isinstance(element, C) else past.argument
        x = _unit(past.argument if where is None else where)
        more = curve(x) * _unit(flow)[:, None]
        forms["surface"] = Signature(np.hstack([forms["surface"].columns, more]))
    if "time" in forms:  # waves reach over left-out stretches, which narrow splines do not
        q = _unit(past.argument)
        turn = 2 * np.pi * np.outer(np.linspace(0, 1, past.n), np.arange(1, WAVES + 1))
        waves = q[:, None] * np.hstack([np.sin(turn), np.cos(turn)])
        forms["time"] = Signature(np.hstack([forms["time"].columns, waves]))
    if isinstance(element, Source):  # linear filters of it imitate linear changes anywhere
        q = _unit(past.argument)
        forms = dict.fromkeys(forms, Signature(np.hstack([curve(q), rates(q)[:, 1:]])))
    return forms


def linear_forms(element: Element, past: PortHistory) -> Signature:
    """Return what other values of an element's own parameters would add, a constant among it."""
    q = _unit(past.argument)
    one = np.ones(past.n)
    match element:
        case TF() | GY():
            return Signature(past.argument[:, None], past.output[:, None])
        case I():
            parts = [_unit(past.rate), one]
        case _:
            parts = [q, one]
    return Signature(np.stack(parts, axis=1))


def ratio(element: TwoPort, past: PortHistory) -> Signature:
    """Return shares of a ratio that depend on the way or, in a gyrator, on the current."""
    shares = curve(_unit(way_of_two_port(past)))
    if isinstance(element, GY):  # the field of a current; levers and areas follow the way
        shares = np.hstack([shares, curve(_unit(current_of_two_port(past)))])
    return Signature(shares * past.argument[:, None], shares * past.output[:, None])


def curve(z: Array) -> Array:
    """Quadratic splines over the range of `z`, most of them where most samples are."""
    from scipy.interpolate import BSpline

    low, high = float(z.min()), float(z.max())
    if high <= low:
        return np.zeros((z.size, 1))
    even = np.linspace(low, high, HATS - 1)
    filled = np.quantile(z, np.linspace(0, 1, HATS - 1))
    inner = 0.5 * (even + filled)
    inner[0], inner[-1] = low, high
    knots = np.concatenate([[low] * 2, inner, [high] * 2])
    return np.asarray(BSpline.design_matrix(np.clip(z, low, high), knots, 2).toarray())


def dry(flow: Array) -> Array:
    """Direction of a flow, its square with the sign, and two levels that fade with speed."""
    speed = np.abs(flow)
    size = float(np.sqrt(np.mean(flow**2))) or 1.0
    fading = [np.sign(flow) * np.exp(-((speed / (s * size)) ** 2)) for s in (0.05, 0.3)]
    return np.stack([np.sign(flow), flow * speed, *fading], axis=1)


def plays(z: Array) -> Array:
    """Return a bank of plays of `z`."""
    half = 0.5 * float(np.ptp(z)) or 1.0
    widths = half * np.array(WIDTHS)
    x = np.ascontiguousarray(z, dtype=float)
    made = x[:, None] - play_record(x, widths, np.full(widths.size, x[0]))
    return np.asarray(made / np.maximum(np.abs(made).max(axis=0), 1e-300))


def products(displacement: Array, flow: Array) -> Array:
    """Products of a displacement and a flow: what no sum of curves of either can be.

    A coefficient of the flow, and of its direction, that depends on the displacement.
    """
    x, v = displacement, flow
    return np.stack([x * v, x**2 * v, x * np.sign(v), x**2 * np.sign(v), x * v**2], axis=1)


def slow(z: Array, dt: float) -> Array:
    """Slow relaxations of `z` and of its square."""
    duration = dt * z.size
    parts = [lagged(y, s * duration, dt) for s in SLOW for y in (z, z**2)]
    return np.stack(parts, axis=1)


def seeped(z: Array) -> Array:
    """Return what has left a store through leaks in proportion to powers of its effort."""
    flows = np.stack([np.sign(z) * np.abs(z) ** p for p in (0.5, 1.0, 2.0)], axis=1)
    return np.asarray(np.cumsum(flows, axis=0) / z.size)


def lagged_power(past: PortHistory) -> Array:
    """Flow times the heat that the port has kept, for several time constants."""
    power = _unit(past.argument * past.output)
    duration = past.dt * past.n
    flow = _unit(past.argument)
    return np.stack([flow * lagged(power, s * duration, past.dt) for s in SLOW], axis=1)


def quick(z: Array, dt: float) -> Array:
    """Short lags of `z`."""
    return np.stack([lagged(z, s * dt, dt) for s in QUICK], axis=1)


def rates(z: Array) -> Array:
    """Rate of `z`, its direction, and its square with the sign."""
    rate = _unit(np.gradient(z))
    return np.stack([rate, np.sign(rate), rate * np.abs(rate)], axis=1)


def drifts(n: int) -> Array:
    """Smooth curves of time, shape (n, TIMES)."""
    return curve(np.linspace(-1.0, 1.0, n))


def in_time(z: Array) -> Array:
    """`z` times smooth curves of time."""
    return np.asarray(z[:, None] * drifts(z.size))


def _unit(z: Array) -> Array:
    return np.asarray(z / (float(np.abs(z).max()) or 1.0))
