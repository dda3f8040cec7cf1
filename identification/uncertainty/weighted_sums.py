"""What is told of parameters whose sum counts, each by a factor, such as ``b + d_g/lead^2``.

Where one combination of them is determined, its gradient says what it is. Parameters whose relative
slopes stand in one short ratio at every point form a product; products whose slopes over their
values stand in one ratio at every point are added, with that ratio as factor: a number, or a power
of a parameter that is known or determined by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np

from bondgraph.signals.units import same_dimension
from bondgraph.support.arrays import FloatArray
from identification.uncertainty.combinations import Combination, ToldAt

SAME = 1e-4
"""Relative difference of two numbers that are one."""
LARGEST = 3
"""Exponents of a product, and what they are over one another, at the most."""
POWERS = (-2, -1, 1, 2)
"""Powers of another parameter that a factor may be."""


@dataclass(frozen=True, slots=True)
class WeightedSum:
    """Products of parameters that are told as their sum.

    Attributes
    ----------
    terms : tuple of Combination
        Products; the first one has no factor.
    factors : tuple of float
    """

    terms: tuple[Combination, ...]
    factors: tuple[float, ...]
    form: str = "weighted sum"

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters in it, in order."""
        return tuple(dict.fromkeys(n for t in self.terms for n in t.names))

    def value(self, values: dict[str, float]) -> float:
        """Return its number at parameter values (SI)."""
        return sum(f * t.value(values) for f, t in zip(self.factors, self.terms, strict=True))

    def gradient(self, values: dict[str, float], slopes: dict[str, float]) -> dict[str, float]:
        """Return derivatives by theta; `slopes` are dp/dtheta, known numbers have none."""
        found: dict[str, float] = {}
        for f, t in zip(self.factors, self.terms, strict=True):
            size = f * t.value(values)
            for n, w in zip(t.names, t.weights, strict=True):
                found[n] = found.get(n, 0.0) + size * w / values[n] * slopes.get(n, 0.0)
        return found

    def unit(self, units: Mapping[str, str]) -> str:
        """Return its SI unit; empty where one of the units is not known."""
        return self.terms[0].unit(units)

    def __str__(self) -> str:
        """Text such as ``b + d_g/lead^2``."""
        said = (
            str(t) if f == 1.0 else f"{f:.4g}*{t}"
            for f, t in zip(self.factors, self.terms, strict=True)
        )
        return " + ".join(said).replace("+ -", "- ")


def weighted_sum(
    names: Sequence[str], points: Sequence[ToldAt], units: Mapping[str, str]
) -> WeightedSum | None:
    """Return the sum that is told of all `names`; None where they make none that is short.

    Parameters
    ----------
    names : sequence of str
        The block; `slopes` of the points are in its order.
    points : sequence of ToldAt
        At least two: round values look like anything at one.
    units : mapping of str to str
    """
    if len(points) < 2 or any((np.abs(p.slopes) < 1e-12).any() for p in points):
        return None
    products = _products(names, points)
    first, *others = sorted(products, key=lambda c: (len(c.names), names.index(c.names[0])))
    for begin in (first, _inverse(first)) if others else ():
        lead, unit = _over(begin, names, points), begin.unit(units)
        made = [(begin, 1.0)]
        for c in others:
            tried = (_factor(t, _over(t, names, points) / lead, points, units, unit, names)
                     for t in (c, _inverse(c)))  # fmt: skip
            if (found := next((t for t in tried if t is not None), None)) is None:
                break
            made.append(found)
        else:
            return WeightedSum(tuple(t for t, _ in made), tuple(f for _, f in made))
    return None


def _products(names: Sequence[str], points: Sequence[ToldAt]) -> list[Combination]:
    """Group names whose slopes stand in one short ratio everywhere."""
    slopes = np.array([p.slopes for p in points])
    groups: list[dict[int, Fraction]] = []
    for i in range(len(names)):
        for g in groups:
            ratio = slopes[:, i] / slopes[:, next(iter(g))]
            short = Fraction(float(ratio[0])).limit_denominator(LARGEST)
            if 0 < abs(short) <= LARGEST and (np.abs(ratio / float(short) - 1.0) <= SAME).all():
                g[i] = short
                break
        else:
            groups.append({i: Fraction(1)})
    return [_product(names, g) for g in groups]


def _product(names: Sequence[str], group: Mapping[int, Fraction]) -> Combination:
    whole = lcm(*(f.denominator for f in group.values()))
    return Combination(
        "product", tuple(names[i] for i in group), tuple(int(f * whole) for f in group.values())
    )


def _inverse(c: Combination) -> Combination:
    return Combination(c.form, c.names, tuple(-w for w in c.weights))


def _over(c: Combination, names: Sequence[str], points: Sequence[ToldAt]) -> FloatArray:
    """Slope of the told combination by a product of parameters, up to the length of the slopes."""
    i = names.index(c.names[0])
    return np.array([p.slopes[i] / (c.weights[0] * c.value(p.values)) for p in points])


def _factor(
    c: Combination, ratio: FloatArray, points: Sequence[ToldAt], units: Mapping[str, str],
    unit: str, names: Sequence[str],
) -> tuple[Combination, float] | None:  # fmt: skip
    """Return a product with its factor: none, a power of another parameter, or a number."""
    for more in _with_powers(c, points[0].values, names):
        by = np.array([more.value(p.values) / c.value(p.values) for p in points])
        fits = np.abs(np.abs(ratio / by) - 1.0).max() <= SAME
        own = more.unit(units)
        if fits and (not own or not unit or same_dimension(own, unit)):
            return more, float(np.sign(ratio[0] / by[0]))
    constant = np.ptp(ratio) <= SAME * abs(ratio[0])
    return (c, float(ratio[0])) if constant else None


def _with_powers(
    c: Combination, values: Mapping[str, float], names: Sequence[str]
) -> Iterator[Combination]:
    yield c
    for n, v in values.items():
        if n not in names and v > 0:
            for e in POWERS:
                yield Combination("product", (*c.names, n), (*c.weights, e))
