"""Which combinations of parameters are determined, as short monomials or sums.

A flat direction is a vector that the sensitivities do not see. A combination ``sum a_i theta_i``
is determined if it is at right angles to every flat direction. In logarithmic coordinates an
integer `a` is a monomial, such as ``k/m``; in the parameters themselves it is a sum, such as
``R_1 + R_2``; in reciprocals ``1/k_1 + 1/k_2``. The flat directions fall into blocks that do not
touch (components of the matroid of the null space); in each block the sparsest independent integer
vectors are taken by the greedy rule, which is optimal on a matroid (Edmonds, Math. Programming 1
(1971) 127). A combination is only given if it holds at every point where sensitivities are known;
a block without one is said to have none that is short.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bondgraph.signals.units import read_unit, same_dimension
from bondgraph.support.arrays import FloatArray
from identification.uncertainty.integer_vectors import HOLDS, integer_vectors

FORMS = ("product", "sum", "sum of reciprocals")
NULL = 1e-7


@dataclass(frozen=True, slots=True)
class Combination:
    """One determined combination.

    Attributes
    ----------
    form : {"product", "sum", "sum of reciprocals"}
    names : tuple of str
    weights : tuple of int
        Exponents of a product, factors of a sum; never 0.
    """

    form: str
    names: tuple[str, ...]
    weights: tuple[int, ...]

    def value(self, values: dict[str, float]) -> float:
        """Return its number at parameter values (SI)."""
        v = np.array([values[n] for n in self.names])
        w = np.array(self.weights, float)
        if self.form == "product":
            return float(np.prod(np.sign(v) ** w) * np.exp(np.sum(w * np.log(np.abs(v)))))
        return float(np.sum(w * v)) if self.form == "sum" else float(np.sum(w / v))

    def gradient(self, values: dict[str, float], slopes: dict[str, float]) -> dict[str, float]:
        """Return derivatives by theta (of the logarithm, for a product); `slopes` are dp/dtheta."""
        found = {}
        for n, w in zip(self.names, self.weights, strict=True):
            p = values[n]
            by = {"product": w / p, "sum": float(w)}.get(self.form, -w / p**2)
            found[n] = by * slopes[n]
        return found

    def unit(self, units: Mapping[str, str]) -> str:
        """Return its SI unit; empty where one of the units is not known.

        Parameters
        ----------
        units : mapping of str to str
            Of the parameters; empty where none is declared.
        """
        own = [units[n] for n in self.names]
        if not all(own) or self.form == "sum":
            return own[0] if all(own) else ""
        weights = self.weights if self.form == "product" else (-1,)
        made = read_unit(monomial([f"({u})" for u in own[: len(weights)]], weights))
        if made is None:
            return ""
        return next((k for k in ("s", "1/s") if same_dimension(k, made.si)), made.si)

    def __str__(self) -> str:
        """Text such as ``T^2/k`` or ``R_1 + 2*R_2``."""
        if self.form == "product":
            return monomial(self.names, self.weights)
        made = ""
        for n, w in zip(self.names, self.weights, strict=True):
            size = abs(w)
            if self.form == "sum":
                term = n if size == 1 else f"{size}*{n}"
            else:
                term = f"{size}/{n}"
            made += (" - " if w < 0 else " + ") + term if made else ("-" if w < 0 else "") + term
        return made


@dataclass(frozen=True, eq=False)
class ToldAt:
    """A point of the parameters, and the one combination of a block that is told there.

    Attributes
    ----------
    values : dict of str to float
        All parameters, SI.
    slopes : ndarray, shape (n,)
        Its change by relative changes of the block's parameters; of any length.
    """

    values: dict[str, float]
    slopes: FloatArray


@dataclass(frozen=True, slots=True)
class FlatBlock:
    """Parameters that no data of this kind determine one by one.

    Attributes
    ----------
    names : tuple of str
        One name: a dead parameter.
    missing : int
        How many numbers are missing (dimension of the flat directions).
    determined : tuple of Combination
        Independent combinations that are determined; ``len(names) - missing`` if all were found.
    direction : tuple of tuple of float
        Flat directions in relative changes of `names`.
    at : tuple of ToldAt
        Where just one combination is determined: what it is at every point.
    """

    names: tuple[str, ...]
    missing: int
    determined: tuple[Combination, ...]
    direction: tuple[tuple[float, ...], ...] = ()
    at: tuple[ToldAt, ...] = field(default=(), compare=False)

    @property
    def complete(self) -> bool:
        """Whether every determined combination was found in a short form."""
        return len(self.determined) == len(self.names) - self.missing

    @property
    def dead(self) -> bool:
        """Whether this is one parameter that nothing depends on."""
        return len(self.names) == 1

    def __str__(self) -> str:
        """One line."""
        if self.dead:
            return f"{self.names[0]}: no output depends on it"
        head = f"{', '.join(self.names)} are not determined one by one"
        known = ", ".join(str(c) for c in self.determined)
        if self.complete:
            return f"{head}; determined: {known}" if known else head
        count = len(self.names) - self.missing
        return f"{head}; {count} combination{'s are' if count > 1 else ' is'}" + (
            f", {len(self.determined)} short: {known}" if known else ", none a short product or sum"
        )


def monomial(names: Sequence[str], exponents: Sequence[int]) -> str:
    """Return ``a^2*b/(c*d)``.

    Examples
    --------
    >>> monomial(("T", "k"), (2, -1))
    'T^2/k'
    """

    def power(n: str, e: int) -> str:
        return n if e == 1 else f"{n}^{e}"

    pairs = list(zip(names, exponents, strict=True))
    above = "*".join(power(n, e) for n, e in pairs if e > 0) or "1"
    below = [power(n, -e) for n, e in pairs if e < 0]
    if not below:
        return above
    return f"{above}/{below[0]}" if len(below) == 1 else f"{above}/({'*'.join(below)})"


def null_space(jacobian: FloatArray, tolerance: float = NULL) -> FloatArray:
    """Return a basis of what `jacobian` does not see, shape (n, n_null), columns scaled to unity.

    Columns are brought to unit length first, so that a weak parameter is not taken for a dead one.
    """
    j = np.asarray(jacobian, float)
    n = j.shape[1]
    length = np.linalg.norm(j, axis=0)
    live = length > 1e-12 * max(float(length.max(initial=0.0)), 1e-300)
    dead = np.eye(n)[:, ~live]
    if not live.any():
        return dead
    unit = j[:, live] / length[live]
    if unit.shape[0] > unit.shape[1]:
        unit = np.asarray(np.linalg.qr(unit, mode="r"))
    _, singular, rows = np.linalg.svd(unit, full_matrices=True)
    count = int((singular > tolerance * singular[0]).sum())
    basis = np.zeros((n, rows.shape[0] - count))
    basis[live] = rows[count:].T / length[live][:, None]
    basis /= np.maximum(np.abs(basis).max(axis=0, initial=0.0), 1e-300)
    return np.hstack([basis, dead])


def flat_blocks(
    names: Sequence[str],
    values: Sequence[FloatArray],
    nulls: Sequence[FloatArray],
    forms: Sequence[str] = FORMS,
    units: Sequence[str] = (),
) -> tuple[FlatBlock, ...]:
    """Return the blocks of flat directions, each with what it does determine.

    Parameters
    ----------
    names : sequence of str
        The n parameters.
    values : sequence of ndarray, shape (n,)
        Parameter values of each point, SI.
    nulls : sequence of ndarray, shape (n, n_null)
        Flat directions at each point, in relative changes ``dp / p`` (``dp`` where p is 0).
    forms : sequence of str
        Forms to try, in this order.
    units : sequence of str, optional
        Of the parameters: only those of one dimension are added. Without them all are of one.
    """
    units = units or ("1",) * len(names)
    basis = nulls[0]
    found = []
    for part in _components(basis):
        inside = [_within(null, part) for null in nulls]
        missing = inside[0].shape[1]
        own = tuple(names[i] for i in part)
        if len(part) == 1:
            found.append(FlatBlock(own, 1, (), ((1.0,),)))
            continue
        determined: tuple[Combination, ...] = ()
        at: tuple[ToldAt, ...] = ()
        if all(null.shape[1] == missing for null in inside):
            there = [v[part] for v in values]
            determined = _determined(own, there, inside, forms, [units[i] for i in part])
            if missing == len(part) - 1:
                at = tuple(
                    ToldAt(dict(zip(names, v.tolist(), strict=True)), _told_slopes(null))
                    for v, null in zip(values, inside, strict=True)
                )
        directions = tuple(tuple(map(float, d)) for d in inside[0].T)
        found.append(FlatBlock(own, missing, determined, directions, at))
    return tuple(found)


def _told_slopes(null: FloatArray) -> FloatArray:
    """Return the one direction at right angles to flat ones, in relative changes, shape (n,)."""
    size = np.abs(null).max(axis=1, keepdims=True).clip(1e-300)  # one may move far, one hardly
    u, _, _ = np.linalg.svd(null / size, full_matrices=True)
    return np.asarray(u[:, -1] / size[:, 0])


def _components(null: FloatArray) -> list[list[int]]:
    """Return groups of parameters tied by flat directions: components of the null's matroid."""
    form = _echelon(null.T)
    groups: list[set[int]] = []
    for row in form:
        touched = {int(i) for i in np.flatnonzero(np.abs(row) > HOLDS * np.abs(row).max())}
        for g in [g for g in groups if g & touched]:
            groups.remove(g)
            touched |= g
        groups.append(touched)
    return [sorted(g) for g in sorted(groups, key=min)]


