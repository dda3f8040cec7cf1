"""Take linear creep and a delay out of records, so that what is left is an operator's output.

With creep ``y = C[h]``, ``C = 1 + sum c_j / (1 + tau_j s)``, the inverse is of the same kind,
``h = y - sum c'_j L_j[y]`` with lags L_j of time constants tau'_j. For given tau' that is linear in
c' and in the weights of plain plays, so both are one least-squares problem, and what creeps on from
before a record is another exponential each. (Krejci and Kuhnen, 2001, for the model.)

Sizes: N samples of a record, m units.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import final

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.support.ops import FloatArray

WORTHWHILE = 0.1
"""Creep is taken out if that lowers the held-out error of plain plays by this share."""
MOST = 0.5
"""Sum of the c'_j; where more would creep than moves at once, it is no creep."""
LONGEST_DELAY = 4.0
"""Samples."""
_FASTEST = (0.02, 0.2)
"""Between these lies the shortest time constant (s); the others follow by decades."""
_WIDTHS = np.array([*np.arange(1, 17) / 32, 0.6, 0.7, 0.8, 0.9])
"""Half widths of the plain plays, over the swing."""
_ROWS = 4000


@final
@dataclass(frozen=True, slots=True, eq=False)
class WithoutCreep:
    """Records without creep and delay.

    Attributes
    ----------
    records : LoopRecords
    delay : float
        Samples by which the outputs came behind.
    creep : KelvinVoigtCreep or None
        What was taken out.
    """

    records: LoopRecords
    delay: float
    creep: KelvinVoigtCreep | None


def without_creep(records: LoopRecords, step: float) -> WithoutCreep:
    """Take out a delay, and creep where the held-out samples know of it.

    The delay and the common scale of the time constants are chosen over all samples, as a single
    ramp cannot tell a delay from wider plays; weights come from the samples that are fitted.

    Parameters
    ----------
    records : LoopRecords
    step : float
        Time between samples, s.
    """
    longest = step * max(x.size for x in records.inputs)
    units = 1 + math.floor(math.log10(max(longest / _FASTEST[0], 1.0)))

    def solved(delay: float, power: float | None) -> _Solved:
        decades = np.zeros(0) if power is None else power + np.arange(units, dtype=np.float64)
        return _solved(records.delayed(delay), np.asarray(10.0**decades), step)

    delay = _least(lambda d: solved(d, None).error, 0.0, LONGEST_DELAY)
    plain, late, power = solved(delay, None), delay, -1.0
    for _ in range(2):
        power = _least(partial(_error_of_power, solved, late), *np.log10(_FASTEST))
        late = _least(partial(_error_of_delay, solved, power), 0.0, LONGEST_DELAY)
    crept = solved(late, power)
    known = crept.held_out < (1.0 - WORTHWHILE) * plain.held_out
    if not (known and 0.0 < crept.weights.sum() < MOST):
        return WithoutCreep(records.delayed(delay), delay, None)
    free = replace(records.delayed(late), outputs=crept.outputs)
    return WithoutCreep(free, late, forward_creep(crept.weights, crept.times))


def forward_creep(weights: FloatArray, times: FloatArray) -> KelvinVoigtCreep:
    """Return the creep whose inverse is ``1 - sum c'_j / (1 + tau'_j s)``, c'_j >= 0.

    Poles and residues of ``prod (1 + tau'_j s) / (prod (1 + tau'_j s) - sum c'_j prod_others)``.

    Examples
    --------
    >>> creep = forward_creep(np.array([0.5]), np.array([1.0]))
    >>> creep.weights, creep.times
    ((1.0,), (2.0,))
    """
    used = weights > 0.0
    c, tau = weights[used], times[used]
    over = np.poly1d([1.0])
    for t in tau:
        over *= np.poly1d([t, 1.0])
    under = over
    for j, (w, _) in enumerate(zip(c, tau, strict=True)):
        others = np.poly1d([1.0])
        for t in np.delete(tau, j):
            others *= np.poly1d([t, 1.0])
        under = under - w * others
    poles = np.sort(np.real(under.roots))
    # residue r at pole p is c / (1 + tau s) with tau = -1/p, c = r tau
    residues = over(poles) / under.deriv()(poles)
    found = sorted((-1.0 / p, -r / p) for p, r in zip(poles, residues, strict=True))
    return KelvinVoigtCreep(
        1.0, tuple(float(v) for _, v in found), tuple(float(t) for t, _ in found)
    )


