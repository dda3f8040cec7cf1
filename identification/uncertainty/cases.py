"""Any model as a case for the coverage of intervals."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.simulation.dynamics import dynamics_of
from bondgraph.simulation.simulate import simulate
from bondgraph.support.arrays import FloatArray
from identification.uncertainty.coverage import Case
from identification.uncertainty.joint_sensitivities import speeds_of

SAMPLES = 800


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
        dynamics = dynamics_of(graph)
        top = float(speeds_of(dynamics, dynamics.vector({}))[0]) / np.pi
    time = np.arange(samples) / (8.0 * top)
    rng = np.random.default_rng(seed)
    names = [s.name for s in graph.of_type(Source)]
    commands = {n: amplitude * multisine(samples, rng) for n in names}
    clean = simulate(graph, time, commands, x0="rest", hold="linear").outputs
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
