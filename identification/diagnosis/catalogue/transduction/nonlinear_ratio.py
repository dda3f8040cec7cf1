"""Ratio that is not constant: of a lever, a gear, a motor, a voice coil."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import sympy as sp

from bondgraph.graph.bond_graph import Bond, BondGraph
from bondgraph.graph.composing.renaming import assemble
from bondgraph.graph.elements import GY, MGY, MTF, TF, C, Element, One, TwoPort
from bondgraph.graph.modulation import displacement, flow
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Odometer
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import store_of_way
from identification.diagnosis.localisation.recording.variables import variables_beside
from identification.diagnosis.screening.port_history import FittedModel, PortHistory, moved_by

BY_WAY, BY_FLOW = 0.0, 1.0


class NonlinearRatio(Effect):
    """Ratio that depends on the position of the side that moves or, in a gyrator, on the current.

    Of a gyrator without units the secondary side is taken to move: a motor.

    Both sides use the same ratio, so that no power is made or lost: a modulated transformer or
    gyrator with ``ratio = n (1 + a_1 z + a_2 z^2)``, ``z = (q - centre) / span`` or
    ``z = f / span``.
    """

    costly = True
    name = "nonlinear_ratio"
    family = "transduction"
    kind = "ratio"
    law = "modulated_ratio"
    sentence = "its ratio is not constant but changes with position or current"
    looks = (
        "the gain changes along the way (or with the current) and the reaction on the other side "
        "changes by the same share; no energy is lost"
    )
    confused_with = ("nonlinear_stiffness", "sensor_nonlinearity", "saturation")
    separated_by = (
        "the same small excitation about several positions (or bias currents), with both sides "
        "measured: both gains change by the same share if it is the ratio"
    )
    source = "Karnopp, Margolis and Rosenberg, System Dynamics (modulated two-ports)"
    meanings: ClassVar[Mapping[str, str]] = {
        "a_1": "share by which the ratio rises from the middle to the upper end, and falls to the "
        "lower one",
        "a_2": "share by which it changes from the middle towards both ends, beside that",
        "centre": "middle of the way, zero for a current",
        "span": "half of the way, or the largest current",
        "top": "where the ratio is largest, from the middle of the way",
        "bend": "how fast it falls: half of the way over the half width of the bell, squared",
        "fall": "how far out it falls: 1 as the square of the way, 20 like a normal curve",
    }
    richer = ("bell_shaped_ratio",)

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Return transformers and gyrators with a constant ratio."""
        return tuple(
            e for e in graph.of_type(TF, GY)
            if not isinstance(e, MTF | MGY) and _ports(graph, e.name) is not None
        )  # fmt: skip

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Share of the ratio times what the ratio multiplies, on both sides.

        ``e_in = n (1 + d) x`` adds ``d x`` to the secondary effort (transformer) or the secondary
        flow (gyrator), and ``d f_in`` on the other side, with ``d = a_1 z + a_2 z^2``.
        """
        assert isinstance(element, TwoPort)
        past = scene.of(element)
        found = []
        way, current = way_of_two_port(past), current_of_two_port(past)
        if np.ptp(way) > 0:
            found.append(_shares(past, (way - _centre(way)) / _half(way), BY_WAY))
        if isinstance(element, GY) and np.ptp(current) > 0:
            found.append(_shares(past, current / _largest(current), BY_FLOW))
        return tuple(found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Exchange the two-port for a modulated one; a store of the side that moves tells the way.

        Where there is none, one without stiffness is added.
        """
        assert isinstance(element, TwoPort)
        by_flow = hint is not None and hint.shape.get("by") == BY_FLOW
        at = _along(scene, element, by_flow)
        name = element.name
        made = {
            **at.range_of_signal,
            "a_1": Parameter(f"a_1_{name}", 0.0, "1", positive=False, scale=0.1, lower=-2, upper=2),
            "a_2": Parameter(f"a_2_{name}", 0.0, "1", positive=False, scale=0.1, lower=-2, upper=2),
        }
        z = (at.signal - made["centre"].symbol) / made["span"].symbol
        graph = at.changed_by(1 + made["a_1"].symbol * z + made["a_2"].symbol * z**2, made)
        strengths = (made["a_1"].name, made["a_2"].name)
        starts: dict[str, float] = {}
        if hint is not None:
            weights = np.clip(hint.weights * [at.turned, 1.0], -1, 1).astype(float)
            starts = dict(zip(strengths, weights, strict=True))
        return self.inserted(element, graph, (starts,), strengths)

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Return bells with the top and the curvature there of a fitted series along the way.

        ``n / (1 + bend z^2 / fall)^fall``, ``z = (q - centre - top) / span``: with a fall of one,
        and with one that is fitted.
        """
        assert isinstance(element, TwoPort)
        known, name = ended.get(self.name, {}), element.name
        a, b = (known.get(f"{n}_{name}", 0.0) for n in ("a_1", "a_2"))
        if b >= 0.0 or known[f"span_{name}"] == _largest(current_of_two_port(scene.of(element))):
            return ()
        at = _along(scene, element, by_flow=False)
        top = float(np.clip(-0.5 * a / b, -1.0, 1.0))
        height = 1.0 + a * top + b * top**2
        made = {
            **at.range_of_signal,
            "top": Parameter(f"top_{name}", 0.0, at.unit, positive=False, scale=at.span),
            "bend": Parameter(f"bend_{name}", 1.0, "1", lower=0.0, upper=100.0, scale=0.1),
            "fall": Parameter(f"fall_{name}", 1.0, "1", lower=0.2, upper=20.0),
        }
        start = {k: v for k, v in known.items() if k in scene.graph.parameters}
        start |= {f"top_{name}": top * at.span, f"bend_{name}": -b / max(height, 0.1)}
        if name in start:
            start[name] *= height
        z = (at.signal - made["centre"].symbol - made["top"].symbol) / made["span"].symbol
        found = []
        for free in (False, True):
            fall = made["fall"].symbol if free else sp.Integer(1)
            used = {k: v for k, v in made.items() if free or k != "fall"}
            graph = at.changed_by((1 + made["bend"].symbol * z**2 / fall) ** -fall, used)
            plain = self.inserted(element, graph, (start,), (f"bend_{name}",))
            found.append(replace(plain, law=self.richer[0], sentence=BELL, form=True))
        return tuple(found)


BELL = "its ratio is largest at one place and falls to both sides like a bell"


@dataclass(frozen=True, eq=False)
class _Along:
    """A graph that tells what a ratio changes with; middle and half of the range of that.

    `turned` is -1 where it is counted the other way round.
    """

    graph: BondGraph
    element: TwoPort
    signal: sp.Symbol
    centre: float
    span: float
    unit: str
    turned: float = 1.0

    @property
    def range_of_signal(self) -> dict[str, Parameter]:
        """Return the middle and half of the range as parameters that no fit moves."""
        name, unit = self.element.name, self.unit
        return {
            "centre": Parameter(f"centre_{name}", self.centre, unit, positive=False, fixed=True),
            "span": Parameter(f"span_{name}", self.span, unit, fixed=True),
        }

    def changed_by(self, factor: sp.Expr, made: Mapping[str, Parameter]) -> BondGraph:
        """Return the graph with the ratio times `factor`, whose parameters were `made`."""
        g, e = self.graph, self.element
        declared: list[Parameter] = []
        if isinstance(e.ratio, int | float):
            # the number becomes a declared parameter of the same name: fitted values carry over
            declared = [p for p in g.parameters.values() if p.name == e.name]
        kind = MTF if isinstance(e, TF) else MGY
        changed = kind(e.name, ratio=g.coefficient(e) * factor, unit=e.unit)
        return _exchanged(g, changed, [*declared, *made.values()])


def _along(scene: FittedModel, element: TwoPort, by_flow: bool) -> _Along:
    g, name, past = scene.graph, element.name, scene.of(element)
    if by_flow:
        into, out = _bonds(g, name)
        node = One(f"current_{name}")
        g = g.with_inserted(out if past.primary_moves else into, node)
        unit = variables_beside(g, node.name).flow_unit or "1"
        largest = _largest(current_of_two_port(past))
        return _Along(g, element, flow(node.name), 0.0, largest, unit)
    g, store = _with_store(scene, element)
    way, turned = way_of_two_port(past), 1.0
    if store in scene.past:
        counted = scene.past[store].argument
        # a store whose bond points away from it counts the other way round
        turned = -1.0 if np.cov(counted, way)[0, 1] < 0 else 1.0
        way = counted
    unit = variables_beside(g, g.neighbour(store)).displacement_unit or "1"
    return _Along(g, element, displacement(store), _centre(way), _half(way), unit, turned)


def way_of_two_port(past: PortHistory) -> Array:
    """Displacement of the side that moves, which a ratio may depend on."""
    return moved_by(past.output if past.primary_moves else past.argument, past.dt)


def current_of_two_port(past: PortHistory) -> Array:
    """Flow of the other side of a gyrator, whose field a ratio may depend on."""
    return past.argument if past.primary_moves else past.output


def _shares(past: PortHistory, z: Array, by: float) -> Signature:
    powers = np.stack([z, z**2], axis=1)
    return Signature(
        powers * past.argument[:, None], powers * past.output[:, None], shape={"by": by}
    )


def _with_store(scene: FittedModel, element: TwoPort) -> tuple[BondGraph, str]:
    """Return the graph and a store of the way: one that is there, or else a counter.

    A counter starts anywhere, which leaves the ratio and how it changes undetermined.
    """
    g, (into, out) = scene.graph, _bonds(scene.graph, element.name)
    primary = scene.of(element).primary_moves
    store = store_of_way(g, into.tail if primary else out.head)
    if store in scene.past:
        return g, store
    node, counter = One(f"way_{element.name}"), f"counter_{element.name}"
    g = g.with_inserted(into if primary else out, node)
    return g.with_branch(node.name, [C(counter, law=Odometer())]), counter


def _exchanged(graph: BondGraph, element: TwoPort, declared: Iterable[Parameter]) -> BondGraph:
    """Return the graph with `element` in the place of the one of its name."""
    bonds = [(b.tail, b.head) for b in graph.bonds]
    elements = [element if e.name == element.name else e for e in graph.elements.values()]
    kept = [p for p in graph.declared_parameters.values()]
    return assemble(graph.name, elements, bonds, [*kept, *declared])


def _bonds(graph: BondGraph, name: str) -> tuple[Bond, Bond]:
    """Bond into and bond out of a two-port."""
    found = _ports(graph, name)
    assert found is not None
    return found


def _ports(graph: BondGraph, name: str) -> tuple[Bond, Bond] | None:
    into = [b for b in graph.bonds_of(name) if b.head == name]
    out = [b for b in graph.bonds_of(name) if b.tail == name]
    return (into[0], out[0]) if len(into) == len(out) == 1 else None


def _centre(way: Array) -> float:
    return float(0.5 * (way.max() + way.min()))


def _half(way: Array) -> float:
    return float(0.5 * np.ptp(way)) or 1.0


def _largest(signal: Array) -> float:
    return float(np.abs(signal).max()) or 1.0