def _error_of_power(solved: Callable[..., _Solved], delay: float, power: float) -> float:
    return solved(delay, power).error


def _error_of_delay(solved: Callable[..., _Solved], power: float, delay: float) -> float:
    return solved(delay, power).error


def _least(error: Callable[[float], float], low: float, high: float) -> float:
    found = minimize_scalar(error, bounds=(low, high), method="bounded", options={"xatol": 0.02})
    return float(found.x)


@dataclass(frozen=True, slots=True, eq=False)
class _Solved:
    """tau' and c', outputs without creep, rms over what was fitted and what was held out."""

    times: FloatArray
    weights: FloatArray
    outputs: tuple[FloatArray, ...]
    seen: float
    held_out: float

    @property
    def error(self) -> float:
        """Of both."""
        return math.hypot(self.seen, self.held_out)


def _solved(records: LoopRecords, times: FloatArray, step: float) -> _Solved:
    train, test = records.split()
    lags = [np.column_stack([_lag(y, t, step) for t in times] or [y[:, None][:, :0]])
            for y in records.outputs]  # fmt: skip
    fades = [
        1.0 - np.exp(-step * np.arange(y.size)[:, None] / times)
        if past.size else np.zeros((y.size, 0))
        for y, past in zip(records.outputs, records.histories, strict=True)
    ]  # fmt: skip
    a, y, sizes = _system(train, lags, fades)
    used = np.linalg.norm(a, axis=0) > 0.0
    m = times.size
    found = np.zeros(a.shape[1])
    for _ in range(m + 1):
        found[:] = 0.0
        found[used] = np.linalg.lstsq(a[:, used], y, rcond=None)[0]
        negative = np.flatnonzero(found[:m] < 0.0)
        if not negative.size:
            break
        # creep that runs back is none
        used[negative] = False
    seen = float(np.sqrt(np.mean((a @ found - y) ** 2)))
    b, z, _ = _system(test, lags, fades, own=False)
    rest = z - b @ found[: b.shape[1]]
    own = _own_fades(test, fades)
    start: FloatArray = np.zeros(own.shape[1])
    if start.size:
        start = np.asarray(np.linalg.lstsq(own, rest, rcond=None)[0], dtype=np.float64)
    held = float(np.sqrt(np.mean((rest - own @ start) ** 2)))
    begun = np.split(found[b.shape[1] :], np.cumsum(sizes)[:-1])
    if len(records.inputs) > 1:
        begun[-1] = start
    outputs = tuple(
        y - lag @ found[:m] - fade @ b
        for y, lag, fade, b in zip(records.outputs, lags, fades, begun, strict=True)
    )
    return _Solved(times, found[:m], outputs, seen, held)


def _system(
    records: LoopRecords, lags: list[FloatArray], fades: list[FloatArray], *, own: bool = True
) -> tuple[FloatArray, FloatArray, list[int]]:
    """Return columns (lags, plays, fades of each record) and target of every few scored rows."""
    step = max(1, records.size // _ROWS)
    thin = replace(records, scored=tuple(rows[::step] for rows in records.scored))
    now, then = (p.columns for p in thin.plays(records.swing * _WIDTHS))
    late = np.concatenate([lag[rows] for lag, rows in zip(lags, thin.scored, strict=True)])
    sizes = [fade.shape[1] for fade in fades]
    columns = [late, now - then]
    if own:
        blocks = [
            np.pad(fade[rows], ((0, 0), (sum(sizes[:i]), sum(sizes[i + 1 :]))))
            for i, (fade, rows) in enumerate(zip(fades, thin.scored, strict=True))
        ]
        columns.append(np.concatenate(blocks))
    return np.hstack(columns), thin.target, sizes


def _own_fades(test: LoopRecords, fades: list[FloatArray]) -> FloatArray:
    """Return the fades of the record that is held out, none if it is the end of one."""
    step = max(1, test.size // _ROWS)
    if len(test.inputs) == 1:
        return np.zeros((test.scored[0][::step].size, 0))
    return fades[-1][test.scored[-1][::step]]


def _lag(y: FloatArray, time: float, step: float) -> FloatArray:
    """Return ``tau l' = y - l`` from rest, exact for an input that is linear between samples."""
    q = step / time
    e = math.exp(-q)
    share = (1.0 - e) / q
    return np.asarray(lfilter([1.0 - share, share - e], [1.0, -e], y - y[0]))
