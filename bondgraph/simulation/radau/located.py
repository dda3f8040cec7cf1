"""A record of any graph whose steps are halved where a law switches or bends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.equations.program import Program
from bondgraph.simulation.exact_run import Memories, relative_change
from bondgraph.simulation.halving import Within, halved
from bondgraph.simulation.radau.native import GeneralRun, PreparedGeneral, run_general
from bondgraph.simulation.radau.recorder import located_recorder
from bondgraph.support.arrays import Array


def located_general(
    program: Program,
    p: Array,
    u: Array,
    step: float,
    x0: Array,
    hold: str,
    accuracy: float,
    memory: Memories | None,
    unknowns: Array | None,
    columns: Sequence[int],
) -> tuple[int, GeneralRun] | None:
    """Return steps a sample and a run whose outputs a finer tolerance changes by less.

    None where the program has no such loop, inputs are no lines between samples, or the outputs do
    not settle. `columns` are the outputs that must.
    """
    if hold == "band-limited" or program.recorded or located_recorder(program) is None:
        return None
    ready = PreparedGeneral(program, p, step, 1, (), False, False)

    def run_with(within: Within) -> GeneralRun:
        return run_general(ready, u, x0, hold, memory=memory, unknowns=unknowns, within=within)

    n_x, n_z = len(program.states), len(program.algebraic)
    kept, _ = program.start_memory(memory)
    start = np.concatenate([x0, np.zeros(n_z), kept])
    counted = np.ones(start.size, bool)
    counted[n_x : n_x + n_z] = False  # they follow from the states
    return halved(
        run_with,
        lambda a, b: relative_change(a.y[:, columns], b.y[:, columns]),
        start, counted, u.shape[0], accuracy,
    )  # fmt: skip