def _echelon(rows: FloatArray) -> FloatArray:
    """Reduced echelon form with the largest entry of all as the next pivot."""
    a = np.array(rows, float)
    for i in range(a.shape[0]):
        r, c = divmod(int(np.abs(a[i:]).argmax()), a.shape[1])
        if abs(a[i + r, c]) < 1e-12:
            return a[:i]
        a[[i, i + r]] = a[[i + r, i]]
        a[i] /= a[i, c]
        others = np.arange(a.shape[0]) != i
        a[others] -= np.outer(a[others, c], a[i])
    return a


def _within(null: FloatArray, part: list[int]) -> FloatArray:
    """Return the flat directions of one block, shape (len(part), missing)."""
    u, s, _ = np.linalg.svd(null[part], full_matrices=False)
    return np.asarray(u[:, s > 1e-6 * max(float(s.max(initial=0.0)), 1e-300)])


def _coordinates(null: FloatArray, values: FloatArray, form: str) -> FloatArray:
    """Return flat directions in the coordinates of a form, from relative changes."""
    v = np.where(values == 0, 1.0, values)
    if form == "sum":
        null = null * v[:, None]
    elif form == "sum of reciprocals":
        null = null / v[:, None]
    q, _ = np.linalg.qr(null / np.abs(null).max(axis=1, keepdims=True).clip(1e-300))
    # rows are scaled for rounding only; the scale is taken back, so the coordinates stay
    return np.asarray(q * np.abs(null).max(axis=1, keepdims=True))


