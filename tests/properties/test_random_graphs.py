"""Random trees of junctions against a brute-force solve of every element and junction equation."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import (
    GY,
    TF,
    AlgebraicLoop,
    BondGraph,
    C,
    DerivativeCausality,
    I,
    One,
    R,
    Se,
    Sf,
    Zero,
)
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.simulation.lure import compile_model

quick = settings(max_examples=25, deadline=None, derandomize=True, database=None)
seeds = st.integers(0, 2**32 - 1)
REFUSALS = (AlgebraicLoop, DerivativeCausality)


def random_graph(seed: int) -> BondGraph:
    """Return a sound tree with one source; stores mostly, not always, where they are free."""
    rng = np.random.default_rng(seed)

    def number() -> float:
        return float(np.exp(rng.uniform(-1.5, 1.5)))

    with BondGraph(f"random_{seed}") as g:
        junctions: list[Any] = [(One if rng.random() < 0.5 else Zero)("j_0")]
        for n in range(1, int(rng.integers(1, 6))):
            old = junctions[rng.integers(len(junctions))]
            other = Zero if isinstance(old, One) else One
            kind = other if rng.random() < 0.7 else type(old)
            middle = rng.choice(["none", "tf", "gy"], p=[0.5, 0.25, 0.25])
            new = kind(f"j_{n}")
            chain = [old, new]
            if middle != "none":
                chain.insert(1, (TF if middle == "tf" else GY)(f"n_{n}", ratio=number()))
            if rng.random() < 0.5:
                chain.reverse()
            for a, b in pairwise(chain):
                a >> b
            junctions.append(new)
        root = junctions[rng.integers(len(junctions))]
        (Se if isinstance(root, One) else Sf)("u") >> root
        for n, j in enumerate(junctions):
            one = isinstance(j, One)
            store, rare = (I, C) if one else (C, I)
            if rng.random() < 0.85:
                j >> store(f"s_{n}", number())
            if rng.random() < 0.35:
                j >> rare(f"t_{n}", number())
            if rng.random() < 0.6 or len(g.bonds_of(j.name)) < 2:
                j >> R(f"r_{n}", number())
    return g


def value(e: Any) -> float:
    return float(e.ratio if isinstance(e, TF | GY) else e.value)


def brute_force(g: Any, known: Any) -> Any:
    """Solve all equations for the efforts and flows of all bonds.

    `known` maps an element to a row ``a e + b f = c`` in its place.
    """
    bonds = list(g.bonds)
    n = len(bonds)
    rows, right = [], []

    def row(terms: Any, value: complex = 0.0) -> None:
        v = np.zeros(2 * n, complex)
        for position, factor in terms:
            v[position] += factor
        rows.append(v)
        right.append(value)

    for e in g.elements.values():
        at = [i for i, b in enumerate(bonds) if e.name in (b.tail, b.head)]
        if isinstance(e, One | Zero):
            shared, summed = (n, 0) if isinstance(e, One) else (0, n)
            for i in at[1:]:
                row([(shared + i, 1.0), (shared + at[0], -1.0)])
            row([(summed + i, 1.0 if bonds[i].head == e.name else -1.0) for i in at])
        elif isinstance(e, TF | GY):
            (i,) = (k for k in at if bonds[k].head == e.name)
            (o,) = (k for k in at if bonds[k].tail == e.name)
            ratio = value(e)
            if isinstance(e, TF):
                row([(i, 1.0), (o, -ratio)])
                row([(n + o, 1.0), (n + i, -ratio)])
            else:
                row([(i, 1.0), (n + o, -ratio)])
                row([(o, 1.0), (n + i, -ratio)])
        else:
            a, b, c = known(e)
            row([(at[0], a), (n + at[0], b)], c)
    x = np.linalg.solve(np.array(rows), np.array(right))
    found = {}
    for i, b in enumerate(bonds):
        for end in (b.tail, b.head):
            if g[end].n_ports == 1:
                found[end] = (x[i], x[n + i])
    return found


def at_frequency(s: complex) -> Any:
    def known(e: Any) -> Any:
        if isinstance(e, Se):
            return 1.0, 0.0, 1.0
        if isinstance(e, Sf):
            return 0.0, 1.0, 1.0
        if isinstance(e, R):
            return 1.0, -value(e), 0.0
        return (s * value(e), -1.0, 0.0) if isinstance(e, C) else (-1.0, s * value(e), 0.0)

    return known


def at_state(x: dict[str, float], u: float) -> Any:
    def known(e: Any) -> Any:
        if isinstance(e, Se | Sf):
            return (1.0, 0.0, u) if isinstance(e, Se) else (0.0, 1.0, u)
        if isinstance(e, R):
            return 1.0, -value(e), 0.0
        output = x[e.name] / value(e)
        return (1.0, 0.0, output) if isinstance(e, C) else (0.0, 1.0, output)

    return known


def port_signals(g: BondGraph) -> dict[str, tuple[str, str]]:
    """Names of the effort and the flow at every one-port element."""
    names = SignalNames(g)
    ports = (e.name for e in g.elements.values() if e.n_ports == 1)
    return {n: names.pair(*g.bonds_of(n)) for n in ports}


def numbers(g: BondGraph) -> Any:
    """Matrices A, B, C, D of the derived model; outputs are all port signals it has."""
    model = compile_model(g)
    available = set(model.model.index)
    ports = port_signals(g)
    observed = tuple(dict.fromkeys(n for pair in ports.values() for n in pair if n in available))
    model = replace(model, observed=observed)
    block = model.matrices(model.nominal()).full()
    n = model.n_x
    return model.model, ports, observed, block[:n, :n], block[:n, n:], block[n:, :n], block[n:, n:]


def derived(seed: int) -> Any:
    g = random_graph(seed)
    assert g.check() == ()
    try:
        return g, numbers(g)
    except REFUSALS as error:
        refusal = str(error)
    assert any(re.search(rf"\b{n}\b", refusal) for n in g.elements if n != "u"), refusal
    return g, None


def transfer(matrices: Any, s: complex) -> Any:
    a, b, c, d = matrices
    return (c @ np.linalg.solve(s * np.eye(len(a)) - a, b) + d)[:, 0]


def test_most_trees_are_derived() -> None:
    """The properties below would be empty if everything were refused."""
    made = [derived(seed)[1] for seed in range(60)]
    assert sum(m is not None for m in made) > 25
    dependent = [m for m in made if m is not None and m[0].causality.derivative]
    assert dependent
    assert max(len(random_graph(seed).elements) for seed in range(60)) > 18


@quick
@given(seed=seeds)
def test_every_signal_has_the_brute_force_response(seed: int) -> None:
    """At complex frequencies, dependent stores included: state coordinates do not matter."""
    g, made = derived(seed)
    if made is None:
        return
    _, ports, observed, a, b, c, d = made
    for s in (0.7 + 1.3j, 0.05 + 4.1j):
        ours = dict(zip(observed, transfer((a, b, c, d), s), strict=True))
        exact = brute_force(g, at_frequency(s))
        for element, (effort, flow) in ports.items():
            for name, value in zip((effort, flow), exact[element], strict=True):
                if name in ours:
                    assert ours[name] == pytest.approx(value, rel=1e-8, abs=1e-9), name


@quick
@given(seed=seeds)
def test_a_and_b_equal_the_brute_force(seed: int) -> None:
    g, made = derived(seed)
    if made is None or made[0].causality.derivative:
        return
    model, _, _, a, b, _, _ = made
    stores = [s.element for s in model.stored]
    for column in range(len(stores) + 1):
        x = {n: float(i == column) for i, n in enumerate(stores)}
        exact = brute_force(g, at_state(x, float(column == len(stores))))
        rates = [exact[n][1] if isinstance(g[n], C) else exact[n][0] for n in stores]
        ours = a[:, column] if column < len(stores) else b[:, 0]
        np.testing.assert_allclose(ours, np.real(rates), rtol=1e-9, atol=1e-10)


@quick
@given(seed=seeds)
def test_energy_rate_is_input_power_less_dissipation(seed: int) -> None:
    g, made = derived(seed)
    if made is None or made[0].causality.derivative:
        return
    model, ports, observed, a, b, c, d = made
    rng = np.random.default_rng(seed)
    x, u = rng.normal(size=len(a)), rng.normal(size=1)
    gradient = np.array([v / g[s.element].value for v, s in zip(x, model.stored, strict=True)])
    signal = dict(zip(observed, c @ x + d @ u, strict=True))
    power = signal[ports["u"][0]] * signal[ports["u"][1]]
    heat = [signal[ports[e.name][0]] * signal[ports[e.name][1]] for e in g.of_type(R)]
    assert all(h >= -1e-12 for h in heat)
    assert gradient @ (a @ x + b @ u) == pytest.approx(power - sum(heat), rel=1e-9, abs=1e-9)


def shuffled(g: BondGraph, seed: int) -> tuple[BondGraph, dict[str, str]]:
    """Return the same system with other names, declared in another order."""
    rng = np.random.default_rng(seed)
    names = list(g.elements)
    new = {n: f"e{k}" for n, k in zip(names, rng.permutation(len(names)), strict=True)}
    h = BondGraph(g.name)
    for i in rng.permutation(len(names)):
        h.add(replace(g[names[i]], name=new[names[i]]))
    for i in rng.permutation(len(g.bonds)):
        b = g.bonds[i]
        h.bond(h[new[b.tail]], h[new[b.head]])
    return h, new


@quick
@given(seed=seeds)
def test_order_and_names_do_not_matter(seed: int) -> None:
    g, made = derived(seed)
    if made is None:
        return
    h, new = shuffled(g, seed)
    try:
        other = numbers(h)
    except REFUSALS:
        assert made[0].causality.derivative or made[0].causality.free_choices
        return
    first: Any = made[3:]
    second: Any = other[3:]
    if not made[0].causality.derivative:
        ours, theirs = (np.sort_complex(np.linalg.eigvals(m[0])) for m in (first, second))
        scale = max(1.0, np.abs(ours).max(initial=0))
        gap = np.abs(np.poly(ours) - np.poly(theirs)) / scale ** np.arange(len(ours) + 1)
        assert gap.max() < 1e-9
    s = 0.4 + 0.9j
    a = dict(zip(made[2], transfer(first, s), strict=True))
    b = dict(zip(other[2], transfer(second, s), strict=True))
    for element, pair in made[1].items():
        for mine, yours in zip(pair, other[1][new[element]], strict=True):
            if mine in a and yours in b:
                assert a[mine] == pytest.approx(b[yours], rel=1e-8, abs=1e-9)
