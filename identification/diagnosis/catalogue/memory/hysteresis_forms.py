"""Other forms of hysteresis: creeping, saturating, wider with the rate, or loops that harden."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from bondgraph.graph.elements import C, Element, R, Source
from bondgraph.laws import (
    BoucWenMemory,
    Law,
    LawSum,
    MaxwellSlip,
    Parametrised,
    Polynomial,
    StopSum,
)
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Insertion
from identification.diagnosis.catalogue.memory.creep import Creep
from identification.diagnosis.catalogue.memory.hysteresis import Hysteresis, stops_at
from identification.diagnosis.catalogue.places import law_of
from identification.diagnosis.catalogue.starts import law_units, rebalanced, rubbing_units
from identification.diagnosis.screening.port_history import FittedModel

PLAIN = Hysteresis()
Values = Mapping[str, float]


def hysteresis_forms(
    scene: FittedModel, element: Element, ended: Mapping[str, Values]
) -> tuple[Insertion, ...]:
    """Return stops of a storage that creep, saturate, or slip later in fast motion; and Bouc-Wen.

    Of a drive Bouc-Wen, and anywhere more stops, which may be loaded beforehand.

    Creep in series: Kuhnen and Janocha 1998. Third and fifth power of a Landau potential:
    Devonshire, Phil. Mag. 40 (1949) 1040; Landis, J. Mech. Phys. Solids 50 (2002) 127. Thresholds
    that grow with the rate: Al Janaideh and Krejci, IEEE/ASME Trans. Mechatronics 18 (2013) 1498.
    Stops only soften after a turn; loops of Bouc and Wen may harden too. Stops in a resistor are
    tried with slip lengths that are fitted.

    Parameters
    ----------
    ended : mapping of str to mapping of str to float
        Where the laws at `element` ended, by effect: the forms start from the plain stops there.
        Without them only Bouc-Wen is left, which holds no stops.
    """
    if isinstance(element, R):
        return _at_their_ways(scene, element, ended.get(PLAIN.name, {}))
    past, known = scene.of(element), ended.get(PLAIN.name, {})
    own = _finer(scene, element) if known else ()
    if isinstance(element, Source) and not element.measured:
        return (_bouc_wen(scene, element, past.largest), *own)
    if not isinstance(element, C):
        return own
    reach = float(abs(past.argument).max()) or 1.0
    state = _bouc_wen(scene, element, reach)
    if not known:
        return (state,)
    stops = stops_at(element, past)
    # odd about zero, not about the middle of the record
    effort, way = law_units(element)
    potential = Polynomial(0.0, reach, 0.1 * past.swing, (3, 5), unit=effort)
    saturating = LawSum((
        Parametrised(stops, ("thresholds",), (way,)),
        Parametrised(potential, ("centre", "half"), (way, way)),
    ))  # fmt: skip
    rate = rubbing_units(element)[1] if way != "1" else "1"
    rated = replace(stops, rated=True, speed=float(abs(past.rate).max()) or 1.0)
    return (
        _creeping(scene, element, known),
        _beside(
            scene, element, saturating, known, "stops_in_a_potential", ("nonlinear_stiffness",),
            "it switches with the turning points of the past, and saturates",
        ),
        _beside(
            scene, element, Parametrised(rated, ("thresholds", "speed"), (way, rate)), known,
            "rate_dependent_prandtl_ishlinskii", (),
            "its output depends on the turning points of the past, with loops wider with speed",
        ),
        state,
        *own,
    )  # fmt: skip


LOADED = "its output depends on the turning points of the past, also of those before the record"
FINE = 3
"""Times as many stops as usual where their steps show above the noise."""


def _finer(scene: FittedModel, element: Element) -> tuple[Insertion, ...]:
    """Insert more stops, which may be loaded before the record begins: each way only once.

    They start afresh: where all were free at first the plain ones have bent to what is none.
    """
    past, (_, way) = scene.of(element), law_units(element)[:2]
    first, plain = float(past.argument[0]), stops_at(element, past)
    at = np.arange(1, FINE * len(plain.thresholds) + 1) / FINE
    ends = np.interp(at, np.arange(len(plain.thresholds) + 1), (0.0, *plain.thresholds))
    made: dict[tuple[float, ...], Insertion] = {}
    for begun in ("relaxed", "virgin", "risen", "fallen"):
        law = replace(
            plain, thresholds=tuple(map(float, ends)), height=plain.height / FINE, begun=begun
        )
        words = LOADED if begun != "relaxed" else PLAIN.sentence
        lifted = Parametrised(law, ("thresholds",), (way,))
        form = _beside(scene, element, lifted, {}, PLAIN.law, (), words)
        made.setdefault(tuple(law.advance(NUMPY, first, law.initial_memory(first), ())), form)
    return tuple(made.values())


def bearing(scene: FittedModel, made: Insertion, values: Values) -> Insertion | None:
    """Return a bank without the stops that a fit put to zero; None of what is no bank or has none.

    What is left of many stops is as few as the readings ask for.
    """
    lifted, name = law_of(made.graph[made.element]), made.element
    if not isinstance(lifted, Parametrised) or not isinstance(lifted.inner, StopSum):
        return None
    stops = lifted.inner
    heights = [values.get(f"h_{i}_{name}", 0.0) for i in range(1, len(stops.thresholds) + 1)]
    kept = [i for i, h in enumerate(heights) if h > IDLE * max(heights)]
    if stops.rated or not 0 < len(kept) < len(heights):
        return None
    fewer = replace(stops, thresholds=tuple(stops.thresholds[i] for i in kept))
    law = Parametrised(fewer, lifted.lifted, lifted.units)
    graph, names = PLAIN.with_law(scene, scene.graph[name], law)
    start = {n: v for n, v in values.items() if n in scene.graph.parameters}
    start |= {n: heights[i] for n, i in zip(names, kept, strict=True)}
    return replace(made, graph=graph, starts=(start,), strengths=names)


IDLE = 1e-3
"""Part of the largest height below which a stop bears nothing."""


SHAPES = ((4.0, 4.0), (1.0, 1.0), (1.0, -1.0), (1.5, -2.5))
"""Beta and gamma of loops that slip early, soften, stay straight and harden."""


def _bouc_wen(scene: FittedModel, element: Element, reach: float) -> Insertion:
    """Insert a state of its own, which takes half of the slope at first."""
    past = scene.of(element)
    stops = stops_at(element, past)
    slope = past.slope if isinstance(element, C) else 1.0
    loops = BoucWenMemory(scale=0.1 * slope, unit=stops.unit, reach=reach, sign=stops.sign)
    law = Parametrised(loops, ("reach",), law_units(element)[1:])
    graph, (height, beta, gamma) = PLAIN.with_law(scene, element, law)
    half = 0.5 * slope
    rest = rebalanced(element, past, half * past.argument) if isinstance(element, C) else {}
    starts = tuple({height: half, beta: b, gamma: g, **rest} for b, g in SHAPES)
    made = PLAIN.inserted(element, graph, starts, (height,), ((beta, OPEN, np.inf),))
    return replace(
        made, law="bouc_wen", form=True,
        sentence="its output follows a state of its own, whose loops soften or harden",
    )  # fmt: skip


OPEN = 0.01
"""Part by which the slope after a turn differs, over the reach, below which there is no loop."""


STRONG = 0.05
"""Share of all levels from which a stop of a resistor is kept where its slip length is fitted."""


def _at_their_ways(scene: FittedModel, element: Element, known: Values) -> tuple[Insertion, ...]:
    """Insert the strong ones of a resistor's stops, their slip lengths free."""
    plain = PLAIN.made(PLAIN.site(scene, element))
    assert isinstance(plain, MaxwellSlip)
    levels = [known.get(f"F_{i}_{element.name}", 0.0) for i in range(1, len(plain.ways) + 1)]
    kept = [i for i, level in enumerate(levels) if level > STRONG * sum(levels)]
    if not kept:
        return ()
    law = replace(plain, ways=tuple(plain.ways[i] for i in kept), fitted="ways")
    graph, names = PLAIN.with_law(scene, element, law)
    start = {n: levels[i] for n, i in zip(names, kept, strict=False)}
    made = PLAIN.inserted(element, graph, (), names[: len(kept)])
    return (replace(made, law="maxwell_slip", form=True, starts=({**known, **start},)),)


