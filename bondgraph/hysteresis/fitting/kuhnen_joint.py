"""Fit plays followed by dead zones: Kuhnen's joint, convex fit, then a descent in the output error.

Sizes: N samples, n + 1 operators in the play stage, m dead zones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from bondgraph.hysteresis.checks import numbers, parameters
from bondgraph.hysteresis.errors import BadInput, BadParameter
from bondgraph.hysteresis.fitting.bank import play_advice, play_bank, play_names
from bondgraph.hysteresis.fitting.excited import Unexcited, unexcited_columns
from bondgraph.hysteresis.fitting.kuhnen_descent import KuhnenPoint, ScoredRecord, lower_error
from bondgraph.hysteresis.fitting.kuhnen_stages import Stages
from bondgraph.hysteresis.fitting.records import paired_records, require_rising
from bondgraph.hysteresis.fitting.reduction import Reduced
from bondgraph.hysteresis.fitting.starting import Past, choose_start, late_plays
from bondgraph.hysteresis.plays.ang import Ang
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.ops import FloatArray


@final
@dataclass(frozen=True, slots=True, eq=False)
class JointFit:
    """Plays followed by dead zones, fitted to a record.

    ``operator.run(x[start:], memory)[0]`` is the fitted output of the scored samples.

    Attributes
    ----------
    operator : Ang
        Both stages invertible; the output of the plays has the unit of y.
    memory : tuple of float
        Play states before sample ``start``, shape (n,), unit of x.
    start : int
        First scored sample.
    inverse_dead_zone : DeadZones
        S', on the thresholds asked for, of mean slope 1 over the range of y.
    rms : float
        Of the output error ``operator[x] - y``, unit of y.
    rms_convex : float
        The same before the descent.
    steps : int
        Accepted steps of the descent.
    active_plays, active_dead_zones : tuple of int
        Where a slope (or weight) lies on its bound.
    unexcited_plays, unexcited_dead_zones : tuple of Unexcited
        What the record does not determine, with the reasons; they have weight 0.
    """

    operator: Ang
    memory: tuple[float, ...]
    start: int
    inverse_dead_zone: DeadZones
    rms: float
    rms_convex: float
    steps: int
    active_plays: tuple[int, ...]
    active_dead_zones: tuple[int, ...]
    unexcited_plays: tuple[Unexcited, ...]
    unexcited_dead_zones: tuple[Unexcited, ...]


def fit_kuhnen(
    x: ArrayLike,
    y: ArrayLike,
    thresholds: PrandtlIshlinskii | Sequence[float] | FloatArray,
    dead_zone_thresholds: Sequence[float] | FloatArray,
    constraint: Literal["prefix_sums", "non_negative"] = "prefix_sums",
    *,
    minimum: float = 1e-3,
    memory: Past = None,
    scored_share: float = 0.5,
    max_steps: int = 20,
) -> JointFit:
    """Fit ``y = S[PI[x]]`` through the inverse S' of the output stage.

    First ``min |PI[x] - S'[y]|^2`` over the weights of both, a convex problem because S' acts on
    the measured y: all slopes positive, the mean slope of S' over the range of y equal to 1. Noise
    in y biases that, so Gauss-Newton steps in the true error ``S[PI[x]] - y`` follow; they are
    convex problems of the same kind, and a step is only taken if it lowers the error. The zero
    of y is the middle of the dead zones, so there is no free offset: remove a known one first.

    Parameters
    ----------
    x : array
        Input, shape (N,).
    y : array
        Output, shape (N,).
    thresholds : PrandtlIshlinskii or sequence of float
        Half widths of the plays, shape (n + 1,), the first one 0, strictly increasing, unit of x.
    dead_zone_thresholds : sequence of float
        Thresholds of S', shape (m,), strictly increasing, one of them 0, unit of y.
    constraint : {"prefix_sums", "non_negative"}, optional
        For the plays: slopes, or weights (all of them, w_0 strictly), not negative. The slopes
        outward from 0 of the dead zones are always positive.
    minimum : float, optional
        Smallest slope of S', and smallest slope of the plays over ``ptp(y) / ptp(x)``; between 0
        and 1.
    memory : sequence of float, "unknown" or None, optional
        Play states before the first sample, shape (n,), unit of x; None for virgin. ``"unknown"``
        scores from where the plays have forgotten the past.
    scored_share : float, optional
        With an unknown past, at least this share of the record is scored.
    max_steps : int, optional
        Largest number of Gauss-Newton steps; 0 for the convex fit alone.

    Returns
    -------
    JointFit
        Operator, errors, active bounds, unexcited operators.

    Raises
    ------
    BadInput
        If a record is constant, also from the first scored sample on, not finite (names the first
        sample) or of another length, falls where the input rises, is too short, or moves no play.
    BadParameter
        If a threshold or an option is out of its domain; names the entry.
    BadMemory
        If the memory does not fit the thresholds.

    References
    ----------
    kuhnen2003

    Examples
    --------
    >>> truth = Ang(PrandtlIshlinskii((0, 1, 2), (1, 0.5, 0.5)), DeadZones((0, 2), (1, -0.5)))
    >>> x = 5.0 * np.sin(np.linspace(0.0, 9.0, 300))
    >>> fit = fit_kuhnen(x, truth.run(x)[0], (0, 1, 2), truth.dead_zone.inverse().thresholds)
    >>> round(fit.rms, 9)
    0.0
    """
    _check(constraint, minimum, max_steps)
    plays = play_bank(thresholds)
    bends = parameters("dead_zone_thresholds", dead_zone_thresholds)
    numbers("dead_zone_thresholds", bends)
    zones = DeadZones(bends, (1.0,) * len(bends))
    record, output = paired_records(x, y)
    require_rising(record, output)
    start = choose_start(plays, record, memory, scored_share)
    used, states = start.bank(plays)
    scored = ScoredRecord(used, zones, record[start.sample :], output[start.sample :], states)
    # The matrices are small: more threads only wait for each other, badly on a busy machine.
    with threadpool_limits(1, user_api="blas"):
        setup = _set_up(scored, minimum, prefix_sums=constraint == "prefix_sums")
        convex = _convex(scored, setup)
        found, steps = lower_error(scored, setup.stages, convex, max_steps)
    play_weights, zone_weights = setup.stages.weights(found.slopes, len(plays.thresholds))
    forward = PrandtlIshlinskii(plays.thresholds, tuple(play_weights.tolist()))
    inverse = DeadZones(zones.thresholds, tuple(zone_weights.tolist()))
    columns, k = np.concatenate((setup.stages.plays, setup.stages.zones)), setup.stages.plays.size
    return JointFit(
        operator=Ang(forward, inverse.inverse()),
        memory=start.memory,
        start=start.sample,
        inverse_dead_zone=inverse,
        rms=found.cost,
        rms_convex=convex.cost,
        steps=steps,
        active_plays=tuple(columns[:k][found.on_bound[:k]].tolist()),
        active_dead_zones=tuple(columns[k:][found.on_bound[k:]].tolist()),
        unexcited_plays=(*setup.silent_plays, *late_plays(play_names(plays), used.n_memory + 1)),
        unexcited_dead_zones=setup.silent_zones,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Setup:
    """The unknowns, the reduced columns they weigh, and the operators left out."""

    stages: Stages
    triangle: FloatArray
    silent_plays: tuple[Unexcited, ...]
    silent_zones: tuple[Unexcited, ...]


def _set_up(scored: ScoredRecord, minimum: float, *, prefix_sums: bool) -> _Setup:
    """Reduce the record and choose the operators it says something about."""
    reduced = scored.reduced()
    n = scored.plays.n_memory + 1
    if reduced.n_rows < reduced.lowest.size:
        raise BadInput(
            f"{reduced.n_rows} samples cannot determine {n} plays and "
            f"{len(scored.zones.thresholds)} dead zones; record more or take fewer"
        )
    plays, silent_plays = _moving_plays(reduced, scored.plays, scored.x)
    zones, silent_zones = _moving_zones(reduced, n, scored.zones, scored.y)
    for name, moving, record in (("x", plays, scored.x), ("y", zones, scored.y)):
        if not moving:
            raise BadInput(
                f"{name} is constant at {record[0]:g} over the {record.size} samples that are "
                "scored, once the unknown past is forgotten; give the memory, record on, or raise "
                "scored_share to begin earlier"
            )
    bounds = np.full(len(plays), minimum * np.ptp(scored.y) / np.ptp(scored.x))
    if not prefix_sums:
        bounds[1:] = 0.0
    stages = Stages.build(
        np.array(plays),
        np.array(zones),
        scored.zones,
        bounds,
        minimum,
        (min(0.0, float(scored.y.min())), max(0.0, float(scored.y.max()))),
        prefix_sums=prefix_sums,
    )
    columns = [*plays, *(n + j for j in zones)]
    return _Setup(stages, reduced.triangle[:, columns], silent_plays, silent_zones)


def _convex(scored: ScoredRecord, setup: _Setup) -> KuhnenPoint:
    """Solve the convex problem."""
    weight = float(np.linalg.norm(scored.y))
    slopes, on_bound = setup.stages.solve(setup.triangle, np.zeros(setup.triangle.shape[0]), weight)
    return KuhnenPoint(slopes, on_bound, scored.rms(setup.stages, slopes))


def _check(constraint: str, minimum: float, max_steps: int) -> None:
    if constraint not in ("prefix_sums", "non_negative"):
        raise BadParameter(
            f"constraint = {constraint!r} is unknown; take 'prefix_sums' or 'non_negative'"
        )
    if not 0.0 < minimum < 1.0:
        raise BadParameter(f"minimum = {minimum} must lie between 0 and 1, far below 1")
    if max_steps < 0:
        raise BadParameter(f"max_steps = {max_steps} must not be negative")


def _moving_plays(
    reduced: Reduced, plays: PrandtlIshlinskii, x: FloatArray
) -> tuple[list[int], tuple[Unexcited, ...]]:
    n = plays.n_memory + 1
    return unexcited_columns(
        reduced.triangle[:, :n],
        reduced.lowest[:n],
        reduced.highest[:n],
        play_names(plays),
        play_advice(float(np.ptp(x))),
        offset=reduced.triangle[:, :0],
    )


def _moving_zones(
    reduced: Reduced, n_plays: int, zones: DeadZones, y: FloatArray
) -> tuple[list[int], tuple[Unexcited, ...]]:
    names = [f"dead zone {j} (d' = {d:g})" for j, d in enumerate(zones.thresholds)]
    advice = f"y runs from {y.min():g} to {y.max():g} and does not pass the threshold"
    return unexcited_columns(
        reduced.triangle[:, n_plays:],
        reduced.lowest[n_plays:],
        reduced.highest[n_plays:],
        names,
        advice,
        offset=reduced.triangle[:, :0],
        first=zones.zero_index,
    )
