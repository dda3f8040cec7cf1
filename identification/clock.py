"""Two clocks: what a difference between the clocks of drive and sensor does, and its removal.

The drive plays its samples by one clock, the sensor takes its own by another. A sensor sample with
the nominal time ``t`` is really taken at ``t + d(t)`` of the drive's clock,

    d(t) = delay + integral of eps(s) ds from 0 to t,

with the ratio error ``eps`` (1e-6 is one part per million). `identification.clock_phase` and
`identification.clock_fit` estimate it from the recording; `synchronised` takes it out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput

__all__ = [
    "ClockMap",
    "ratio_basis",
    "resampled",
    "synchronised",
    "thickness_from_misfit",
]

FloatArray = NDArray[np.float64]
HALF_TAPS = 16
"""Samples on either side that a band-limited value is made of."""


@dataclass(frozen=True, slots=True)
class ClockMap:
    """Drive time over sensor time.

    Parameters
    ----------
    ratio : tuple of float
        ``eps`` at the knots; linear in between. One number: constant.
    knots : tuple of float
        s, increasing; as many as ratios, or none for a constant ratio.
    delay : float
        ``d(0)``, s: the first sensor sample is taken so much after the first of the drive.

    Raises
    ------
    UnusableInput
        If the numbers do not fit together, or time would run backwards.

    Examples
    --------
    >>> round(float(ClockMap((100e-6,)).misfit(10.0)), 9)
    0.001
    """

    ratio: tuple[float, ...]
    knots: tuple[float, ...] = ()
    delay: float = 0.0

    def __post_init__(self) -> None:
        """Check the map."""
        if len(self.ratio) == 0 or (len(self.ratio) > 1 and len(self.knots) != len(self.ratio)):
            raise UnusableInput(
                f"clock map: {len(self.ratio)} ratios need as many knots, not {len(self.knots)}"
            )
        if len(self.knots) > 1 and not np.all(np.diff(self.knots) > 0):
            raise UnusableInput("clock map: the knots must increase")
        if not all(math.isfinite(v) and v > -1.0 for v in self.ratio):
            raise UnusableInput(f"clock map: ratio errors {self.ratio} let time run backwards")

    def misfit(self, time: ArrayLike) -> FloatArray:
        """Return ``d(t)``, s, at sensor times (s)."""
        t = np.asarray(time, float)
        return np.asarray(self.delay + ratio_basis(t, self.knots) @ np.asarray(self.ratio))

    def to_drive(self, time: ArrayLike) -> FloatArray:
        """Return drive times of sensor times, s."""
        t = np.asarray(time, float)
        return t + self.misfit(t)

    def to_sensor(self, time: ArrayLike) -> FloatArray:
        """Return sensor times of drive times, s."""
        target = np.asarray(time, float)
        t = target.copy()
        # a contraction by the ratio error: three digits or more a step
        for _ in range(60):
            step = target - self.to_drive(t)
            t = t + step
            if float(np.abs(step).max(initial=0.0)) < 1e-15 * (1 + float(np.abs(t).max())):
                break
        return t


def ratio_basis(time: ArrayLike, knots: tuple[float, ...] = ()) -> FloatArray:
    """Return the integrals from 0 to t of the hats at the knots, shape (..., K); just t without.

    Beyond the outer knots the ratio keeps its slope.
    """
    t = np.asarray(time, float)
    if len(knots) < 2:
        return np.asarray(t[..., None])
    integral = make_interp_spline(np.asarray(knots), np.eye(len(knots)), k=1).antiderivative()
    return np.asarray(integral(t) - integral(0.0))


def thickness_from_misfit(stroke: float, frequency: float, misfit: float) -> float:
    """Return the thickness that a time misfit alone gives to the loop of a sine.

    ``x = (X/2) sin(w (t + d))`` over ``u = sin(w t)`` is an ellipse that meets the middle of the
    input at ``+- (X/2) sin(w d)``: thickness ``X |sin(2 pi f d)|``, about ``2 pi f d X``. Put into
    an open hysteresis loop, a misfit adds to the thickness or takes away, by its sign.

    Parameters
    ----------
    stroke : float
        X, peak to peak.
    frequency : float
        Hz.
    misfit : float
        d, s: delay, or ratio error times the time since the common start.

    Examples
    --------
    100 ppm after 10.49 s, on a stroke of 4.4 um at 2 Hz, in nm:

    >>> round(1e9 * thickness_from_misfit(4.4e-6, 2.0, 100e-6 * 10.49))
    58
    """
    return stroke * abs(math.sin(2 * math.pi * frequency * misfit))


def resampled(
    time: ArrayLike, values: ArrayLike, wanted: ArrayLike, method: str = "band-limited"
) -> FloatArray:
    """Return evenly sampled values at other instants.

    Parameters
    ----------
    time : array, shape (N,), s
        Even.
    values : array, shape (N,)
    wanted : array, shape (M,), s
        Within the record.
    method : {"band-limited", "cubic"}
        A windowed sinc over 32 samples (Kaiser, flat to 0.8 of the Nyquist frequency), or a cubic
        spline.

    Raises
    ------
    UnusableInput
        If an instant lies outside of the record, or the method is unknown.
    """
    t, x, at = (np.asarray(a, float) for a in (time, values, wanted))
    step = (t[-1] - t[0]) / (t.size - 1)
    position = (at - t[0]) / step
    if position.size and (position.min() < -1e-6 or position.max() > t.size - 1 + 1e-6):
        raise UnusableInput("resampling: an instant lies outside of the record; trim it first")
    if method == "cubic":
        return np.asarray(make_interp_spline(t, x, k=3)(at))
    if method != "band-limited":
        raise UnusableInput(f"resampling: no method {method!r}; take 'band-limited' or 'cubic'")
    padded = np.pad(x, HALF_TAPS, mode="reflect", reflect_type="odd")
    whole = np.clip(np.floor(position).astype(int), 0, t.size - 2)
    offsets = np.arange(1 - HALF_TAPS, HALF_TAPS + 1)
    distance = (position - whole)[:, None] - offsets
    inside = np.clip(1 - (distance / HALF_TAPS) ** 2, 0.0, None)
    taps = np.sinc(distance) * np.i0(8.0 * np.sqrt(inside))
    taps /= taps.sum(axis=1, keepdims=True)
    picked = padded[whole[:, None] + offsets + HALF_TAPS]
    return np.asarray(np.einsum("ij,ij->i", taps, picked))


def synchronised(
    recording: Recording,
    clock: ClockMap,
    sensors: tuple[str, ...] = ("x",),
    method: str = "band-limited",
) -> Recording:
    """Return the recording with its sensors resampled to the drive's clock.

    Parameters
    ----------
    recording : Recording
        Drive and sensors by nominal time.
    clock : ClockMap
    sensors : tuple of str
        Channels that were taken by the sensor's clock; the others stay.
    method : {"band-limited", "cubic"}

    Returns
    -------
    Recording
        Without the ends that the sensor did not cover.

    Raises
    ------
    UnusableInput, UnknownName
    """
    t = recording.time
    at = clock.to_sensor(t)
    keep = np.flatnonzero((at >= t[0]) & (at <= t[-1]))
    if keep.size < 2:
        raise UnusableInput(f"{recording.name}: drive and sensor have no time in common")
    part = recording.slice(int(keep[0]), int(keep[-1]) + 1)
    moved = {
        n: resampled(t, recording[n], at[keep[0] : keep[-1] + 1], method) if n in sensors else v
        for n, v in part.channels.items()
    }
    for n in sensors:
        recording.channel(n)
    shift = clock.misfit(np.array([t[0], t[-1]]))
    note = (
        f"{', '.join(sensors)} moved to the clock of the drive: {1e6 * shift[0]:.4g} us at the "
        f"start, {1e6 * shift[1]:.4g} us at the end"
    )
    meta = {**recording.meta, "notes": (*recording.notes, note)}
    return replace(part, channels=moved, meta=meta)
