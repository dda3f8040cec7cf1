"""Exact derivatives of the transfer behaviour of a linear graph by its parameters.

The transfer matrix ``C (s - A)^-1 B(s) + D(s)`` is fixed by its polynomial part and its first
2 n Markov parameters ``C A^j B``. They are rational functions of the parameters, evaluated with
exact rationals and reduced modulo P^2 for a large prime P. At ``p + P`` a rational function is
``f(p) + P f'(p)`` modulo P^2, so one more evaluation a parameter gives its exact derivative
modulo P: no rounding, and a rank that is right for almost all parameter values (Schwartz 1980).
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

from bondgraph.analysis.kalman import RATES, modular_matrices, product
from bondgraph.equations.derivation import equations
from bondgraph.equations.elimination import PRIME
from bondgraph.equations.system import System
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.simulation.start import own_input
from bondgraph.simulation.timing import named_delays
from bondgraph.support.errors import UnusableInput

SQUARE = PRIME * PRIME
Rows: TypeAlias = list[list[int]]


def random_integers(names: Sequence[str], seed: int) -> dict[str, int]:
    """Return reproducible distinct whole numbers, one a name: a generic point."""
    draw = random.Random(seed)
    return dict(zip(names, draw.sample(range(11, 50 + 90 * len(names)), len(names)), strict=True))


def transfer_jacobian(graph: BondGraph, free: Sequence[str], point: Mapping[str, int]) -> Rows:
    """Return relative derivatives ``p df/dp`` modulo the prime, one row a transfer coefficient.

    Parameters
    ----------
    graph : BondGraph
        Linear up to nothing: no laws, no modulation.
    free : sequence of str
        Parameters to differentiate by, declared delays and clocks included.
    point : mapping of str to int
        All parameters of the graph.

    Raises
    ------
    UnusableInput
        The graph is not linear, has constant inputs, or a coefficient is no rational function.
    """
    model = equations(graph)
    delays = named_delays(graph)
    own = [n for n in free if n in model.parameters and n not in delays.values()]
    constants = [u for u in model.inputs if own_input(u, 1) is not None]
    if constants:
        raise UnusableInput(f"{graph.name}: constant inputs ({', '.join(constants)}) set it off")
    base = _coefficients(model, point)
    columns: dict[str, list[int]] = {}
    for n in own:
        moved = _coefficients(model, {**point, n: point[n] + PRIME})
        differences = [(a - b) % SQUARE for a, b in zip(moved, base, strict=True)]
        if any(d % PRIME for d in differences):
            raise UnusableInput(f"{graph.name}: a coefficient is no rational function of {n}")
        columns[n] = [d // PRIME * point[n] % PRIME for d in differences]
    zero = [0] * len(base)
    rows = [list(r) for r in zip(*(columns.get(n, zero) for n in free), strict=True)]
    rows += _delay_rows(model, base, free, point, delays)
    return rows + _clock_rows(graph, model, base, free, point)


def _coefficients(model: System, point: Mapping[str, int]) -> list[int]:
    """Return polynomial part and Markov parameters modulo P^2, output by input by order."""
    if not model.stored:
        raise UnusableInput(f"{model.name} has no state; its gains are read off the equations")
    values = {n: Fraction(v) for n, v in point.items()}
    a, b, c, d = modular_matrices(model, values, list(model.inputs), SQUARE)
    n = len(a)
    found: list[int] = []
    for u in range(len(model.inputs)):
        # s (s - A)^-1 = 1 + A (s - A)^-1 takes input rates into B and the polynomial part
        column = [0] * n
        polynomial: Rows = []
        for direct, rates in zip(reversed(d), reversed(b), strict=True):
            seen = product(c, column, SQUARE)
            polynomial.append([(y[u] + s) % SQUARE for y, s in zip(direct, seen, strict=True)])
            moved = product(a, column, SQUARE)
            column = [(x + row[u]) % SQUARE for x, row in zip(moved, rates, strict=True)]
        markov: Rows = []
        for _ in range(2 * n):
            markov.append(product(c, column, SQUARE))
            column = product(a, column, SQUARE)
        for i in range(len(c)):
            found.extend(p[i] for p in (*polynomial, *markov))
    return found


def _delay_rows(
    model: System,
    base: Sequence[int],
    free: Sequence[str],
    point: Mapping[str, int],
    delays: Mapping[str, str],
) -> Rows:
    """Return one row for each input and output that see each other: their delays add up."""
    if not any(n in free for n in delays.values()):
        return []
    return [
        [point[n] * ((delays.get(u) == n) + (delays.get(y) == n)) for n in free]
        for u, y in _pairs(model, base)
    ]


def _clock_rows(
    graph: BondGraph,
    model: System,
    base: Sequence[int],
    free: Sequence[str],
    point: Mapping[str, int],
) -> Rows:
    """Return one row for each reading with a clock that sees an input: no delay grows with time."""
    seeing = {y for _, y in _pairs(model, base)}
    own = [m.clock for m in graph.of_type(Sensor) if m.clock in free and m.name in seeing]
    return [[point[n] * (n == clock) for n in free] for clock in own]


def _pairs(model: System, base: Sequence[int]) -> list[tuple[str, str]]:
    """Return the inputs and readings that see each other."""
    size = len(RATES) + 2 * model.order
    every = [(u, n) for u in model.inputs for n, _, _ in model.readings]
    return [
        pair
        for k, pair in enumerate(every)
        if any(v % PRIME for v in base[k * size : (k + 1) * size])
    ]


def reconstructed(residue: int) -> Fraction:
    """Return the rational number of least size with a residue modulo the prime.

    Wang, Guy and Davenport, SIGSAM Bulletin 16 (1982) 2.

    Examples
    --------
    >>> reconstructed(2 * pow(3, -1, PRIME) % PRIME)
    Fraction(2, 3)
    """
    limit = 1 << 30
    r0, r1, t0, t1 = PRIME, residue % PRIME, 0, 1
    while r1 > limit:
        q = r0 // r1
        r0, r1, t0, t1 = r1, r0 - q * r1, t1, t0 - q * t1
    return Fraction(r1, t1) if t1 else Fraction(0)
