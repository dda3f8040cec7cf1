"""The sentences of the five classes, with their numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations, product
from math import gcd, log

import numpy as np

from bondgraph.signals.units import same_dimension
from bondgraph.support.arrays import FloatArray
from identification.report.numbers import quantity, within
from identification.uncertainty.combinations import Combination, FlatBlock
from identification.uncertainty.finding import PLAIN
from identification.uncertainty.information import Information, Sensitivities

KINDS = ("dead", "flat direction", "trade-off pair", "not pinned", "at bound")


@dataclass(frozen=True, slots=True)
class Statement:
    """One finding about parameters.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    names : tuple of str
    number : float
        Change in noise (dead), numbers missing (flat), correlation, relative half width of the
        interval (not pinned; infinite if open), or fall of the sum of squares (at bound).
    text : str
        One sentence.
    """

    kind: str
    names: tuple[str, ...]
    number: float
    text: str

    def __str__(self) -> str:
        """One line."""
        return f"{PLAIN.get(self.kind, self.kind)}: {self.text}"


def dead_words(name: str, s: Sensitivities, size: float) -> Statement:
    """Say that the readings hardly change with a parameter."""
    if size == 0:
        return Statement("dead", (name,), 0.0, f"no reading depends on {name}; fix it")
    by = "ten times" if s.log[s.index(name)] else "one scale of"
    text = (
        f"{by} {name} changes all readings together by no more than {size:.2g} standard deviations "
        "of their noise; fix it, or excite it more"
    )
    return Statement("dead", (name,), size, text)


def flat_words(b: FlatBlock, info: Information, s: Sensitivities) -> Statement:
    """Say what may move unseen, and what is determined instead."""
    values = dict(zip(s.names, s.values.tolist(), strict=True))
    known = [f"{c} = {_known(c, values, info, s)}" for c in b.determined]
    some = ", ".join(b.names[: b.missing])
    text = f"other values of {' and '.join(b.names)} together give the same readings"
    if known:
        text += f"; what the recording tells is {', '.join(known)}"
    if not b.complete:
        rest = len(b.names) - b.missing - len(b.determined)
        more = "more " if known else ""
        text += f"; {rest} {more}{_plural(rest)} told, no short product or sum"
    text += f"; hold {some} at a known value, or add a sensor"
    return Statement("flat direction", b.names, b.missing, text)


def _plural(count: int) -> str:
    return "combination is" if count == 1 else "combinations are"


def _known(c: Combination, values: dict[str, float], info: Information, s: Sensitivities) -> str:
    slopes = dict(zip(s.names, s.slopes.tolist(), strict=True))
    gradient = c.gradient(values, slopes)
    error = info.error_of(np.array([gradient.get(n, 0.0) for n in s.names]))
    unit = c.unit(dict(zip(s.names, s.units, strict=True)))
    if c.form == "product":
        return f"{quantity(c.value(values), unit)} ({within(1.96 * error)})"
    return f"{quantity(c.value(values), unit)} (±{quantity(1.96 * error, unit, 2)})"


def trade_offs(
    info: Information, s: Sensitivities, limit: float, tied: set[str]
) -> list[Statement]:
    """Return a statement for every pair correlated beyond `limit`, unless it is tied."""
    rho = info.correlation
    found = []
    for i, j in combinations(range(len(s.names)), 2):
        if s.names[i] in tied or s.names[j] in tied or not abs(rho[i, j]) > limit:
            continue
        text = (
            f"{s.names[i]} and {s.names[j]} go together (correlation {rho[i, j]:.4f}): a change of "
            "one is made up for by the other"
        )
        if s.log[i] and s.log[j] and s.values[i] > 0 and s.values[j] > 0:
            c, error = _best_pair(i, j, info, s)
            alone = [1.96 * float(info.standard_errors[k]) for k in (i, j)]
            # a combination says nothing to a reader unless much more is known of it
            if 1.96 * error < 0.5 * min(alone):
                value = c.value(dict(zip(s.names, s.values.tolist(), strict=True)))
                told = quantity(value, c.unit(dict(zip(s.names, s.units, strict=True))))
                text += f"; {c} is known to {within(1.96 * error)} ({told})"
            each = zip((s.names[i], s.names[j]), map(within, alone), strict=True)
            text += "; " + ", ".join(f"{n} alone to {width}" for n, width in each)
        found.append(Statement("trade-off pair", (s.names[i], s.names[j]), float(rho[i, j]), text))
    return found


def _best_pair(i: int, j: int, info: Information, s: Sensitivities) -> tuple[Combination, float]:
    """Return the combination of two that is known best for its length, with its relative error.

    That is a product with small exponents or, of two of one unit, their sum or that of their
    reciprocals: two dampers, or two springs behind one another.
    """
    best: tuple[float, Combination, float] | None = None
    for a, b in product((1, 2, 3), (-3, -2, -1, 1, 2, 3)):
        if gcd(a, b) > 1:
            continue
        direction = np.zeros(len(s.names))
        direction[[i, j]] = a, b
        error = info.error_of(direction)
        # long exponents must pay: the error counts per length of the vector
        score = error / np.hypot(a, b) * (1 + 0.5 * (a + abs(b) - 2))
        if best is None or score < best[0]:
            turned = (-a, -b) if a + b < 0 else (a, b)
            best = (score, Combination("product", (s.names[i], s.names[j]), turned), error)
    assert best is not None
    alike = s.units[i] and s.units[j] and same_dimension(s.units[i], s.units[j])
    for form in ("sum", "sum of reciprocals") if alike else ():
        shares = s.values[[i, j]] if form == "sum" else -1.0 / s.values[[i, j]]
        direction = np.zeros(len(s.names))
        direction[[i, j]] = shares / abs(shares.sum())
        error = info.error_of(direction)
        if (score := error / float(np.linalg.norm(direction))) < best[0]:
            best = (score, Combination(form, (s.names[i], s.names[j]), (1, 1)), error)
    return best[1], best[2]


def _half(info: Information, s: Sensitivities, name: str) -> float:
    return 1.96 * float(info.standard_errors[s.index(name)])


def is_loose(info: Information, s: Sensitivities, name: str, factor: float, share: float) -> bool:
    """Whether the 95 % interval is wider than a factor (logarithmic) or a share of the scale."""
    widest = log(factor) if s.log[s.index(name)] else share
    return _half(info, s, name) > widest


def not_pinned_words(name: str, info: Information, s: Sensitivities) -> Statement:
    """Say how wide the interval is."""
    i = s.index(name)
    low, high = info.interval(name)
    unit = f" {s.units[i]}" if s.units[i] else ""
    half = _half(info, s, name)
    text = (
        f"{name} = {s.values[i]:.4g}{unit} lies anywhere from {low:.3g} to {high:.3g}{unit} (95 %)"
    )
    return Statement("not pinned", (name,), half, text)


def bound_words(
    name: str,
    side: str,
    s: Sensitivities,
    residual: FloatArray | None,
    bounds: Mapping[str, tuple[float, float]],
    stopped: Mapping[str, str],
) -> Statement:
    """Say whether the data push outward, and what moving the bound would gain to first order."""
    i = s.index(name)
    bound = bounds[name][0 if side == "lower" else 1]
    unit = f" {s.units[i]}" if s.units[i] else ""
    text = f"{name} stopped at its {side} bound {bound:.4g}{unit}"
    if residual is None:
        return Statement("at bound", (name,), float("nan"), text)
    others = [k for k, n in enumerate(s.names) if n not in stopped]
    column = s.jacobian[:, i]
    q, _ = np.linalg.qr(s.jacobian[:, others])
    left = column - q @ (q.T @ column)
    size = float(left @ left)
    if size < 1e-12 * float(column @ column) or size == 0:
        return Statement("at bound", (name,), 0.0, f"{text}; the others make up for it: no loss")
    move = float(left @ residual) / size
    outward = move < 0 if side == "lower" else move > 0
    if not outward:
        return Statement("at bound", (name,), 0.0, f"{text}; the data do not push beyond it")
    gain = move**2 * size
    target = s.values[i] * np.exp(move) if s.log[i] else s.values[i] + move * s.scale[i]
    text += (
        f"; the sum of squares would fall by {gain:.3g} (of {float(residual @ residual):.4g}) if "
        f"the bound moved, the best value is near {target:.3g}{unit}"
    )
    return Statement("at bound", (name,), gain, text)
