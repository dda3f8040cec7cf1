"""A page for each effect of the catalogue, with a picture of what it adds at its port."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bondgraph import TF, BondGraph, C, Df, Dq, I, One, R, Se, simulate
from bondgraph.graph.elements import Element, Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Split
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.words import formula, parameters
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.identification.diagnosis.effect_plants import coil, electrical, hydraulic

IN_TIME = frozenset({
    "added_mode", "clock_skew", "creep", "eddy_current_loss", "external_disturbance",
    "internal_leakage", "leakage", "self_heating", "sensor_drift", "sensor_offset",
    "time_varying_parameter",
})  # fmt: skip
"""Effects that are drawn over time; the others over what their element moves by."""
SHAPE = {"external_disturbance": 0, "overflow": 1, "sensor_drift": 0, "time_varying_parameter": 0}
"""Which of its shapes is drawn where the middle one would not teach."""
TWO_ENDS = frozenset({"current_limit"})
"""Effects with a column for either end, which are drawn together."""
FINE = {"periodic_error": "period", "quantisation": "step"}
"""Effects that repeat along the way, with the shape that says how often."""


def positioner() -> BondGraph:
    """Return a mass on a spring that is pushed by a motor through a ratio."""
    with BondGraph("positioner") as g:
        motor, body = One("motor"), One("body")
        Se("F", unit="N") >> motor
        lever = TF("lever", ratio=1.0)
        motor >> lever >> body
        body >> I("m", 0.5, unit="kg")
        body >> R("d", 4.0, unit="N*s/m")
        body >> C("k", stiffness=50.0, unit="N/m")
        body >> Dq("x", unit="m")
        body >> Df("v", unit="m/s")
    return g


def carriage() -> BondGraph:
    """Return a mass that nothing holds and nothing brakes."""
    with BondGraph("carriage") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> Dq("x", unit="m")
    return g


@cache
def scenes() -> tuple[FittedModel, ...]:
    """Return the machines in motion."""
    t = np.asarray(0.01 * np.arange(1500), np.float64)
    u = np.sin(2 * np.pi * 0.31 * t) + 0.6 * np.sin(2 * np.pi * 0.83 * t)
    split = Split(slice(0, 1000), slice(1000, t.size), "first two thirds")
    made = []
    rest = (hydraulic(), 0.1), (electrical(), 4.0), (coil(), 4.0), (carriage(), 4.0)
    for graph, size in ((positioner(), 20.0), *rest):
        (source,) = graph.of_type(Source)
        run = simulate(graph, t, {source.name: size * u})
        names = tuple(s.name for s in graph.of_type(Sensor))
        y = np.stack([run[n] for n in names], axis=1)
        y += 1e-3 * y.std(axis=0) * np.random.default_rng(1).standard_normal(y.shape)
        data = Data("run", t, {source.name: size * u}, y, names, 1e-3 * y.std(axis=0), split)
        made.append(scene(fit(Problem(graph, data), max_iterations=2)))
    return tuple(made)


def place_of(effect: Effect) -> tuple[FittedModel, Element] | None:
    """Return the first machine that has a usual place for an effect, with that place."""
    for s in scenes():
        for e in effect.places(s.graph):
            if effect.home(e) and e.name in s.past and effect.signatures(s, e):
                return s, e
    return None


def picture(effect: Effect) -> Figure | None:
    """Draw what the effect adds at its port; None where it has no shape of its own."""
    found = place_of(effect)
    if found is None:
        return None
    s, e = found
    shapes = effect.signatures(s, e)
    shape = shapes[SHAPE.get(effect.name, len(shapes) // 2)]
    drawn = shape.columns if effect.name in TWO_ENDS else shape.columns[:, -1:]
    port, added = s.past[e.name], drawn.sum(axis=1)
    way = effect.kind in ("memory", "restoring") and port.moved is not None
    along = port.moved if way else port.argument
    assert along is not None
    figure = Figure(figsize=(5.2, 2.8), layout="constrained")
    axes = figure.add_subplot()
    if effect.name in IN_TIME:
        axes.plot(s.data.time[300:800], added[300:800], color="C1")
        axes.set_xlabel("time")
    else:
        shown = np.arange(800)
        if effect.name in FINE and shape.shape:
            near = np.abs(along - np.median(along)) < 2 * shape.shape[FINE[effect.name]]
            shown = np.flatnonzero(near)[np.argsort(along[near])]
        axes.plot(along[shown], added[shown], color="C1", lw=1)
        axes.set_xlabel("what its element moves by")
    axes.set_ylabel(f"added at {e.name}")
    axes.set_yticks([0.0])
    axes.set_xticks([])
    return figure


def page(effect: Effect, drawn: bool) -> str:
    """Return the page of one effect."""
    lines = [f"# {effect.name}", "", f"{effect.sentence[0].upper()}{effect.sentence[1:]}.", ""]
    if drawn:
        lines += [f"![what {effect.name} adds at its port]({effect.name}.svg)", ""]
    rows = {
        "Family, kind": f"{effect.family}, {effect.kind}",
        "Law": f"`{effect.law}`: {formula(effect).replace('``', '`')}",
        "Parameters": "; ".join(f"`{n.strip()}` {said}" for n, said in parameters(effect)),
        "Looks like": effect.looks,
        "Contains": ", ".join(map(_link, effect.simpler)),
        "Richer laws": ", ".join(f"`{r}`" for r in effect.richer),
        "Confused with": ", ".join(map(_link, effect.confused_with)),
        "Separated by": effect.separated_by,
        "Source": effect.source,
    }
    for term, text in rows.items():
        if text:
            lines += [term, f": {text}", ""]
    return "\n".join(lines)


def _link(name: str) -> str:
    known = name in {e.name for e in CATALOGUE}
    return f"[{name}]({name}.md)" if known else name


def write_catalogue(folder: Path) -> None:
    """Write a page and a picture for each effect, and their list."""
    folder.mkdir(parents=True, exist_ok=True)
    for effect in CATALOGUE:
        figure = picture(effect)
        if figure is not None:
            figure.savefig(folder / f"{effect.name}.svg", metadata={"Date": None})
        (folder / f"{effect.name}.md").write_text(
            page(effect, figure is not None), encoding="utf-8"
        )
    lines = ["# Catalogue of effects", "", WORDS, ""]
    lines += ["| effect | family | in words |", "| --- | --- | --- |"]
    lines += [f"| {_link(e.name)} | {e.family} | {e.sentence} |" for e in CATALOGUE]
    lines += ["", "```{toctree}", ":hidden:", "", *(e.name for e in CATALOGUE), "```", ""]
    (folder / "index.md").write_text("\n".join(lines), encoding="utf-8")


WORDS = """What a diagnosis can name. `bondsight effects` prints this table, or one effect in
full. A picture shows what a weak effect adds to the effort of its element (to the command
of a source, to the reading of a sensor) while a machine moves. What is not here should end as a
*kind* of physics, or as unknown; an effect of your own is a class:
[an effect of your own](../../howto/own_effect.md)."""
