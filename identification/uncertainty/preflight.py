"""What is wrong with data and start, said before a fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bondgraph.graph.sensors import Sensor
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from identification.statistics.blocks import block_means
from identification.study.admission import require_time_step
from identification.study.problem import Problem
from identification.study.study import Study
from identification.uncertainty.finding import Finding
from identification.uncertainty.fitted import fitted
from identification.uncertainty.information import Sensitivities
from identification.uncertainty.linear_speeds import speeds

INVISIBLE = 2.0
"""Total change of the readings, in noise, for a factor of ten of a parameter."""
GROWTH = 100.0
AGAINST = -0.7
"""Correlation of a reading with the simulation at the start below which it looks reversed."""


def preflight(study: Study) -> tuple[Finding, ...]:
    """Return what a user should know before fitting; empty if nothing stands out.

    Constant readings and commands, stuck readings, a start that is not finite or grows, gains off
    by a thousand, parameters that the commands do not excite, samples too slow or records too
    short for the time constants that free parameters decide, drift.
    """
    found: list[Finding] = []
    stack = study.stack()
    for name, p in zip(study.record_names, stack.problems, strict=False):
        found += _still(name, p)
        found += _stuck(name, p)
    point = stack.start()
    with np.errstate(all="ignore"):
        made = stack.evaluate(point)
    whole = True
    for name, p, e in zip(study.record_names, stack.problems, made, strict=False):
        first = _first_bad(e.y)
        if first is not None:
            whole = False
            found.append(_not_finite(name, p, first))
            continue
        found += _pace(name, p)
        found += _gains(name, p, e.y)
        if not any(abs(s.rate) * p.data.dt * p.data.n < 1e-6 for s in speeds(p)):
            found += _drift(name, p, e.y)  # an integrator drifts by itself
    if any(f.kind in ("unit", "constant reading") for f in found):
        return tuple(found)  # what counts in noise would be off, or has no floor
    if whole and all(np.isfinite(e.jacobian).all() for e in made):
        with np.errstate(all="ignore"):
            s = fitted(stack, point, made).sensitivities
            change = _change(s)
        found += _unexcited(s.names, change)
    return tuple(found)


def require_motion(study: Study) -> None:
    """Refuse recordings in which no reading moves: there is nothing to fit.

    Raises
    ------
    UnusableInput
        Names the first such reading, or a recording of a single sample.
    """
    for r in study.recordings:
        require_time_step(r)
    sensors = [s.name for s in study.graph.of_type(Sensor)]
    readings = [(r.name, n, r[n]) for r in study.recordings for n in sensors if n in r.channels]
    if readings and all(float(v.max() - v.min()) == 0.0 for _, _, v in readings):
        record, sensor, _ = readings[0]
        raise UnusableInput(
            f"{record}: {sensor} is constant: nothing can be fitted; excite the system and check "
            "the sensor"
        )


def _change(s: Sensitivities) -> FloatArray:
    return np.asarray(s.strength * np.where(np.array(s.log, bool), np.log(10.0), 1.0))


def _still(name: str, p: Problem) -> Iterator[Finding]:
    moving = [n for n, v in p.data.commands.items() if np.ptp(v) > 1e-12 * np.abs(v).max()]
    train = p.data.mask("train")
    for c, n in enumerate(p.data.names):
        y = p.data.readings[train, c]
        if y.size and np.ptp(y) <= 1e-12 * max(float(np.abs(y).max()), 1e-300):
            yield Finding(
                "constant reading", f"{n} is {y[0]:.4g} in all {y.size} training samples",
                f"{name}, {n}", "it says nothing about any parameter",
                "check column and cable, or leave the sensor out",
            )  # fmt: skip
    if p.data.commands and not moving:
        yield Finding(
            "constant command", f"{', '.join(p.data.commands)} never move", name,
            "only the decay of the initial state can say something",
            "check the column, or record with a moving command",
        )  # fmt: skip


def _stuck(name: str, p: Problem) -> Iterator[Finding]:
    for c, n in enumerate(p.data.names):
        y = p.data.readings[:, c]
        if y.size < 100 or np.ptp(y) == 0:
            continue
        changed = np.flatnonzero(np.diff(y) != 0)
        edges = np.concatenate([[-1], changed, [y.size - 1]])
        longest = int(np.argmax(np.diff(edges)))
        start, length = int(edges[longest]) + 1, int(np.diff(edges)[longest])
        part = slice(start, start + length)
        drives = [v for v in p.data.commands.values() if np.ptp(v) > 0]
        moves = any(np.ptp(v[part]) > 0.2 * np.ptp(v) for v in drives)
        # quantised readings repeat often; a hold-up is much longer than the usual repeats
        usual = float(np.median(np.diff(edges)))
        if moves and length > max(0.03 * y.size, 20 * usual):
            at = p.data.time[start]
            yield Finding(
                "stuck reading", f"{n} stays at {y[start]:.4g} for {length} samples from "
                f"{at:.4g} s on", f"{name}, {n}", "while a command moves: overload or drop-out",
                "cut these samples out, or set the range anew",
            )  # fmt: skip


def _first_bad(y: FloatArray) -> int | None:
    bad = ~np.isfinite(y).all(axis=1)
    return int(np.argmax(bad)) if bad.any() else None


def _not_finite(name: str, p: Problem, first: int) -> Finding:
    grows = [s for s in speeds(p) if s.rate.real > 0]
    why = "the start values make no bounded motion"
    if grows:
        s = max(grows, key=lambda g: g.rate.real)
        why = f"at the start values it grows like exp({s.rate.real:.3g} t)"
    return Finding(
        "start not finite", f"simulated readings are not finite from sample {first} on", name, why,
        "give other starts, or fit by multiple_shooting or prediction_error",
    )  # fmt: skip


def _pace(name: str, p: Problem) -> Iterator[Finding]:
    dt = p.data.dt
    duration = dt * p.data.n
    found = speeds(p)
    unstable = [s for s in found if s.rate.real * duration > np.log(GROWTH)]
    if unstable:
        s = max(unstable, key=lambda g: g.rate.real)
        yield Finding(
            "unstable start", f"a motion grows like exp({s.rate.real:.3g} t), by "
            f"10^{s.rate.real * duration / np.log(10):.0f} over the record", name,
            "a free run forgets everything but its initial state",
            "check signs and starts, or fit by multiple_shooting or prediction_error",
        )  # fmt: skip
    fast = [s for s in found if s.names and abs(s.rate) * dt > np.pi]
    if fast:
        s = min(fast, key=lambda g: abs(g.rate))
        yield Finding(
            "slow samples", f"a motion at {abs(s.rate) / 2 / np.pi:.3g} Hz lies beyond half the "
            f"sampling rate of {1 / dt:.4g} Hz", f"{name}, {', '.join(s.names)}",
            "what acts only there does not show between the samples",
            "sample faster, or fix these parameters",
        )  # fmt: skip
    slow = [s for s in found if s.names and 0 < abs(s.rate) * duration < 1]
    if slow:
        s = min(slow, key=lambda g: abs(g.rate))
        yield Finding(
            "short record", f"a motion takes {1 / abs(s.rate):.3g} s, the record {duration:.3g} s",
            f"{name}, {', '.join(s.names)}", "its end is not seen", "record for longer",
        )  # fmt: skip


def thousand(ratio: float) -> int | None:
    """Return the power of 1000 a positive ratio is near to, if any (within a factor of 3)."""
    if not ratio > 0 or not np.isfinite(ratio):
        return None
    power = float(np.log10(ratio) / 3.0)
    near = round(power)
    return near if near and abs(power - near) < np.log10(3.0) / 3.0 else None


def _gains(name: str, p: Problem, y: FloatArray) -> Iterator[Finding]:
    train = p.data.mask("train")
    for c, n in enumerate(p.data.names):
        measured, simulated = (_bare(v[train, c]) for v in (p.data.readings, y))
        a, b = float(measured.std()), float(simulated.std())
        if not a > 3 * p.data.floor[c] or not b > 1e-9 * float(np.abs(y[:, c]).max()):
            continue
        power = thousand(a / b)
        if float(np.corrcoef(measured, simulated)[0, 1]) < AGAINST:
            yield Finding(
                "sign", f"{n} moves against the model at its start values", f"{name}, {n}",
                "a reversed sensor, command or half arrow would be taken for physics",
                "check the signs of this channel and of the commands",
            )  # fmt: skip
        if power is not None:
            yield Finding(
                "unit", f"{n} moves {a / b:.3g} times as much as the model at its start values",
                f"{name}, {n}", f"a factor near {1000.0**power:g} is mostly a unit (mm for m, mV "
                "for V)", "check the unit of this channel and of the commands",
            )  # fmt: skip
        elif abs(np.log10(a / b)) > 1.5:
            yield Finding(
                "start far off", f"{n} moves {a / b:.3g} times as much as the model at its start "
                "values", f"{name}, {n}", "a descent from there may end elsewhere",
                "give starts nearer to the plant, or use many starts",
            )  # fmt: skip


def _bare(y: FloatArray) -> FloatArray:
    t = np.linspace(-1.0, 1.0, y.size)
    return np.asarray(y - np.polyval(np.polyfit(t, y, 1), t)) if y.size > 3 else y * 0.0


def _drift(name: str, p: Problem, y: FloatArray) -> Iterator[Finding]:
    train = p.data.mask("train")
    count = int(train.sum())
    if count < 100:
        return
    t = np.linspace(-0.5, 0.5, count)
    for c, n in enumerate(p.data.names):
        measured = p.data.readings[train, c]
        basis = np.column_stack([np.ones(count), t, y[train, c], np.gradient(y[train, c])])
        size = np.linalg.norm(basis, axis=0)
        basis = basis[:, size > 0]
        found, *_ = np.linalg.lstsq(basis / size[size > 0], measured, rcond=1e-10)
        slope = float(found[1] / size[size > 0][1])
        left = measured - basis / size[size > 0] @ found
        # the spread of what is left counts with its memory: blocks of a twentieth
        error = float(block_means(left, 20).std() / np.sqrt(20)) * np.sqrt(12.0)
        if abs(slope) > max(0.2 * float(measured.std()), 6 * error, 10 * p.data.floor[c]):
            yield Finding(
                "drift",
                f"{n} moves by {slope:.3g} (SI) over the record beside what the commands make",
                f"{name}, {n}", "slow physics that the model lacks (heating, creep), or the sensor",
                "add it to the model or let a diagnosis name it; take out only what drifts in "
                "the sensor itself",
            )  # fmt: skip


def _unexcited(names: Sequence[str], change: FloatArray) -> Iterator[Finding]:
    for n, size in zip(names, change, strict=True):
        if size < INVISIBLE:
            yield Finding(
                "unexcited parameter", f"a factor of ten moves all readings together by {size:.2g} "
                "standard deviations of the noise at the start values", n,
                "these recordings do not determine it",
                "fix it, or record with a command that reaches it",
            )  # fmt: skip
