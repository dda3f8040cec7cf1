"""Is the simulation late, or its gain off? The residual against the simulation and its slope.

A reading that is a little late, ``y(t) = g s(t - tau) + b``, leaves
``(g - 1) s - g tau ds/dt + b``: linear in the three, whatever the input. Errors come from
blocks, so that colour is in them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.statistics.blocks import block_sums
from identification.statistics.correlation import autocorrelation, pieces_of, stretches
from identification.statistics.memory import memory

SURE = 3.5


@dataclass(frozen=True)
class SimulationTiming:
    """What a delay, a gain and an offset would remove.

    Attributes
    ----------
    delay, delay_error : float, s
        Positive where the reading is later than the simulation; standard error, infinite where the
        reading does not follow the simulation at all.
    gain, gain_error : float
        Relative: 0.01 is a reading 1 % larger than the simulation.
    offset, offset_error : float, SI
        What the reading shows where the simulation is zero.
    removed : float
        Share of the mean square residual that the three remove together.
    """

    channel: str
    unit: str
    delay: float
    delay_error: float
    gain: float
    gain_error: float
    offset: float
    offset_error: float
    removed: float
    dt: float

    @property
    def words(self) -> str:
        """What of the three is there and matters (each beyond `SURE` errors, together over 5 %)."""
        if self.removed < 0.05:
            return "delay, gain and offset are right"
        said = []
        if abs(self.delay) > SURE * self.delay_error:
            late = "later" if self.delay > 0 else "earlier"
            said.append(
                f"the reading is {abs(self.delay):.3g} s ({abs(self.delay) / self.dt:.2g} samples) "
                f"{late} than the model"
            )
        if abs(self.gain) > SURE * self.gain_error:
            more = "larger" if self.gain > 0 else "smaller"
            said.append(f"{100 * abs(self.gain):.2g} % {more}")
        if abs(self.offset) > SURE * self.offset_error:
            said.append(f"shifted by {self.offset:.3g} {self.unit}".rstrip())
        if not said:
            return "delay, gain and offset are right"
        return f"{', '.join(said)}: together {100 * self.removed:.2g} % of the residual power"


def timing(
    residual: Array,
    simulated: Array,
    dt: float,
    usable: Array | None = None,
    *,
    channel: str = "",
    unit: str = "",
) -> SimulationTiming:
    """Regress a residual on the simulation, its slope and a constant.

    Parameters
    ----------
    residual, simulated : ndarray, shape (N,), SI
    dt : float, s

    Raises
    ------
    UnusableInput
        Fewer than 32 scored samples, or a simulation that does not move.
    """
    good = np.isfinite(residual) & np.isfinite(simulated)
    good = good if usable is None else good & usable
    parts = [s for s in stretches(good) if s.stop - s.start >= 3]
    count = sum(s.stop - s.start for s in parts)
    if count < 32:
        raise UnusableInput(f"{channel}: {count} samples are too few; score at least 32")
    s = np.concatenate([simulated[p] for p in parts])
    slope = np.concatenate([np.gradient(simulated[p], dt) for p in parts])
    r = np.concatenate([residual[p] for p in parts])
    scales = np.array([s.std(), slope.std(), 1.0])
    if not (scales > 0).all():
        raise UnusableInput(f"{channel}: the simulation does not move where it is scored")
    a = np.stack([(s - s.mean()) / scales[0], slope / scales[1], np.ones(r.size)], axis=1)
    gram = np.linalg.inv(a.T @ a)
    found = gram @ (a.T @ r)
    left = r - a @ found
    back = np.diag(1.0 / scales)
    back[2, 0] = -s.mean() / scales[0]  # the offset is that of a simulation at zero
    value = back @ found
    error = np.sqrt(np.diag(back @ _clustered(a, left, gram) @ back.T))
    gain = 1.0 + float(value[0])
    # what does not follow the simulation is neither late nor early
    follows = abs(gain) > SURE * float(error[0])
    delay = (float(-value[1]) / gain, float(error[1]) / abs(gain)) if follows else (0.0, np.inf)
    before = float(r @ r)
    return SimulationTiming(
        channel, unit, *delay, float(value[0]), float(error[0]), float(value[2]), float(error[2]),
        1 - float(left @ left) / before if before > 0 else 0.0, dt,
    )  # fmt: skip


def _clustered(a: Array, left: Array, gram: Array) -> Array:
    """Covariance from the sums over blocks of several memories of what is left."""
    pieces = pieces_of(left)
    n = left.size
    tau = memory(autocorrelation(pieces, min(n - 1, n // 4)), n)
    count = int(np.clip(n / max(4 * tau, n ** (1 / 3)), 4, n // 4))
    sums = block_sums(a * left[:, None], count)
    wider = count / max(count - a.shape[1], 1)
    return np.asarray(wider * gram @ (sums.T @ sums) @ gram)
