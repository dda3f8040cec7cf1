"""Practical identifiability after a fit, in five classes with numbers.

A fit that ends on a flat valley picks some point of it and still reports success; these classes say
so. *Dead*: the readings hardly change with the parameter. *Flat direction*: several parameters may
move together unseen; the combination that is determined is given. *Trade-off pair*: two estimates
whose errors are correlated beyond 0.95. *Not pinned*: the 95 % interval is wider than a limit.
*At bound*: the estimate was stopped, with what the misfit would gain beyond the bound.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from math import gcd, log

import numpy as np
from numpy.typing import NDArray

from identification.uncertainty.combinations import Combination, FlatBlock, flat_blocks, null_space
from identification.uncertainty.information import Information, Sensitivities, information

__all__ = ["KINDS", "Limits", "Practical", "Statement", "practical"]

FloatArray = NDArray[np.float64]
KINDS = ("dead", "flat direction", "trade-off pair", "not pinned", "at bound")


@dataclass(frozen=True, slots=True)
class Limits:
    """When a class is given.

    Attributes
    ----------
    dead : float
        Total change of all readings, in noise, for a factor of ten (or one scale) of the parameter.
    correlation : float
    factor : float
        Widest 95 % interval of a pinned logarithmic parameter, as a factor either way.
    share : float
        Widest half interval of a pinned linear parameter, in its scale.
    """

    dead: float = 2.0
    correlation: float = 0.95
    factor: float = 1.5
    share: float = 0.5


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
        return f"{self.kind}: {self.text}"


@dataclass(frozen=True, eq=False)
class Practical:
    """What a fit determined.

    Attributes
    ----------
    information : Information
        Of the parameters that are neither dead nor at a bound.
    statements : tuple of Statement
    flat : tuple of FlatBlock
    pinned : tuple of str
        Parameters with a useful interval of their own.
    """

    information: Information
    statements: tuple[Statement, ...]
    flat: tuple[FlatBlock, ...]
    pinned: tuple[str, ...]

    def of(self, kind: str) -> tuple[Statement, ...]:
        """Return statements of one kind."""
        return tuple(s for s in self.statements if s.kind == kind)

    def __str__(self) -> str:
        """One line a statement."""
        head = f"determined one by one: {', '.join(self.pinned) or 'none'}"
        return "\n".join([head, *map(str, self.statements)])


def practical(
    sensitivities: Sensitivities,
    residual: FloatArray | None = None,
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    further: Sequence[Sensitivities] = (),
    prior: FloatArray | None = None,
    channels: Sequence[int] = (),
    variance: float = 1.0,
    limits: Limits | None = None,
) -> Practical:
    """Sort parameters into the classes.

    Parameters
    ----------
    sensitivities : Sensitivities
        At the fitted values; nuisances already eliminated.
    residual : ndarray, shape (M,), optional
        Weighted residuals, measured less simulated: sandwich covariance, and gain beyond bounds.
    bounds : mapping of str to (float, float), optional
        SI; a value within 1e-6 of a bound (relative) is at it.
    further : sequence of Sensitivities, optional
        At other values of the same parameters. A flat combination must hold there too; without
        them round values may let a sum look like a product.
    prior, channels, variance
        As in `information`.
    """
    limits = limits or Limits()
    stopped = _at_bounds(sensitivities, bounds or {})
    size = sensitivities.strength * np.where(sensitivities.log, log(10.0), 1.0) / np.sqrt(variance)
    known = prior if prior is not None else np.zeros(size.size)
    dead = [n for i, n in enumerate(sensitivities.names) if size[i] < limits.dead and not known[i]]
    kept = [n for n in sensitivities.names if n not in dead and n not in stopped]
    part = _restricted(sensitivities, kept)
    at = [sensitivities.names.index(n) for n in kept]
    info = information(part, residual, prior=known[at], channels=channels, variance=variance)
    blocks = _flat(part, [_restricted(s, kept) for s in further], known[at])
    statements = [_dead(n, sensitivities, float(size[sensitivities.index(n)])) for n in dead]
    statements += [_flat_words(b, info, part) for b in blocks]
    tied = {n for b in blocks for n in b.names}
    statements += _trade_offs(info, part, limits, tied)
    loose = [n for n in kept if n not in tied and _loose(info, part, n, limits)]
    statements += [_not_pinned(n, info, part) for n in loose]
    for n, side in stopped.items():
        statements.append(_bound_words(n, side, sensitivities, residual, bounds or {}, stopped))
    pinned = tuple(n for n in kept if n not in tied and n not in loose)
    return Practical(info, tuple(statements), tuple(blocks), pinned)


def _restricted(s: Sensitivities, names: Sequence[str]) -> Sensitivities:
    at = [s.index(n) for n in names]
    return replace(
        s,
        names=tuple(names),
        values=s.values[at],
        jacobian=s.jacobian[:, at],
        log=tuple(s.log[i] for i in at),
        scale=s.scale[at],
        units=tuple(s.units[i] for i in at),
    )


def _at_bounds(s: Sensitivities, bounds: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    found = {}
    for i, n in enumerate(s.names):
        low, high = bounds.get(n, (-np.inf, np.inf))
        near = 1e-6 * (abs(s.values[i]) if s.log[i] else s.scale[i])
        if s.values[i] - low <= near:
            found[n] = "lower"
        elif high - s.values[i] <= near:
            found[n] = "upper"
    return found


def _flat(
    part: Sensitivities, further: Sequence[Sensitivities], prior: FloatArray
) -> tuple[FlatBlock, ...]:
    """Return flat blocks in relative changes; what a prior holds is not flat."""
    points = [part, *further]
    nulls = []
    for s in points:
        rows = np.vstack([s.jacobian, np.diag(np.sqrt(prior))]) if prior.any() else s.jacobian
        relative = np.where(s.values == 0, 1.0, s.values)
        nulls.append(null_space(rows) * (s.slopes / relative)[:, None])
    if not part.names or not nulls[0].shape[1]:
        return ()
    return flat_blocks(part.names, [s.values for s in points], nulls)


def _dead(name: str, s: Sensitivities, size: float) -> Statement:
    if size == 0:
        return Statement("dead", (name,), 0.0, f"no reading depends on {name}; fix it")
    by = "ten times" if s.log[s.index(name)] else "one scale of"
    text = (
        f"{by} {name} moves all readings together by {size:.2g} standard deviations of the noise; "
        "fix it, or excite it more"
    )
    return Statement("dead", (name,), size, text)


def _flat_words(b: FlatBlock, info: Information, s: Sensitivities) -> Statement:
    values = dict(zip(s.names, s.values.tolist(), strict=True))
    known = [f"{c} = {_known(c, values, info, s)}" for c in b.determined]
    some = ", ".join(b.names[: b.missing])
    text = f"{', '.join(b.names)} may move together unseen ({b.missing} missing)"
    if known:
        text += f"; determined: {', '.join(known)}"
    if not b.complete:
        rest = len(b.names) - b.missing - len(b.determined)
        more = "more " if known else ""
        text += f"; {rest} {more}determined {_plural(rest)} no short product or sum"
    return Statement("flat direction", b.names, b.missing, f"{text}; fix {some}, or add a sensor")


def _plural(count: int) -> str:
    return "combination is" if count == 1 else "combinations are"


def _known(c: Combination, values: dict[str, float], info: Information, s: Sensitivities) -> str:
    slopes = dict(zip(s.names, s.slopes.tolist(), strict=True))
    gradient = c.gradient(values, slopes)
    error = info.error_of(np.array([gradient.get(n, 0.0) for n in s.names]))
    number = c.value(values)
    if c.form == "product":
        return f"{number:.4g} +- {196 * error:.2g} %"
    return f"{number:.4g} +- {1.96 * error:.2g}"


def _trade_offs(
    info: Information, s: Sensitivities, limits: Limits, tied: set[str]
) -> list[Statement]:
    rho = info.correlation
    found = []
    for i, j in combinations(range(len(s.names)), 2):
        if s.names[i] in tied or s.names[j] in tied or not abs(rho[i, j]) > limits.correlation:
            continue
        text = f"{s.names[i]} and {s.names[j]} have a correlation of {rho[i, j]:.4f}"
        if s.log[i] and s.log[j] and s.values[i] > 0 and s.values[j] > 0:
            c, error = _best_pair(i, j, info, s)
            each = ", ".join(
                f"{s.names[k]} to {196 * info.standard_errors[k]:.2g} %" for k in (i, j)
            )
            text += f"; {c} is known to {196 * error:.2g} %, {each}"
        found.append(Statement("trade-off pair", (s.names[i], s.names[j]), float(rho[i, j]), text))
    return found


def _best_pair(i: int, j: int, info: Information, s: Sensitivities) -> tuple[Combination, float]:
    """Return the product of two with small exponents that is known best, for its length."""
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
    return best[1], best[2]


def _half(info: Information, s: Sensitivities, name: str) -> float:
    return 1.96 * float(info.standard_errors[s.index(name)])


def _loose(info: Information, s: Sensitivities, name: str, limits: Limits) -> bool:
    widest = log(limits.factor) if s.log[s.index(name)] else limits.share
    return _half(info, s, name) > widest


def _not_pinned(name: str, info: Information, s: Sensitivities) -> Statement:
    i = s.index(name)
    low, high = info.interval(name)
    unit = f" {s.units[i]}" if s.units[i] else ""
    half = _half(info, s, name)
    text = f"{name} = {s.values[i]:.4g}{unit} lies anywhere from {low:.3g} to {high:.3g} (95 %)"
    return Statement("not pinned", (name,), half, text)


def _bound_words(
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
    text = f"{name} stopped at its {side} bound {bound:.4g}"
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
        f"the bound moved, the optimum is near {target:.3g}"
    )
    return Statement("at bound", (name,), gain, text)
