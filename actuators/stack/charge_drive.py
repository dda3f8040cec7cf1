"""A stack driven by a current (charge) instead of a voltage: the same graph, another source.

Why the loop collapses. Both stack models put the hysteresis into the electrical loop: the store
``V_h = H(q)`` of the lumped model and ``E = C_nl(p)`` of the general bond graph are functions of
charge. Under voltage drive the charge is the hysteretic answer, and the displacement follows the
charge. A current source imposes the charge; the hysteretic store then only sets the voltage that
the amplifier has to deliver, and at rest

    lumped:              x = (T q + C F_e) / (C k + T^2)
    general bond graph:  x = T q + F_e / k

are straight lines, with an external load too: a spring or a mass changes their slope only.

What remains. The lag of the moved body (``b x'``); whatever hysteresis the mechanical side has,
since the charge does not fix it; and leakage (below). A real stack keeps a per cent or two, because
domains that switch move charge and strain in different proportions; neither model has that.

The drawback. Nothing holds the charge at low frequency. An offset current i_0 of the amplifier
moves a free stack by ``(x/q) i_0``, and a leakage resistance across it makes the drive a high pass
with the corner ``1 / (2 pi R C)``, C being the free capacitance: slow commands are lost, and close
to the corner the loop opens again because charge and command are out of phase.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from bondgraph import BondGraph, C, One, R, Sf, Zero
from bondgraph.graph.composing.renaming import declared_parameters, set_numbers
from bondgraph.graph.elements import Element
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import GraphError, UnusableInput


def current_driven(
    graph: BondGraph,
    *,
    source: str = "V_in",
    command: str = "i_in",
    leak: float | None = None,
    name: str = "",
) -> BondGraph:
    """Return the graph with its voltage source replaced by a current source.

    Parameters
    ----------
    graph : BondGraph
        Such as `stack_lumped` or `stack_bond_graph`.
    source : str
        The effort source to replace.
    command : str
        Name of the current source, the new input (A).
    leak : float, optional
        Resistance ``R_leak`` across the stack (its insulation, the cable's, the amplifier's), ohm.
    name : str, optional
        Of the new graph.

    Returns
    -------
    BondGraph
        Every store of the electrical loop has integral causality: the charge is a state.

    Raises
    ------
    GraphError
        If `source` is not an effort source.

    Examples
    --------
    >>> from actuators import stack_bond_graph
    >>> charged = current_driven(stack_bond_graph())
    >>> charged.check(), "i_in" in charged.elements
    ((), True)
    """
    if graph[source].kind != "Se":
        raise GraphError(
            f"{graph.name}: {source} is a {graph[source].kind}, not an effort source; name the "
            "voltage source that the current source replaces"
        )
    new = BondGraph(name or f"{graph.name}_current_driven")
    for place, element in graph.elements.items():
        new.add(Sf(command, unit="A") if place == source else element)
    junction = graph.neighbour(source)
    moved: set[str] = set()
    if leak is not None and not leak > 0.0:
        raise UnusableInput(f"current_driven: leak = {leak} ohm must be positive; leave it out")
    if leak is None:
        new.bond(new[command], new[junction])
    else:
        moved = _leaking(new, new[command], new[junction], graph, leak)
    for bond in graph.bonds:
        if source not in (bond.tail, bond.head) and bond.head not in moved:
            new.bond(new[bond.tail], new[bond.head])
    known = new.parameters
    kept = (p for p in set_numbers(graph) if p.name in known)
    return new.with_parameters((*declared_parameters(graph), *kept))


def _leaking(
    new: BondGraph, head: Element, junction: Element, graph: BondGraph, leak: float
) -> set[str]:
    """Join source and stack through a leaking terminal; returns the resistors moved before it.

    With a lead resistance behind the leak the two resistors would share the current by an algebraic
    equation. In series its place is free, so it goes between the source and the terminal, where a
    current source does not notice it.
    """
    lead, terminal = One("lead"), Zero("terminal")
    new.bond(head, lead)
    leads = [
        r
        for r in graph.of_type(R)
        if isinstance(junction, One) and graph.neighbour(r.name) == junction.name
    ]
    for resistor in leads:
        new.bond(lead, resistor)
    new.bond(lead, terminal)
    new.bond(terminal, R("R_leak", leak, unit="ohm", source="insulation of stack and cable"))
    new.bond(terminal, junction)
    return {r.name for r in leads}


def with_spring_load(graph: BondGraph, stiffness: float, body: str = "body") -> BondGraph:
    """Return the graph with an external spring ``k_load`` (N/m) at the moved body."""
    spring = C("k_load", stiffness=stiffness, unit="N/m", source="external load")
    return graph.with_branch(body, (spring,))


def current_for(time: ArrayLike, charge: ArrayLike) -> FloatArray:
    """Return the current (A) that delivers a smooth charge (C); central differences.

    `charge_of` of the result is the charge that the stack gets.
    """
    t, q = np.asarray(time, float), np.asarray(charge, float)
    if t.ndim != 1 or t.shape != q.shape or t.size < 3:
        raise UnusableInput(f"current: time {t.shape} and charge {q.shape} need 3 samples or more")
    return np.asarray(np.gradient(q, t, edge_order=2))


def charge_of(time: ArrayLike, current: ArrayLike) -> FloatArray:
    """Return the charge (C) of a current that is linear between samples; 0 at first.

    Examples
    --------
    >>> charge_of([0.0, 1.0, 2.0], [1.0, 1.0, 3.0]).tolist()
    [0.0, 1.0, 3.0]
    """
    t, i = np.asarray(time, float), np.asarray(current, float)
    steps = 0.5 * (i[1:] + i[:-1]) * np.diff(t)
    return np.concatenate(([0.0], np.cumsum(steps)))


def corner_frequency(leak: float, capacitance: float) -> float:
    """Return ``1 / (2 pi R C)``, Hz.

    Parameters
    ----------
    leak : float
        R, ohm.
    capacitance : float
        Free capacitance C of the stack, F; with hysteresis the slope of charge over voltage at the
        amplitude in question.
    """
    if not (leak > 0.0 and capacitance > 0.0):
        raise UnusableInput("corner frequency: resistance and capacitance must be positive")
    return 1.0 / (2 * math.pi * leak * capacitance)
