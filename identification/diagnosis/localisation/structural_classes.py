"""Which ports these sensors can tell apart, and which further signal would split a class.

A latent effort at a port reaches the sensors through one column of transfer functions. Ports
whose columns are parallel at every frequency explain any residual equally well: only the shape
of the law, not the residual alone, can separate them (Samantaray and Ould Bouamama, Model-based
Process Supervision, 2008, for the fault signature of bond graphs).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
from scipy.linalg import matrix_balance

from bondgraph.analysis.sensor_advice import unmeasured
from bondgraph.equations.derivation import equations
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Df, Sensor
from bondgraph.simulation.dynamics import dynamics_of
from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import exact_form
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput
from identification.diagnosis.screening.latent_input import probed_graph

PARALLEL = 1e-6


@dataclass(frozen=True)
class Isolability:
    """Isolability of the ports with the sensors at hand.

    Attributes
    ----------
    classes : tuple of tuple of str
        Elements that a residual alone cannot separate.
    """

    classes: tuple[tuple[str, ...], ...]

    def class_of(self, element: str) -> tuple[str, ...]:
        """Return the class that contains `element` (alone if unknown)."""
        for c in self.classes:
            if element in c:
                return c
        return (element,)


def structure(graph: BondGraph, frequencies: Array) -> Isolability:
    """Classes of ports of the linear part of `graph` over `frequencies` (rad/s)."""
    names, columns = latent_columns(graph, frequencies)
    same: nx.Graph = nx.Graph()
    same.add_nodes_from(names)
    for i, a in enumerate(names):
        for j in range(i):
            if _parallel(columns[:, :, i], columns[:, :, j]):
                same.add_edge(a, names[j])
    return Isolability(
        tuple(tuple(n for n in names if n in part) for part in nx.connected_components(same))
    )


def latent_columns(graph: BondGraph, frequencies: Array) -> tuple[list[str], Array]:
    """Transfer of a latent signal at each port, shape (n_f, n_y, n_ports).

    A latent effort at storages, resistors, inertias and the primary side of two-ports, an addition
    to the command of sources and to the reading of sensors.
    """
    probed = probed_graph(graph)
    a, b, c, d, inputs = linear_part(probed.graph)
    ports = [n for n, (source, _) in probed.ports.items() if source in inputs]
    sources = [s.name for s in graph.of_type(Source) if s.name in inputs]
    sensors = [s.name for s in graph.of_type(Sensor)]
    picked = [inputs.index(probed.ports[n][0]) for n in ports] + [inputs.index(n) for n in sources]
    out = np.zeros((frequencies.size, len(sensors), len(picked) + len(sensors)), complex)
    # charges and momenta differ by many decades: balance before solving
    balanced, (scale, order) = matrix_balance(a, separate=True)
    put = np.empty(a.shape[0], int)
    put[np.arange(a.shape[0])] = order
    # a source acts by its rate too, where the equations need it
    moved = [inputs.index(r) if (r := f"d_{inputs[k]}") in inputs else -1 for k in picked]
    b, d = (np.hstack([m, np.zeros((m.shape[0], 1))]) for m in (b, d))
    both = [b[put][:, k] / scale[:, None] if a.size else b[:, k] for k in (picked, moved)]
    reads = c[:, put] * scale[None, :] if a.size else c
    for f, w in enumerate(frequencies):
        left = 1j * w * np.eye(a.shape[0]) - balanced
        x = np.linalg.lstsq(left, both[0] + 1j * w * both[1], rcond=1e-15)[0]
        out[f, :, : len(picked)] = reads @ x + d[:, picked] + 1j * w * d[:, moved]
        out[f, :, len(picked) :] = np.eye(len(sensors))
    return [*ports, *sources, *sensors], out


def linear_part(graph: BondGraph) -> tuple[Array, Array, Array, Array, list[str]]:
    """Return A, B, C, D and the inputs, laws after them; of other models, linear about rest."""
    if (compiled := exact_form(graph)) is not None:
        parts = blocks(compiled, compiled.block(compiled.nominal()))
        return parts.a, parts.b, parts.cy, parts.dy, list(compiled.inputs)
    model = equations(graph)
    try:
        about = model.linearise()
    except UnusableInput:  # a law with memory or a jump: its linear slope counts, by numbers
        dynamics = dynamics_of(graph)
        near = dynamics.small_signal(dynamics.vector({}), np.zeros(len(dynamics.input_names)))
        return near.a, near.b, near.c, near.d, list(dynamics.input_names)
    values = {p.symbol: p.value for p in model.parameters.values()}
    matrices = [
        np.array(m.subs(values).tolist(), float).reshape(m.shape)
        for m in (about.a, about.b, about.c, about.d)
    ]
    return matrices[0], matrices[1], matrices[2], matrices[3], list(about.inputs)


def _parallel(a: Array, b: Array) -> bool:
    """Whether two columns point the same way at every frequency (each row is scaled first)."""
    size = np.sqrt(np.mean(np.abs(a) ** 2 + np.abs(b) ** 2, axis=0)) + 1e-300
    a, b = a / size, b / size
    na, nb = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
    seen = (na > 1e-9 * na.max(initial=0.0)) & (nb > 1e-9 * nb.max(initial=0.0))
    if not seen.any():
        return True
    cosine = np.abs(np.sum(a[seen].conj() * b[seen], axis=1)) / (na[seen] * nb[seen])
    return bool((cosine > 1 - PARALLEL).all())


def splitting_signals(
    graph: BondGraph, element: str, rivals: Sequence[str], frequencies: Array
) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """Further signals that separate `element` from `rivals`: (signal, place, separated)."""
    found = []
    for kind, junction in unmeasured(graph) if rivals else ():
        name = f"{'f' if kind is Df else 'e'}_{junction.name}"
        try:
            wider = graph.with_branch(junction.name, [kind(f"extra_{name}")])
            group = structure(wider, frequencies).class_of(element)
        except BondsightError:
            continue
        split = tuple(r for r in rivals if r not in group and r in graph.elements)
        if split:
            found.append((name, junction.name, split))
    at_source = {graph.neighbour(s.name) for s in graph.of_type(Source)}
    return tuple(sorted(found, key=lambda t: (-len(t[2]), t[1] not in at_source, t[0])))


def excited_frequencies(commands: Sequence[Array], dt: float, count: int = 24) -> Array:
    """Angular frequencies (rad/s) that carry most of the commands' power, low to high."""
    power = np.zeros(0)
    for u in commands:
        v = np.asarray(u) - np.mean(u)
        own = np.abs(np.fft.rfft(v * np.hanning(v.size))) ** 2
        power = power + own if power.size else own
    if power.size < 3 or not power[1:].any():
        return np.geomspace(1e-3, 1.0, count) * np.pi / dt
    order = np.sort(np.argsort(power[1:])[::-1][: 4 * count] + 1)
    picked = order[np.linspace(0, order.size - 1, min(count, order.size)).astype(int)]
    n = np.asarray(commands[0]).size
    return np.unique(picked) * 2 * np.pi / (n * dt)
