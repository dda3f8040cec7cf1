"""Noise floor of a reading, before any model: from repeats, a rest, or the top of the spectrum."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bondgraph.signals.recording import Recording, Split
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.statistics.periods import repeats

RELATIVE_LEAST = 1e-5


def noise_floor(
    recording: Recording,
    split: Split,
    sensors: tuple[str, ...],
    commands: tuple[str, ...] = (),
    breaks: tuple[int, ...] = (),
) -> dict[str, float]:
    """Return standard deviation of the noise of each sensor, SI; see `read_noise`."""
    return {n: r[0] for n, r in read_noise(recording, split, sensors, commands, breaks).items()}


def read_noise(
    recording: Recording,
    split: Split,
    sensors: tuple[str, ...],
    commands: tuple[str, ...] = (),
    breaks: tuple[int, ...] = (),
) -> dict[str, tuple[float, bool]]:
    """Return standard deviation of the noise of each sensor, SI, and whether it was measured.

    Where all commands repeat themselves exactly, the noise is what two neighbouring periods differ
    by, white or not. A rest of at least 200 samples gives it directly (less its slow trend), where
    it is no more than the colour of noise may add to a white level.
    Otherwise it is not measured, but taken as white at the level of the highest fifth of the
    spectrum, where plants answer least; so also where periods differ by far more than that
    (something acts that does not repeat, or slow noise), and then by an eighth of what they differ
    by at least. Never less than the rounding of the converter or 1e-5 of the spread.

    Parameters
    ----------
    breaks : tuple of int
        Where further recordings begin: the jumps between them are no noise, so each is read alone
        and the mean square counts.
    """
    if breaks:
        alone = _alone(recording, split, breaks)
        reads = [read_noise(r, s, sensors, commands) for r, s in alone]
        sizes = [r.n / recording.n for r, _ in alone]
        squares = {
            n: sum(w * r[n][0] ** 2 for w, r in zip(sizes, reads, strict=True)) for n in sensors
        }
        return {n: (float(np.sqrt(v)), all(r[n][1] for r in reads)) for n, v in squares.items()}
    found = {}
    moving = [np.asarray(recording[c]) for c in commands if np.ptp(recording[c]) > 0]
    again = repeats(moving) if moving else None
    rest = split.rest
    rests = rest is not None and rest.stop - (rest.start or 0) >= REST
    for n in sensors:
        y = np.asarray(recording[n])
        level = _repeat_level(y, *again) if again is not None else np.inf
        repeated = again is not None and _is_noise(level, y)
        resting = _rest_level(y[rest]) if rests else np.inf
        still = rests and _is_noise(resting, y[rest])
        if repeated:
            sigma = level
        elif still:
            sigma = resting
        else:
            sigma = _white_level(y)
            if np.isfinite(level):  # as far as its colour could go, it may be noise after all
                sigma = max(sigma, level / NEARLY)
        least = max(_rounding(y), RELATIVE_LEAST * float(y.std()), 1e-300)
        found[n] = max(sigma, least), repeated or still
    return found


def _alone(
    whole: Recording, split: Split, breaks: tuple[int, ...]
) -> list[tuple[Recording, Split]]:
    """Return each recording with the split, whose rest is that of the first one."""
    ends = pairwise((0, *breaks, whole.n))
    return [(whole.slice(a, b), replace(split, rest=None) if a else split) for a, b in ends]


COLOURED = 12.0
"""Level over that read off the top of the spectrum, above which the colour of noise that is seldom
slower does not explain it."""
SLOWEST = 15.0
"""The same for what periods differ by, which is known."""
NEARLY = 8.0
"""The same with room for what a floor is allowed to be wrong by."""


def _is_noise(level: float, y: Array) -> bool:
    """Whether what periods differ by may be noise, not a push that does not come again.

    A filter may leave nothing at the top of the spectrum; then that tells nothing.
    """
    white = _white_level(y)
    silent = white < max(_rounding(y), RELATIVE_LEAST * float(y.std()))
    return silent or level <= SLOWEST * white


REST = 200
"""Samples of a rest that tell the noise."""


def _repeat_level(y: Array, lag: int, runs: list[slice]) -> float:
    """Level of the quietest stretch and of all that differ from it by chance only."""
    found = [_steady_power(y, lag, s) for s in runs]
    least, freedom = min(found)
    alike = [(p, f) for p, f in found if p <= least * (1.0 + SURE * np.sqrt(2 / f + 2 / freedom))]
    return float(np.sqrt(np.average([p for p, _ in alike], weights=[f for _, f in alike])))


SURE = 2.5
"""Standard deviations from which one stretch is louder than another."""


def _steady_power(y: Array, lag: int, run: slice) -> tuple[float, float]:
    """Power of the noise from the last period back until a transient shows; degrees of freedom."""
    powers: list[float] = []
    freedom = 0.0
    for end in range(run.stop, run.start, -lag):
        begin = max(run.start, end - lag)
        if end - begin < min(lag, 4 * PIECES) and powers:
            break  # the rest of a period tells nothing
        apart = y[begin + lag : end + lag] - y[begin:end]
        # a stretch begins in motion: a third of its first period is left out
        pieces = np.array_split(apart, PIECES)[PIECES // 3 if begin == run.start else 0 :]
        known = [float(np.mean(p**2)) for p in pieces if p.size]
        if not known:
            break
        degrees = max(FEWEST, pieces[-1].size / _memory(np.concatenate(pieces)))
        # the median of a mean square of few degrees of freedom lies below its mean (Wilson and
        # Hilferty 1931)
        power = float(np.median(known)) / 2.0 / (1.0 - 2.0 / (9.0 * degrees)) ** 3
        if powers and power > 1.5 * float(np.mean(powers)):
            break
        powers.append(power)
        freedom += degrees * len(known)
    return (float(np.mean(powers)), freedom) if powers else (np.inf, 1.0)


FEWEST = 3.0
"""Degrees of freedom of a part at least: what is slower than that may be a transient, no noise."""


def _memory(noise: Array) -> float:
    """Return the samples that tell as much of a power as one of white noise: 1 + 2 sum rho_k^2."""
    spectrum = np.abs(np.fft.rfft(noise - noise.mean(), 2 * noise.size)) ** 2
    rho = np.fft.irfft(spectrum)[: noise.size // PIECES]
    rho = rho[1:] / max(float(rho[0]), 1e-300)
    small = np.flatnonzero(rho < 2.0 / np.sqrt(noise.size))
    return float(1.0 + 2.0 * np.sum(rho[: small[0] if small.size else None] ** 2))


PIECES = 12
"""Parts of a period; a transient spoils the first of them."""


def _rest_level(y: Array) -> float:
    """Level of a rest, or of its last half where the first still dies away."""
    last = y[y.size // 2 :]
    whole = _still_level(y)
    later = _still_level(last) if last.size >= REST else whole
    return later if later < QUIETER * whole else whole


QUIETER = 0.7
"""Part of the level of a whole rest that its last half has if the first half is none."""


def _still_level(y: Array) -> float:
    t = np.linspace(-1, 1, y.size)
    left = y - np.polyval(np.polyfit(t, y, 2), t)
    # the drive may begin to move within the rest: a robust level does not see its last samples
    return min(float(left.std()), 1.4826 * float(np.median(np.abs(left - np.median(left)))))


def _white_level(y: Array) -> float:
    from scipy.signal import welch

    if y.size < 64:
        return float(np.abs(np.diff(y, 2)).std() / np.sqrt(6.0)) if y.size > 3 else 0.0
    n = min(y.size // 4, 2048)
    line, _ = np.linalg.qr(np.stack([np.ones(n), np.linspace(-1.0, 1.0, n)], axis=1))

    def level(part: Array) -> Array:
        """Do what "linear" does, without a fit of the line in each segment."""
        return np.asarray(part - line @ (line.T @ part))

    _, density = welch(y, window=("kaiser", 14.0), nperseg=n, detrend=level)
    top = density[int(0.8 * density.size) : -1]
    return min(float(np.sqrt(np.median(top) * 0.5)), _rough_level(y))


def _rough_level(y: Array) -> float:
    """Return the level by third differences, the largest left out: a few jumps are no noise."""
    rough = np.sort(np.abs(np.diff(y, 3)))
    kept = rough[: int(0.8 * rough.size)]
    # mean of the lower four fifths of a normal size, and the gain of the third difference
    level = float(kept.mean()) / 0.5586 / np.sqrt(20.0)
    return level if level > 0 else np.inf


def _rounding(y: Array) -> float:
    steps = np.abs(np.diff(np.unique(y)))
    return float(steps.min() / np.sqrt(12.0)) if steps.size else 0.0


def declared_noise(recording: Recording, sensors: Collection[str]) -> dict[str, float]:
    """Return the noise that the recording itself declares for readings of the model."""
    known = recording.meta.get("noise")
    found = known if isinstance(known, Mapping) else {}
    try:
        return {n: float(found[n]) for n in sensors if n in found}
    except (TypeError, ValueError):
        raise UnusableInput(
            f"{recording.name}: what it says of its noise is no number; give "
            "noise={SENSOR: VALUE}"
        ) from None
