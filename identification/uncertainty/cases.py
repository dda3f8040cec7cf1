"""Plants for the coverage of intervals: a spring, a hysteretic spring, and any model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Dq, I, One, R, Se, Sensor, Source
from bondgraph.laws import StopSum
from bondgraph.simulation.simulate import simulate
from bondgraph.support.arrays import FloatArray
from identification.study.engine import engine_of
from identification.uncertainty.coverage import Case
from identification.uncertainty.joint_sensitivities import speeds_of

SAMPLES = 800


def demo_cases(samples: int = SAMPLES, noise: float = 0.02) -> tuple[Case, ...]:
    """Return a linear and a hysteretic spring, each with white and with coloured noise.

    Coloured noise (correlation 0.8 from sample to sample) is once taken for white, once modelled.
    """
    found = []
    for name, graph in (("linear", _spring(None)), ("hysteretic", _spring(_stops()))):
        case = case_of(graph, samples=samples, noise=noise, amplitude=6.0, top=8.0)
        found.append(replace(case, name=f"{name} spring, white noise"))
        coloured = replace(case, colour=0.8, name=f"{name} spring, coloured noise taken for white")
        found.append(coloured)
        modelled = f"{name} spring, coloured noise taken for coloured"
        found.append(replace(coloured, model="coloured", name=modelled))
    return tuple(found)


def _stops() -> StopSum:
    return StopSum((0.01, 0.03), height=40.0, scale=40.0, unit="N/m")


def _spring(law: StopSum | None) -> BondGraph:
    with BondGraph("spring" if law is None else "hysteretic_spring") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> C("k", stiffness=200.0, unit="N/m", law=law)
        body >> Dq("x", unit="m")
    return g


def case_of(
    graph: BondGraph,
    *,
    samples: int = SAMPLES,
    noise: float = 0.02,
    amplitude: float = 1.0,
    top: float | None = None,
    colour: float = 0.0,
    model: str = "white",
    seed: int = 0,
) -> Case:
    """Return a case for any graph: random multisine on all sources, noise as a share of the rms.

    Parameters
    ----------
    samples : int
    noise : float
        Standard deviation of the noise over the rms of each reading.
    amplitude : float
        Peak of every command, SI.
    top : float, optional
        Highest frequency, Hz; twice that of the slowest pole when not given.
    """
    if top is None:
        engine = engine_of(graph)
        top = float(speeds_of(engine, engine.vector({}))[0]) / np.pi
    time = np.arange(samples) / (8.0 * top)
    rng = np.random.default_rng(seed)
    names = [s.name for s in graph.of_type(Source)]
    commands = {n: amplitude * multisine(samples, rng) for n in names}
    clean = simulate(graph, time, commands).outputs
    levels = {
        s.name: noise * float(np.sqrt(np.mean(clean[s.name] ** 2))) or 1e-12
        for s in graph.of_type(Sensor)
    }
    free = tuple(n for n, p in graph.parameters.items() if not p.fixed)
    return Case(f"{graph.name}", graph, time, commands, levels, free, colour, model)


def multisine(samples: int, rng: np.random.Generator) -> FloatArray:
    """Return a random multisine up to a quarter of the Nyquist frequency, from rest, peak 1."""
    lines = np.arange(1, samples // 8)
    phase = rng.uniform(0, 2 * np.pi, lines.size)
    t = np.arange(samples) / samples
    u = np.sin(2 * np.pi * lines[None, :] * t[:, None] + phase[None, :]).sum(axis=1)
    u *= np.minimum(np.arange(samples) / (0.02 * samples), 1.0)
    return np.asarray(u / np.abs(u).max())
