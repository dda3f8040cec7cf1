"""Piecewise simulation of a switched graph: one mode after the other, states carried over.

Junctions switch at given times (a schedule) or by the state (guards: a diode that opens, a stop
that is hit), which is located inside a step. Modes that are linear up to scalar laws take the exact
step, others the general one. What the storages hold is continuous at a switch. A mode in which a
storage depends on others (or on a source) takes over only values that fit; where they do not, the
switch would need an impulse and is refused, unless guards leave another mode that fits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Source
from bondgraph.simulation.modes.guards import Guard
from bondgraph.simulation.modes.inputs import SHORT, Inputs
from bondgraph.simulation.modes.pieces import Pieces
from bondgraph.simulation.modes.resolve import mode_of
from bondgraph.simulation.modes.watching import Watch
from bondgraph.simulation.start import checked_commands, usual_hold
from bondgraph.simulation.timing import is_timed, read, sent, without_timing
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.arrays import Array
from bondgraph.support.errors import GraphError, UnusableInput, require_known

Schedule = Sequence[tuple[float, Mapping[str, bool]]]
"""Times of switching (s, rising) and what each changes."""


def simulate_modes(
    graph: BondGraph,
    time: Array,
    schedule: Schedule = (),
    commands: Mapping[str, Array] | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    start: Mapping[str, float] | None = None,
    hold: str | None = None,
    accuracy: float = 1e-4,
    tolerance: float = 1e-6,
    events: Sequence[Guard] = (),
) -> Trajectory:
    """Simulate `graph` through switch times that are given, and those that its state decides.

    Parameters
    ----------
    time : ndarray, shape (N,), s
        Even grid. Switch times need not lie on it.
    schedule : sequence of (float, mapping of str to bool)
        At each time, which switched junctions go on or off; before, they are as declared.
    commands : dict of str to ndarray, shape (N,), SI
        Command of each source.
    parameters : dict of str to float
        Values that differ from the declared ones.
    start : dict of str to float
        States at the first sample by name (``q_C_1``, ``p_L``); the others are those of rest with
        all inputs at zero. Nothing is put to rest where all are given.
    hold : {"hold", "linear"}, optional
        What the inputs do between samples. When not given, they are held, as by a converter; linear
        where one is recorded by its rate or its integral.
    accuracy : float
        As in `bondgraph.simulate`.
    tolerance : float
        A store may differ by so much of its largest value so far from what a new mode dictates.
    events : sequence of Guard
        What switches the junctions that the schedule does not. A guard that holds at the start acts
        there. Wherever something switches, guards are asked again in the new mode until none wants
        to switch; where that leads round in a circle or to an impulse, the mode that fits and has
        the fewest other junctions switched is taken. What holds for less than a sample is found
        where a parabola through the samples shows it.

    Returns
    -------
    Trajectory
        Outputs at `time`; a sample at a switch belongs to the new mode. `laws` is empty, `state`
        is that of the last mode, `events` are those of the guards.

    Raises
    ------
    GraphError
        A switch would need an impulse (the line names the store), a mode has no equations or no
        rest to start from, or guards contradict each other or chatter.
    BondsightError
        Newton's method finds no way on through a mode that takes the general step.
    UnusableInput
        Times that do not rise or lie outside of `time`, levels that make no sense.

    Examples
    --------
    A heater that a thermostat switches.

    >>> import numpy as np
    >>> from bondgraph import De, R, Se, X1, Zero, C
    >>> from bondgraph.simulation.modes.guards import Guard, When
    >>> with BondGraph("oven") as oven:
    ...     heater, room = X1("heater", on=False), Zero("room")
    ...     _ = Se("T_h") >> heater >> R("R_h", 1.0)
    ...     _ = heater >> room >> C("C_r", 1.0)
    ...     _ = room >> R("loss", 1.0)
    ...     _ = room >> De("T")
    >>> two_levels = Guard("heater", on=When("T", below=19.0), off=When("T", above=21.0))
    >>> t = np.linspace(0.0, 2.0, 201)
    >>> run = simulate_modes(oven, t, (), {"T_h": 60.0 + 0.0 * t}, events=[two_levels])
    >>> [(round(e.time, 4), e.on) for e in run.events[:3]]
    [(0.0, True), (0.602, False), (0.7021, True)]
    """
    if is_timed(graph):
        between, before = hold or usual_hold(graph, ()), None if start else 0.0
        Watch(graph, events)  # a guard on a late sensor is refused where it still is late
        arrived = sent(graph, time, commands, parameters, before, between)
        made = simulate_modes(
            without_timing(graph), time, schedule, arrived, parameters,
            start=start, hold=hold, accuracy=accuracy, tolerance=tolerance, events=events,
        )  # fmt: skip
        return replace(made, outputs=read(graph, made.time, made.outputs, parameters))
    grid = _checked_grid(graph, time)
    given = checked_commands(graph.name, commands, grid)
    hold = hold or usual_hold(graph, ())
    require_known("inter-sample behaviour", "simulate_modes", ("linear", "hold"), hold)
    if hold == "hold" and (by := [s.name for s in graph.of_type(Source) if s.given == "integral"]):
        raise UnusableInput(
            f"{graph.name}: the equations need the rate of what is recorded of {by[0]}, but an "
            "input that is held jumps between samples; leave hold out, or use hold='linear'"
        )
    stretches = _stretches(graph, grid, schedule)
    scheduled = {name for _, changes in schedule for name in changes}
    watch = Watch(graph, events, scheduled, parameters)
    inputs = Inputs(grid, given, hold)
    run = Pieces(graph, watch, inputs, dict(parameters or {}), accuracy, tolerance)
    for begin, end, changes in stretches:
        run.stretch(changes, begin, end, start if begin == grid[0] else None)
    return run.trajectory()


def _checked_grid(graph: BondGraph, time: Array) -> Array:
    grid = np.asarray(time, float)
    steps = np.diff(grid)
    even = grid.ndim == 1 and grid.size >= 2 and steps.min() > 0
    if not even or not np.allclose(steps, steps.mean(), rtol=1e-3, atol=0):
        raise UnusableInput(f"{graph.name}: time needs at least two samples that rise evenly")
    return grid


def _stretches(
    graph: BondGraph, grid: Array, schedule: Schedule
) -> list[tuple[float, float, dict[str, bool]]]:
    """Begin and end of each stretch between switch times, and what is switched at its begin."""
    mode = mode_of(graph)
    if not mode:
        raise GraphError(f"{graph.name} has no switched junction; simulate(graph, ...) serves it")
    found = []
    set_there: dict[str, bool] = {}
    begin = float(grid[0])
    slack = SHORT * (grid[1] - grid[0])
    for t, changes in schedule:
        if not begin <= t <= grid[-1]:
            raise UnusableInput(
                f"{graph.name}: switch at {t:g} s: times must rise from {grid[0]:g} s to "
                f"{grid[-1]:g} s"
            )
        if t - begin > slack:
            found.append((begin, float(t), set_there))
            begin, set_there = float(t), {}
        for name, on in changes.items():
            require_known("switched junction", graph.name, mode, name)
            set_there[name] = on
    if grid[-1] - begin > slack:
        found.append((begin, float(grid[-1]), set_there))
    return found
