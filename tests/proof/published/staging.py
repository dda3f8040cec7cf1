"""What the protocols share: fits in stages, records cut and joined, errors of free runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Modulated
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.arrays import Array
from identification.estimation import NO_NUISANCES, Estimation, Study, Vary, estimate
from identification.estimation.result import free_run
from identification.study.data import data_for
from identification.study.joined import provenance
from identification.study.problem import Problem

Progress = Callable[[str, float], None]


def scaled(progress: Progress | None, start: float, stop: float) -> Progress | None:
    """Return a progress whose fractions fill the part from `start` to `stop` of another."""
    if progress is None:
        return None
    return lambda text, fraction: progress(text, start + (stop - start) * fraction)


def stage(
    graph: BondGraph,
    recordings: Sequence[Recording],
    free: Sequence[str | Vary],
    values: Mapping[str, float] | None = None,
    *,
    skip: int = 0,
    splits: Sequence[Split] | None = None,
    max_iterations: int = 60,
    progress: Progress | None = None,
    **options: Any,
) -> Estimation:
    """Fit `free` from `values`, everything else held there.

    Parameters
    ----------
    values : mapping of str to float, optional
        Of an earlier stage, SI; declared values where not given.
    skip : int
        Samples at the start of each recording that are not scored.
    splits : sequence of Split, optional
        In place of `skip`.
    **options
        Of `Study`.
    """
    values = values or {}
    vary = [Vary(v) if isinstance(v, str) else v for v in free]
    vary = [v if v.start is not None else replace(v, start=values.get(v.name)) for v in vary]
    names = {v.name for v in vary}
    held = {n: x for n, x in values.items() if n in graph.parameters and n not in names}
    if splits is None:
        rule = f"all but the first {skip} samples train"
        splits = [Split(slice(skip, r.n), slice(r.n, r.n), rule) for r in recordings]
    # sources inside the graph have no channel
    inner = tuple(s.name for s in graph.of_type(Modulated))
    study = Study(
        graph, recordings, vary, held, splits=splits, silent=inner,
        **{"nuisances": NO_NUISANCES, **options},
    )  # fmt: skip
    return estimate(study, max_iterations=max_iterations, progress=progress)


def settled(recording: Recording, repeats: int = 2) -> Recording:
    """Return a periodic record repeated, so that its last period is settled."""
    n = recording.n
    step = float(recording.time[1] - recording.time[0])
    return replace(
        recording,
        time=recording.time[0] + step * np.arange(repeats * n),
        channels={k: np.tile(v, repeats) for k, v in recording.channels.items()},
    )


def joined(first: Recording, second: Recording) -> Recording:
    """Return two records that follow each other without a gap as one."""
    step = float(first.time[1] - first.time[0])
    n = first.n + second.n
    return replace(
        first,
        time=first.time[0] + step * np.arange(n),
        channels={k: np.concatenate([v, second.channels[k]]) for k, v in first.channels.items()},
        **provenance((first, second)),
    )


def rms(error: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(error))))


def free_run_error(
    result: Estimation, recording: Recording, sensor: str, *, state: int = 0, skip: int = 0
) -> float:
    """Root mean square error of a free run of the fitted model, SI.

    Parameters
    ----------
    state : int
        First samples that the initial state is fitted to; 0 starts from rest.
    skip : int
        First samples that are not scored.
    """
    simulated = result.predict(recording, init=state)
    column = result.sensors().index(sensor)
    return rms((recording[sensor] - simulated[:, column])[skip:])


def fitted_start(
    graph: BondGraph,
    recording: Recording,
    values: Mapping[str, float],
    init: int,
    *,
    hold: str = "linear",
    n_sub: int = 1,
    begins: Mapping[str, float] | None = None,
) -> Array:
    """Return a free run of `graph` at `values`, its initial state fitted to the first samples.

    Parameters
    ----------
    begins : mapping of str to float, optional
        States that are known, SI.

    Returns
    -------
    ndarray, shape (N, n_y), SI
    """
    sensors = [s.name for s in graph.of_type(Sensor)]
    floors = {n: max(1e-6 * float(np.ptp(recording[n])), 1e-300) for n in sensors}
    split = Split(slice(init, recording.n), slice(init, recording.n), f"after {init} samples")
    data = data_for(graph, recording, split, floors, hold)
    known = {n: np.array([v]) for n, v in (begins or {}).items()}
    return free_run(Problem(graph, data, n_sub=n_sub, known_states=known), values, init)


def channels(recording: Recording) -> list[Array]:
    """Arrays of all channels in the order of their names, for `split_hash`."""
    return [np.asarray(recording[k]) for k in sorted(recording.channels)]
