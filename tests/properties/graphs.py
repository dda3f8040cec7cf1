"""Random graphs, and a brute-force solve of every element and junction equation.

The brute force knows bonds, laws and half arrows only: no causality, no order, no elimination.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from bondgraph import GY, TF, BondGraph, C, I, One, R, Se, Sf, Zero
from bondgraph.graph.elements import Junction


def random_graph(seed: int, largest: int = 60, loops: bool = True) -> BondGraph:
    """Return a well-formed graph of up to `largest` elements, with loops of bonds if wanted.

    Half arrows point either way at one-ports; storages sit where they are free, and where not.
    """
    rng = np.random.default_rng(seed)

    def number() -> float:
        return float(np.round(np.exp(rng.uniform(-1.5, 1.5)), 3))

    size = int(rng.integers(4, largest + 1))
    with BondGraph(f"random_{seed}") as g:
        junctions: list[Any] = [(One if rng.random() < 0.5 else Zero)("j_0")]
        while len(g.elements) < 0.6 * size:
            n = len(junctions)
            old = junctions[rng.integers(n)]
            other = Zero if isinstance(old, One) else One
            new = (other if rng.random() < 0.7 else type(old))(f"j_{n}")
            chain = [old, new]
            middle = rng.choice(["none", "tf", "gy"], p=[0.6, 0.2, 0.2])
            if middle != "none":
                chain.insert(1, (TF if middle == "tf" else GY)(f"n_{n}", ratio=number()))
            if rng.random() < 0.5:
                chain.reverse()
            for a, b in pairwise(chain):
                a >> b
            junctions.append(new)
        if loops and len(junctions) > 3:
            for k in range(int(rng.integers(0, 3))):
                a, b = rng.choice(len(junctions), 2, replace=False)
                first, second = junctions[a], junctions[b]
                two_port = (TF if rng.random() < 0.5 else GY)(f"l_{k}", ratio=number())
                first >> two_port
                two_port >> second
        root = junctions[rng.integers(len(junctions))]
        (Se if isinstance(root, One) else Sf)("u") >> root
        for n, j in enumerate(junctions):
            if len(g.elements) >= size and len(g.bonds_of(j.name)) >= 2:
                continue
            one = isinstance(j, One)
            store, rare = (I, C) if one else (C, I)
            added: list[Any] = []
            if rng.random() < 0.75:
                added.append(store(f"s_{n}", number()))
            if rng.random() < 0.3:
                added.append(rare(f"t_{n}", number()))
            if rng.random() < 0.6 or len(g.bonds_of(j.name)) + len(added) < 2:
                added.append(R(f"r_{n}", number()))
            for e in added:
                _ = e >> j if rng.random() < 0.2 else j >> e
    return g


def pencil(g: BondGraph) -> tuple[np.ndarray, np.ndarray, np.ndarray, dict[str, int]]:
    """Return E, A, b of ``E z' = A z + b u`` in the efforts, flows and stored quantities z.

    The map gives the position of ``e_<tail>><head>``, ``f_...`` and ``q_``/``p_`` of stores.
    """
    at: dict[str, int] = {}
    for bond in g.bonds:
        at[f"e_{bond.name}"] = len(at)
        at[f"f_{bond.name}"] = len(at)
    for e in g.of_type(C, I):
        at[f"{'q' if isinstance(e, C) else 'p'}_{e.name}"] = len(at)
    rows_e, rows_a, rows_b = [], [], []

    def row(terms: dict[str, float], rate: str | None = None, source: float = 0.0) -> None:
        left, right = np.zeros(len(at)), np.zeros(len(at))
        if rate is not None:
            left[at[rate]] = 1.0
        for k, v in terms.items():
            right[at[k]] += v
        rows_e.append(left)
        rows_a.append(right)
        rows_b.append(source)

    for e in g.elements.values():
        bonds = g.bonds_of(e.name)
        if isinstance(e, Junction):
            common, summed = ("e", "f") if isinstance(e, Zero) else ("f", "e")
            for a, b in pairwise(bonds):
                row({f"{common}_{a.name}": 1.0, f"{common}_{b.name}": -1.0})
            total: dict[str, float] = {}
            for b in bonds:
                total[f"{summed}_{b.name}"] = 1.0 if b.head == e.name else -1.0
            row(total)
            continue
        if isinstance(e, TF | GY):
            (into,) = (b for b in bonds if b.head == e.name)
            (out,) = (b for b in bonds if b.tail == e.name)
            n = float(e.ratio)
            if isinstance(e, TF):
                row({f"e_{into.name}": 1.0, f"e_{out.name}": -n})
                row({f"f_{out.name}": 1.0, f"f_{into.name}": -n})
            else:
                row({f"e_{into.name}": 1.0, f"f_{out.name}": -n})
                row({f"e_{out.name}": 1.0, f"f_{into.name}": -n})
            continue
        (b,) = bonds
        effort, flow = f"e_{b.name}", f"f_{b.name}"
        inward = 1.0 if b.head == e.name else -1.0
        if isinstance(e, Se | Sf):
            row({effort if isinstance(e, Se) else flow: -1.0}, source=1.0)
        elif isinstance(e, R):
            row({effort: 1.0, flow: -inward * float(e.value or 0.0)})
        elif isinstance(e, C):
            row({effort: float(e.value or 0.0), f"q_{e.name}": -1.0})
            row({flow: inward}, rate=f"q_{e.name}")
        elif isinstance(e, I):
            row({flow: inward * float(e.value or 0.0), f"p_{e.name}": -1.0})
            row({effort: 1.0}, rate=f"p_{e.name}")
    return np.array(rows_e), np.array(rows_a), np.array(rows_b), at


def degree(e: np.ndarray, a: np.ndarray) -> int | None:
    """Return the degree of ``det(s E - A)``; None if the determinant vanishes identically."""
    rng = np.random.default_rng(0)
    for s in rng.uniform(0.5, 2.0, 2) + 1j * rng.uniform(0.5, 2.0, 2):
        m = s * e - a
        scale = np.abs(m).max(axis=1)
        if np.linalg.cond(m / scale[:, None]) > 1e13:
            return None
    first, second = (np.linalg.slogdet(s * e - a)[1] for s in (1e5j, 1e6j))
    return round(float((second - first) / np.log(10.0)))
