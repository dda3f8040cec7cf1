"""Short integer vectors at right angles to given directions, sparsest supports first."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations, islice
from math import gcd, lcm

import numpy as np

from bondgraph.support.arrays import FloatArray

HOLDS = 1e-5
"""Largest share of a combination that may lie along a flat direction."""
LARGEST_EXPONENT = 6
MOST_SUBSETS = 20_000


def integer_vectors(nulls: Sequence[FloatArray]) -> list[tuple[int, ...]]:
    """Return short integer vectors of least support at right angles to all `nulls`."""
    n, missing = nulls[0].shape
    found: list[tuple[int, ...]] = []
    seen: list[frozenset[int]] = []
    subsets = (s for size in range(1, missing + 2) for s in combinations(range(n), size))
    for subset in islice(subsets, MOST_SUBSETS):
        if any(known <= set(subset) for known in seen):
            continue
        vector = _circuit(nulls[0], subset)
        if vector is None:
            continue
        seen.append(frozenset(subset))
        whole = _integers(vector)
        if whole is None:
            continue
        full = np.zeros(n)
        full[list(subset)] = whole
        if all(_holds(full, null) for null in nulls):
            found.append(tuple(int(v) for v in full))
    return found


def _circuit(null: FloatArray, subset: tuple[int, ...]) -> FloatArray | None:
    """Return the one vector on `subset` at right angles to `null`, if there is just one."""
    rows = null[list(subset)]
    size = np.linalg.norm(rows, axis=1)
    if (size == 0).any():
        return None
    _, s, v = np.linalg.svd((rows / size[:, None]).T, full_matrices=True)
    s = np.append(s, np.zeros(len(subset) - s.size))
    small = s < HOLDS * max(float(s[0]), 1e-300)
    if small.sum() != 1:
        return None
    vector = v[-1] / size
    return None if (np.abs(v[-1]) < 1e-6).any() else np.asarray(vector)


def _integers(vector: FloatArray) -> tuple[int, ...] | None:
    """Return the short integer vector along `vector`, or None."""
    scaled = vector / np.abs(vector).min()
    if np.abs(scaled).max() > LARGEST_EXPONENT * 2:
        return None
    parts = [Fraction(float(v)).limit_denominator(LARGEST_EXPONENT) for v in scaled]
    if any(abs(float(f) - v) > 1e-4 * abs(v) for f, v in zip(parts, scaled, strict=True)):
        return None
    whole = [int(f * lcm(*(f.denominator for f in parts))) for f in parts]
    common = gcd(*whole)
    whole = [w // common for w in whole]
    return tuple(whole) if max(map(abs, whole)) <= LARGEST_EXPONENT else None


def _holds(vector: FloatArray, null: FloatArray) -> bool:
    """Whether the terms of a combination cancel along every flat direction."""
    terms = np.abs(vector[:, None] * null)
    largest = np.abs(null).max(axis=0) * np.abs(vector).max()
    left = np.abs(vector @ null)
    return bool((left <= HOLDS * np.maximum(terms.max(axis=0), 1e-9 * largest)).all())
