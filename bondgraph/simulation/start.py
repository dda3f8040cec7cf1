"""Inputs and states of a run as arrays: the even grid, commands between samples, the start."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.graph.elements import Source
from bondgraph.signals.band_limited import between_samples
from bondgraph.signals.recorded_rates import slopes
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnknownName, UnusableInput, require_known, unknown_name

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.simulation.lure import Compiled

HOLDS = ("hold", "linear", "band-limited")


def usual_hold(graph: BondGraph, rates: Sequence[str]) -> str:
    """Return what inputs do between samples where nobody says: held, as by a converter.

    Linear where the equations need their `rates`, or one is recorded by its rate or its integral: a
    motion that was measured, which no converter holds.
    """
    measured = any(s.given != "value" for s in graph.of_type(Source))
    return "linear" if rates or measured else "hold"


def even_grid(name: str, time: Array) -> Array:
    """Return times as an array, shape (N,), s; refused unless they rise evenly."""
    time = np.asarray(time, float)
    if time.ndim != 1 or time.size < 2:
        raise UnusableInput(f"{name}: time needs at least two samples on one axis")
    steps = np.diff(time)
    if not np.allclose(steps, steps.mean(), rtol=1e-3, atol=0) or steps.mean() <= 0:
        raise UnusableInput(f"{name}: time must rise evenly; resample it first")
    return time


def checked_commands(
    model: str, commands: Mapping[str, Array] | None, time: Array
) -> dict[str, Array]:
    """Return commands as arrays of the shape of `time`; refused unless finite."""
    try:
        commands = {k: np.asarray(v, float) for k, v in (commands or {}).items()}
    except (TypeError, ValueError):
        raise UnusableInput(f"{model}: a command is not made of numbers; give arrays") from None
    for name, v in commands.items():
        if v.shape != time.shape:
            raise UnusableInput(f"{model}: input {name} has shape {v.shape}, time has {time.shape}")
        if not np.isfinite(v).all():
            raise UnusableInput(f"{model}: input {name} holds NaN or infinity; clean it first")
    return commands


def inputs_of(
    compiled: Compiled, commands: Mapping[str, Array], time: Array, breaks: Sequence[int] = ()
) -> Array:
    """Input matrix, shape (N, n_u), from commands by source name; the others are filled in.

    Rates of recorded integrals are the slopes of a spline, a new one from each of `breaks` on.
    """
    n = time.size
    u = np.empty((n, compiled.n_u))
    for i, name in enumerate(compiled.inputs):
        given = commands.get(name, own_input(name, n))
        whole = commands.get(name.partition("_")[2])
        if name in compiled.model.recorded and whole is not None:
            given = slopes(whole, float(np.diff(time).mean()) if n > 1 else 1.0, breaks)
        if given is None:
            raise missing(compiled.model.name, name, commands)
        u[:, i] = given
    return u


def missing(model: str, name: str, commands: Mapping[str, Array]) -> UnknownName:
    """Return the refusal of a simulation whose commands lack one."""
    given = ", ".join(commands) or "none"
    return UnknownName(
        f"{model}: the command {name} is missing (given: {given}); add {name!r} and its values at "
        "the samples to the commands"
    )


def own_input(name: str, n: int) -> Array | None:
    """Return an input that nobody commands, shape (n,): the constant and powers of the ramp."""
    if name == "one":
        return np.ones(n)
    if re.fullmatch(r"ramp\d*", name):
        return np.asarray(np.linspace(0.0, 1.0, n) ** int(name[4:] or 1))
    return None


def fine_inputs(u: Array, n_sub: int, hold: str) -> Array:
    """Return the inputs at both ends of each sub-step, shape ((N - 1) * n_sub, 2, n_u).

    Parameters
    ----------
    u : ndarray, shape (N, n_u)
    hold : {"hold", "linear", "band-limited"}
        What the input does between samples.
    """
    require_known("inter-sample behaviour", "simulate", HOLDS, hold)
    n, width = u.shape[0] - 1, u.shape[1]
    if hold == "hold":
        left = np.repeat(u[:-1], n_sub, axis=0)
        return np.stack([left, left], axis=1)
    if hold == "linear":
        nodes = np.empty((n * n_sub + 1, width))
        within, part = nodes[:-1].reshape(n, n_sub, width), np.arange(n_sub) / n_sub
        np.multiply((u[1:] - u[:-1])[:, None], part[:, None], out=within)
        within += u[:-1, None]
        nodes[-1] = u[-1]
    else:
        nodes = between_samples(u, n_sub)
    pairs = np.empty((n * n_sub, 2, width))
    pairs[:, 0], pairs[:, 1] = nodes[:-1], nodes[1:]
    return pairs


def equilibrium(compiled: Compiled, p: Array, u: Array) -> Array:
    """State at rest under constant inputs `u` (shape (n_u,)); integrators stay at zero."""
    from bondgraph.simulation.first_order_hold import blocks

    if recorded := compiled.model.recorded:  # where nothing moves, nothing has a rate
        u = np.where([n in recorded for n in compiled.inputs], 0.0, u)
    block = compiled.block(p)
    parts = blocks(compiled, block)
    a, b = parts.a, parts.b[:, : compiled.n_u] @ u
    if not a.size:
        return np.zeros(0)
    if not (np.isfinite(a).all() and np.isfinite(b).all()):  # said here: LAPACK would print it
        raise np.linalg.LinAlgError("a coefficient is infinite")
    largest = np.abs(a).max(axis=1)
    held = largest > 0.0  # a row of zeros is a pure integral of the inputs: it never rests
    scale = np.sqrt(largest[held])
    x, *_ = np.linalg.lstsq(a[held] / scale[:, None], -b[held] / scale, rcond=1e-12)
    return np.asarray(x)


def begun_with(name: str, x0: str | None, inputs: Sequence[str], first: Array) -> Array:
    """Return the inputs, shape (n_u,), under which everything rests before the first sample.

    None with nothing commanded, ``"rest"`` with the `first` inputs.
    """
    if x0 is None:
        return np.array(
            [first[i] if own_input(n, 1) is not None else 0.0 for i, n in enumerate(inputs)]
        )
    if x0 != "rest":
        raise unknown_name("start", x0, f"{name}: x0", ("rest",))
    return first


def initial_state(name: str, x0: object, states: Sequence[str]) -> Array:
    """Return a state given as an array, shape (n_x,), refused unless it is finite and fits."""
    start = np.asarray(x0, float)
    if start.shape != (len(states),) or not np.isfinite(start).all():
        raise UnusableInput(
            f"{name}: x0 has shape {start.shape}; it needs {len(states)} finite numbers, one a "
            f"state: {', '.join(states)}"
        )
    return start


def state_by_name(name: str, x0: Mapping[str, float], states: Sequence[str]) -> Array:
    """Return an initial state given by names; all must be there."""
    require_known("state", name, states, *x0)
    if missing := [n for n in states if n not in x0]:
        raise UnusableInput(f"{name}: x0 has no value for {', '.join(missing)}; give all states")
    return np.array([float(x0[n]) for n in states])