def _creeping(scene: FittedModel, element: Element, known: Values) -> Insertion:
    """Insert the stops, then two Kelvin-Voigt branches before the storage."""
    stops = PLAIN.insert(scene, element)
    creep = Creep().insert(replace(scene, graph=stops.graph), element)
    strengths = (*stops.strengths, *creep.strengths)
    made = PLAIN.inserted(element, creep.graph, stops.starts, strengths, creep.within)
    return replace(
        made, law="hysteresis_with_creep", simpler=("creep", "leakage"), form=True,
        starts=_from(known, made, creep.starts[0]),
        sentence="its output depends on the turning points of the past, and goes on creeping",
    )  # fmt: skip


def _beside(
    scene: FittedModel, element: Element, law: Law, known: Values, name: str,
    simpler: tuple[str, ...], sentence: str,
) -> Insertion:  # fmt: skip
    """Insert stops together with something that they cannot do alone."""
    graph, names = PLAIN.with_law(scene, element, law)
    made = PLAIN.inserted(element, graph, PLAIN.insert(scene, element).starts, names)
    return replace(
        made, law=name, simpler=simpler, sentence=sentence, form=True, starts=_from(known, made)
    )


def _from(
    known: Values, made: Insertion, more: Values = MappingProxyType({})
) -> tuple[Values, ...]:
    """Return starts where the plain stops ended, and as those begin."""
    own = {n: v for n, v in known.items() if n in made.graph.parameters}
    return tuple({**s, **more} for s in ((own,) if own else ()) + tuple(made.starts))