def _determined(
    names: Sequence[str],
    values: Sequence[FloatArray],
    nulls: Sequence[FloatArray],
    forms: Sequence[str],
    units: Sequence[str],
) -> tuple[Combination, ...]:
    """Return independent short combinations, the simplest first whatever their form."""
    n, missing = nulls[0].shape
    candidates: list[tuple[tuple[int, int, int], str, tuple[int, ...]]] = []
    for order, form in enumerate(forms):
        turned = [_coordinates(null, v, form) for null, v in zip(nulls, values, strict=True)]
        for c in integer_vectors(turned):
            if form != "product" and not _of_one_dimension(units, c):
                continue  # numbers that agree by accident, or by a known number of 1
            candidates.append(((sum(v != 0 for v in c), sum(map(abs, c)), order), form, c))
    chosen: list[tuple[str, tuple[int, ...]]] = []
    gradients = np.zeros((0, n))
    for _, form, c in sorted(candidates, key=lambda t: t[0]):
        if len(chosen) == n - missing:
            break
        gradient = np.array(c) * _slope(form, values[0])
        tried = np.vstack([gradients, gradient / np.linalg.norm(gradient)])
        if np.linalg.matrix_rank(tried, tol=1e-8) > len(chosen):
            chosen.append((form, c))
            gradients = tried
    return _named(names, chosen)


def _of_one_dimension(units: Sequence[str], weights: Sequence[int]) -> bool:
    first, *others = [u or "1" for u, w in zip(units, weights, strict=True) if w]
    return all(same_dimension(first, u) for u in others)


def _slope(form: str, values: FloatArray) -> FloatArray:
    """Return the derivative of each term of a form by a relative change, shape (n,)."""
    v = np.where(values == 0, 1.0, values)
    if form == "product":
        return np.ones(v.size)
    return v if form == "sum" else -1.0 / v


def _named(
    names: Sequence[str], chosen: Sequence[tuple[str, tuple[int, ...]]]
) -> tuple[Combination, ...]:
    """Turn signs so that a reader meets few fractions and the same denominators."""
    often = [sum(v[i] != 0 for f, v in chosen if f == "product") for i in range(len(names))]
    made = []
    for form, v in chosen:
        used = [i for i in range(len(v)) if v[i]]
        below = max(used, key=lambda i: (often[i], -i))
        wrong = v[below] > 0 if form == "product" else v[used[0]] < 0
        turn = -1 if sum(v) < 0 or (sum(v) == 0 and wrong) else 1
        weights = tuple(turn * v[i] for i in used)
        made.append(Combination(form, tuple(names[i] for i in used), weights))
    return tuple(made)
