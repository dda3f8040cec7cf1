"""What the fitted numbers say: at a bound, not determined, trading off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bondgraph.signals.units import same_dimension
from identification.report.numbers import quantity, within
from identification.report.words import listed
from identification.uncertainty.well_known import well_known
from identification.validation.remark import Remark, fault, fine, note
from identification.validation.validation_data import Number, ValidationData


def parameter_remarks(m: ValidationData) -> list[Remark]:
    """Return remarks on bounds, undetermined values, nuisances at their limit and trade-offs."""
    found = [*_values(m), *_together(m), *_pairs(m)]
    if m.numbers and not found:
        found = [fine("every parameter is determined, none at a bound")]
    return found


def _values(m: ValidationData) -> Iterator[Remark]:
    for n in m.numbers:
        if n.at_bound:
            yield fault(
                f"{n.name} = {quantity(n.value, n.unit)} lies at its bound",
                f"widen the bound of {n.name} if physics allows, else fix it",
            )
        elif is_wide(n) and not n.only:
            yield fault(
                f"the data do not determine {n.name}: its interval is as wide as its value",
                f"fix {n.name}, give it a prior, or record what excites it",
            )
    for n in m.nuisances:
        if n.at_bound:
            yield fault(
                f"the {n.name}, fitted beside the parameters, lies at its bound, "
                f"{quantity(n.value, n.unit)}",
                "it stands for more than the measuring chain: declare a delay, an offset or a "
                "law in the model",
            )


def _together(m: ValidationData) -> Iterator[Remark]:
    for t in m.tied:
        yield fault(
            f"the recording tells {t.words}; the fit picked one of the values that each may have",
            f"use the combination, fix {listed(t.names[: t.missing])}, or add a sensor",
        )


def is_wide(n: Number) -> bool:
    """Whether an interval is so wide that nothing is known of the value."""
    low, high = n.ci95
    return not np.isfinite([low, high]).all() or high - low > 2 * abs(n.value)


def _pairs(m: ValidationData) -> Iterator[Remark]:
    size = len(m.numbers)
    if m.correlation.shape != (size, size):
        return
    for i, j in zip(*np.tril_indices(size, -1), strict=True):
        rho, a, b = float(m.correlation[i, j]), m.numbers[i], m.numbers[j]
        if well_known(*a.ci95) and well_known(*b.ci95):
            continue
        if abs(rho) > 0.99 and not (a.only and b.only):
            yield note(
                f"{b.name} and {a.name} trade off (correlation {rho:.4f}): {_traded(a, b, rho)}",
                "fix one, or record something that moves them apart",
                (b.name, a.name),
            )


def _traded(a: Number, b: Number, rho: float) -> str:
    """Say how far one follows the other, and how well both together are known."""
    together = _combined(a, b, rho)
    one, other = _width(a), _width(b)
    if one is None or other is None:
        return f"the data determine {together} better than either"
    more = 100.0 * (1.1 ** (abs(rho) * one / other) - 1.0)
    said = (
        f"with {b.name} 10 % larger and {a.name} {more:.2g} % {'larger' if rho > 0 else 'smaller'} "
        "the readings are nearly the same"
    )
    both = float(np.sqrt(max(one**2 + other**2 - 2.0 * abs(rho) * one * other, 0.0)))
    if both > 0.5 * min(one, other):
        return said
    return (
        f"{said}; {together} is known to {within(both)}, {b.name} alone to {within(other)}, "
        f"{a.name} to {within(one)}"
    )


def _width(n: Number) -> float | None:
    """Return half the interval of a positive number in logarithms; None if it has none."""
    low, high = n.ci95
    return float(np.log(high / low)) / 2.0 if 0.0 < low < high < np.inf else None


def _combined(a: Number, b: Number, rho: float) -> str:
    if a.value > 0 and b.value > 0:
        return "their ratio" if rho > 0 else "their product"
    if not same_dimension(a.unit or "1", b.unit or "1"):
        return "one combination of the two"
    return "their difference" if rho > 0 else "their sum"
