"""The energy ledger of a motion: what sources gave, stores keep, resistors lost; what is left over.

The remainder checks model, integrator and quadrature at once, because stored energies come from
the state and not from the integral of a power. Sizes: N samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.energy.accounts import EnergyEntry, Ledger
from bondgraph.energy.bond_power import motion
from bondgraph.energy.bond_values import SignalPath
from bondgraph.energy.stored import held, integral
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import (
    RE,
    RS,
    C,
    Element,
    Field,
    I,
    Junction,
    R,
    RField,
    Source,
    TwoPort,
)
from bondgraph.simulation.modes.resolve import in_mode
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.ops import FloatArray


def ledger(
    graph: BondGraph,
    trajectory: Trajectory,
    *,
    parameters: Mapping[str, float] | None = None,
    memory: Mapping[str, Sequence[float]] | None = None,
    hold: str | None = None,
    accuracy: float = 1e-4,
) -> Ledger:
    """Account for all energy of a motion.

    Efforts and flows follow exactly from states and inputs. Powers are integrated with their rates
    at both ends of every step, so that the residual of smooth laws falls with the fourth power of
    the step; of laws with corners (hysteresis, dry friction) with the second, because corners and
    turning points lie between samples.

    Parameters
    ----------
    trajectory : Trajectory
        With the signals of `observables`: of `simulate`, or made of any integrator's states.
    parameters : dict of str to float
        Values that differ from the declared ones.
    memory : dict of str to sequence of float
        Memory the simulation started from, by element; virgin where not given.
    hold : {"linear", "hold", "band-limited"}, optional
        What the inputs did between samples, as `Trajectory.hold` says when not given; the last
        for smooth inputs.
    accuracy : float
        The tolerance the integrator was given; reported, and used by `Ledger.closes`.

    Raises
    ------
    UnusableInput
        A state or an input is missing in the trajectory.

    Examples
    --------
    >>> import numpy as np
    >>> from bondgraph import BondGraph, C, One, R, Se, simulate
    >>> from bondgraph.energy.bond_power import observables
    >>> with BondGraph("rc") as g:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("R_1", 1.0)
    ...     _ = loop >> C("C_1", 1.0)
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> run = simulate(g, t, {"V": np.sin(t)}, observed=observables(g))
    >>> account = ledger(g, run)
    >>> account.closes, account.relative_residual < 1e-5
    (True, True)
    """
    run = motion(graph, trajectory, parameters, hold)
    graph = in_mode(graph)
    outside = _behind_heat(graph)
    entries = tuple(
        _entry(graph, e, run, memory or {}, e.name in outside)
        for e in graph.elements.values()
        if any(e.name in (b.tail, b.head) for b in run.bonds)
    )
    supplied, stored, lost, left = _sums(entries, run.time)
    residual = supplied - stored - lost - left
    counted = [e for e in entries if e.role in ("source", "store", "loss")]
    shares = [np.abs(e.power) for e in counted]
    throughput = 0.5 * float(integral(run.time, sum(shares, _zeros(run)))[-1])
    return Ledger(
        graph.name,
        run.time,
        run.bonds,
        entries,
        supplied,
        stored,
        lost,
        left,
        residual,
        throughput,
        _imbalance(graph, run),
        accuracy,
        _rough(entries, run, throughput),
    )


def _entry(
    graph: BondGraph,
    e: Element,
    run: SignalPath,
    memory: Mapping[str, Sequence[float]],
    outside: bool,
) -> EnergyEntry:
    power = _into(graph, e.name, run)
    work = _into(graph, e.name, run, work=True)
    nothing = _zeros(run)
    inside = held(graph, e, run, memory)
    role = "signal" if outside else _role(e)
    if role == "signal" or inside is None:
        lost = work if role == "loss" else nothing
        note = ""
        if isinstance(e, R) and e.law is not None and e.law.n_memory and role == "loss":
            note = "part may be held in its law"
        return EnergyEntry(e.name, e.kind, role, power, work, None, lost, note)
    return EnergyEntry(e.name, e.kind, role, power, work, inside.stored, inside.lost, inside.note)


def _role(e: Element) -> str:
    if isinstance(e, Source):
        return "source"
    if isinstance(e, R | RField | RE) or (isinstance(e, RS) and e.heat == "energy"):
        return "loss"
    if isinstance(e, Junction):
        return "junction"
    if isinstance(e, C | I | Field):
        return "store"
    return "two-port" if isinstance(e, TwoPort) else "signal"


def _into(graph: BondGraph, name: str, run: SignalPath, *, work: bool = False) -> FloatArray:
    total = _zeros(run)
    # the heat of the pseudo thermal domain is a flow, not a product
    heats = _role(graph[name]) == "loss" and isinstance(graph[name], RS)
    for b in run.bonds:
        if b.head == name:
            total = total + (b.work if work else b.power)
        elif b.tail == name and not heats:
            total = total - (b.work if work else b.power)
    return total


def _sums(
    entries: tuple[EnergyEntry, ...], time: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    supplied, stored, lost, left = (np.zeros_like(time) for _ in range(4))
    for e in entries:
        if e.role == "source":
            supplied = supplied - e.work
        if e.role in ("store", "loss"):
            lost, left = lost + e.lost, left + e.open
            if e.stored is not None:
                stored = stored + (e.stored - e.stored[0])
    return supplied, stored, lost, left


def _rough(entries: tuple[EnergyEntry, ...], run: SignalPath, throughput: float) -> float:
    """Estimate of the quadrature's error at sources and losses, relative."""
    counted = {e.element for e in entries if e.role in ("source", "loss") or np.any(e.open)}
    errors = [b.error for b in run.bonds if counted & {b.tail, b.head}]
    return float(np.linalg.norm(errors)) / throughput if throughput else 0.0


def _imbalance(graph: BondGraph, run: SignalPath) -> float:
    worst = 0.0
    for e in graph.of_type(Junction, TwoPort):
        if _role(e) == "loss":
            continue
        sizes = [float(np.abs(b.power).max()) for b in run.bonds if e.name in (b.tail, b.head)]
        size = max(sizes, default=0.0)
        if size > 0.0:
            worst = max(worst, float(np.abs(_into(graph, e.name, run)).max()) / size)
    return worst


def _behind_heat(graph: BondGraph) -> frozenset[str]:
    """Return the elements that an RS of the pseudo thermal domain heats."""
    pseudo = [e.name for e in graph.of_type(RS) if e.heat == "energy"]
    ahead = [b.head for n in pseudo for b in graph.bonds_of(n) if b.tail == n]
    if not ahead:
        return frozenset()
    import networkx as nx

    beside: nx.Graph = nx.Graph(graph.network)
    beside.remove_nodes_from(pseudo)
    found = (nx.node_connected_component(beside, n) for n in ahead if n in beside)
    return frozenset[str]().union(*found)


def _zeros(run: SignalPath) -> FloatArray:
    return np.zeros_like(run.time)
