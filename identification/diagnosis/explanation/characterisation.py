"""What a latent signal at a port looks like, without a library of laws.

Which of the port's own variables explains it, with or without memory; odd or even; whether speed
matters; how its loops close and which way they turn; whether it jumps where the motion turns,
levels off at the ends, or goes on after a step. What is proportional to the argument belongs to the
linear element and is taken out first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.outside.generic import generic_columns
from identification.diagnosis.explanation.loops import Loops, loops
from identification.diagnosis.screening.port_history import PortHistory

LINEAR = ("linear",)
GROUPS: Mapping[str, tuple[str, ...]] = {
    "argument": ("odd", "even", "sign"),
    "rate": ("rate", "rate_odd", "rate_even", "reversal"),
    "memory": ("odd", "even", "sign", "memory"),
    "slow": ("slow",),
    "product": ("odd", "even", "sign", "rate", "product"),
    "time": ("time",),
}
"""Dependences compared, simplest first; the memory contains the plain argument."""
WORDS: Mapping[str, str] = {
    "argument": "its present argument alone",
    "rate": "the rate of its argument",
    "memory": "the turning points of its argument",
    "slow": "slow lags of its argument",
    "product": "argument and rate together",
    "time": "time",
    "nothing": "none of the port's own variables",
}
FOLDS = 10
RIDGE = 1e-6
CELLS = 16
CLEARLY = 0.05
"""A richer group is named only if it explains this much more of what is left out of the fit."""
LEAST = 0.2
"""Below this share of the variance no variable is named."""


@dataclass(frozen=True)
class Character:
    """What a latent signal looks like.

    Attributes
    ----------
    explained : dict of str to float
        Held-out share of the variance (linear part taken out) by dependence: ``argument``,
        ``rate``, ``memory``, ``slow``, ``product``, ``time``.
    variable : str
        The simplest dependence that explains clearly most, or ``nothing``.
    odd, even : float
        Shares of the curve over the argument (rate, if that is the variable) that change sign
        with it, and that do not.
    rate_gain : float
        What the rate explains beyond the argument and its turning points: near zero means rate
        independent.
    loops : Loops
        Area, closure and growth with speed of the loops over the argument, and dissipation.
    jump : float
        Jump where the rate changes sign, over the range of the signal.
    plateau : float
        Slope of the whole output at the ends of the range over the slope in the middle: near one
        where nothing levels off, near zero on a plateau, above one at a stop.
    dwell : float or None
        Drift while the argument rests after a move, over the signal's range, positive in the
        direction of the move's own effect; None without a rest.
    """

    explained: Mapping[str, float]
    variable: str
    odd: float
    even: float
    rate_gain: float
    loops: Loops
    jump: float
    plateau: float
    dwell: float | None

    @property
    def words(self) -> str:
        """One sentence."""
        share = max(0.0, self.explained.get(self.variable, 0.0))
        parts = [f"{WORDS[self.variable]} explains {100 * share:.0f} % of it"]
        if self.variable == "nothing":  # then its shape over them says nothing either
            return "none of the port's own variables explains it"
        if self.variable in ("argument", "rate", "memory"):
            kind = "odd" if self.odd > 0.8 else "even" if self.even > 0.8 else "of mixed symmetry"
            parts.append(f"it is {kind}")
        if self.variable == "memory":
            parts.append("rate independent" if self.rate_gain < CLEARLY else "rate dependent")
        if abs(self.loops.dissipation) > 0.1:
            takes = self.loops.dissipation > 0
            parts.append("it takes energy" if takes else "it gives energy")
        if self.jump > 0.3:
            parts.append("it jumps where the motion turns")
        if self.plateau < 0.5:
            parts.append("the output levels off at the ends")
        elif self.plateau > 2.0:
            parts.append("the output steepens at the ends")
        if self.dwell is not None and abs(self.dwell) > 0.05:
            parts.append("it goes on while the argument rests")
        return ", ".join(parts)


def characterise(past: PortHistory, signal: Array, *, flow: bool = False) -> Character:
    """Describe a latent signal at a port.

    Parameters
    ----------
    past : PortHistory
        The port's variables along the record.
    signal : ndarray, shape (N,), SI
        Addition to the output, such as `latent` reconstructs it.
    flow : bool
        The argument is a flow (resistor, inertia) and not a displacement (storage).

    Examples
    --------
    >>> t = 0.01 * np.arange(4000)
    >>> q = np.sin(t) + 0.4 * np.sin(2.7 * t)
    >>> characterise(PortHistory(q, q, 0.01), q**3).variable
    'argument'
    """
    groups = generic_columns(past)
    if past.moved is not None and np.ptp(past.moved) > 0:
        way = generic_columns(PortHistory(past.moved, past.output, past.dt))
        groups = {**groups, "way": np.concatenate([way["linear"], way["odd"], way["even"]], axis=1)}
    explained = {name: held_out(groups, LINEAR, g, signal) for name, g in GROUPS.items()}
    if "way" in groups:
        explained["way"] = held_out(groups, LINEAR, ("way",), signal)
    variable = _simplest(explained)
    both = held_out(groups, LINEAR, (*GROUPS["memory"], *GROUPS["rate"]), signal)
    odd, even = _symmetry(past, variable, signal)
    return Character(
        explained=explained,
        variable=variable,
        odd=odd,
        even=even,
        rate_gain=max(0.0, both - explained["memory"]),
        loops=loops(past, signal, flow=flow),
        jump=_jump(groups, past, signal, flow=flow),
        plateau=_plateau(past, signal),
        dwell=_dwell(past, signal),
    )


def held_out(
    groups: Mapping[str, Array], base: Sequence[str], more: Sequence[str], signal: Array
) -> float:
    """Share of the variance left by `base` that `more` explains on blocks left out of the fit."""
    n = signal.size
    block = np.arange(n) * FOLDS // n
    low = np.concatenate([groups[g] for g in base], axis=1)
    high = np.concatenate([groups[g] for g in (*base, *more)], axis=1)
    left = np.zeros(2)
    for k in range(FOLDS):
        inside = block != k
        for j, a in enumerate((low, high)):
            miss = signal[~inside] - a[~inside] @ _ridge(a[inside], signal[inside])
            left[j] += float(miss @ miss)
    return 1.0 - float(left[1] / left[0]) if left[0] > 0 else 0.0


def _ridge(a: Array, y: Array) -> Array:
    product = a.T @ a
    product[np.diag_indices_from(product)] += RIDGE * np.trace(product) / a.shape[1]
    return np.asarray(np.linalg.solve(product, a.T @ y))


def _simplest(explained: Mapping[str, float]) -> str:
    order = ("argument", "rate", "time", "slow", "memory", "product")
    best = max(order, key=lambda n: explained[n])
    if explained[best] < LEAST:
        return "nothing"
    return next(n for n in order if explained[n] > explained[best] - CLEARLY)


def _symmetry(past: PortHistory, variable: str, signal: Array) -> tuple[float, float]:
    """Shares of the mean curve over argument or rate that change sign with it, and that do not.

    About zero, or about the middle of a range that hardly reaches zero.
    """
    z = past.rate if variable == "rate" else past.argument
    middle = 0.5 * float(z.max() + z.min())
    z = z if abs(middle) < 0.25 * float(np.ptp(z)) else z - middle
    reach = min(float(z.max()), float(-z.min())) or 1.0
    inside = np.abs(z) <= reach
    cell = np.minimum(((z[inside] / reach + 1) * CELLS).astype(int), 2 * CELLS - 1)
    count = np.bincount(cell, minlength=2 * CELLS)
    curve = np.bincount(cell, signal[inside], 2 * CELLS) / np.maximum(count, 1)
    weight = np.minimum(count, count[::-1]).astype(float)
    at = (np.arange(2 * CELLS) + 0.5) / CELLS - 1
    odd, even = 0.5 * (curve - curve[::-1]), 0.5 * (curve + curve[::-1])
    total = float(weight.sum()) or 1.0
    odd = odd - at * float(weight @ (odd * at)) / (float(weight @ at**2) or 1.0)
    even = even - float(weight @ even) / total
    sizes = [float(weight @ part**2) for part in (odd, even)]
    whole = sum(sizes) or 1.0
    return sizes[0] / whole, sizes[1] / whole


def _jump(groups: Mapping[str, Array], past: PortHistory, signal: Array, *, flow: bool) -> float:
    """Coefficient of the speed's sign beside smooth functions of argument and rate.

    Zero where it foretells next to nothing on blocks left out of the fit: then it bends for others.
    """
    sign = groups["sign"][:, :1] if flow else groups["reversal"]
    names = ("linear", "odd", "even", "rate", "rate_odd")
    if held_out({**groups, "turns": sign}, names, ("turns",), signal) < CLEARLY:
        return 0.0
    a = np.concatenate([*(groups[g] for g in names), sign], axis=1)
    return abs(2 * float(_ridge(a, signal)[-1])) / (float(np.ptp(signal)) or 1.0)


def _plateau(past: PortHistory, signal: Array) -> float:
    """Slope of the whole output near the ends of the range over the slope in the middle."""
    x = (past.argument - past.centre) / past.half
    whole = past.output + signal
    slopes = []
    for inside in (np.abs(x) < 0.4, np.abs(x) > 0.75):
        found = [
            float(np.polyfit(x[part], whole[part], 1)[0])
            for part in (inside & (x > 0), inside & (x < 0))
            if part.sum() > 10 and np.ptp(x[part]) > 1e-6
        ]
        slopes.append(float(np.mean(found)) if found else float("nan"))
    if not np.isfinite(slopes).all() or slopes[0] == 0:
        return 1.0
    return slopes[1] / slopes[0]


def _dwell(past: PortHistory, signal: Array, shortest: int = 40) -> float | None:
    """Drift of the signal in the later part of rests, along the change that led to the rest."""
    still = np.abs(past.rate) < 2e-3 * (float(np.abs(past.rate).max()) or 1.0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    drifts = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        length = end - begin
        if length < shortest or begin < length // 4:
            continue
        move = past.argument[begin] - past.argument[max(0, begin - length)]
        head = np.mean(signal[begin + length // 10 : begin + length // 5])
        tail = np.mean(signal[end - length // 10 : end])
        if move:
            drifts.append(float(np.sign(move) * (tail - head)))
    return float(np.mean(drifts)) / (float(np.ptp(signal)) or 1.0) if drifts else None
