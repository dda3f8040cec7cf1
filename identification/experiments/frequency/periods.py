"""A recording of a repeated drive, cut into whole periods with the run-in left out.

The period is where the drive repeats itself best; the run-in ends where one period no longer
differs from the next by more than the later ones do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft

from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import ComplexArray, FloatArray
from bondgraph.support.errors import UnusableInput, require_known
from identification.statistics.periods import find_period, whole_period

LARGEST_CHANGE = 0.6
"""Largest difference of neighbouring periods of the drive over its spread."""


@dataclass(frozen=True, slots=True, eq=False)
class Periods:
    """Whole periods of a recording.

    Parameters
    ----------
    name : str
    rate : float
        Samples per second, Hz.
    channels : mapping of str to ndarray
        (P, N) each: P periods of N samples, SI.
    units : mapping of str to str
    discarded : int
        Samples left out at the start.
    words : str
        What was done, in one sentence.
    """

    name: str
    rate: float
    channels: Mapping[str, FloatArray]
    units: Mapping[str, str]
    discarded: int
    words: str

    def __post_init__(self) -> None:
        """Freeze the tables."""
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))

    @property
    def count(self) -> int:
        """Number of periods P."""
        return int(next(iter(self.channels.values())).shape[0])

    @property
    def period(self) -> int:
        """Samples of a period N."""
        return int(next(iter(self.channels.values())).shape[1])

    def spectra(self, names: Sequence[str]) -> ComplexArray:
        """Complex peak amplitudes of each period, shape (P, F, len(names)), lines 0 .. N // 2."""
        require_known("channel", f"recording {self.name}", self.channels, *names)
        stacked = np.stack([self.channels[n] for n in names], axis=2)
        return np.asarray(rfft(stacked, axis=1) * (2.0 / self.period))

    def __repr__(self) -> str:
        """Return name, size and what was done."""
        return f"Periods({self.name!r}, {self.count} of {self.period} samples; {self.words})"


def cut(
    recording: Recording,
    drive: str,
    outputs: Sequence[str],
    *,
    period: int | None = None,
    discard: int | None = None,
) -> Periods:
    """Cut a recording into whole periods, counted back from its end.

    Parameters
    ----------
    recording : Recording
    drive : str
        Channel whose period counts.
    outputs : sequence of str
        Channels in which the run-in shows.
    period : int, optional
        Samples; found from the drive if not given.
    discard : int, optional
        Leading samples to leave out at least; found from the decay between periods if not given
        (at least three whole periods are needed for that).

    Raises
    ------
    UnusableInput
        If less than one period is left.
    """
    where = f"{recording.name}, {drive}"
    for name in (drive, *outputs):
        recording.channel(name)  # an unknown name is said at once
    if period is None:
        n = whole_period(find_period(recording[drive], where), recording.n, where)
    else:
        n = int(period)
    given = 0 if discard is None else int(discard)
    count = (recording.n - given) // n if n > 1 else 0
    if count < 1:
        raise UnusableInput(
            f"{recording.name}: {recording.n} samples less {given} hold no period of {n}; "
            "record longer or discard less"
        )
    start = recording.n - count * n
    stacked = {k: v[start:].reshape(count, n) for k, v in recording.channels.items()}
    dropped, words = 0, "the run-in was given"
    if discard is None:
        dropped, words = run_in(np.stack([stacked[o] for o in outputs], axis=2))
    kept = {k: v[dropped:] for k, v in stacked.items()}
    _must_repeat(kept[drive], where, n)
    return Periods(
        recording.name, recording.fs, kept, recording.units, start + dropped * n,
        f"{words}; {start + dropped * n} samples left out",
    )  # fmt: skip


def listed_records(recordings: Recording | Sequence[Recording], what: str) -> list[Recording]:
    """Return one recording or several as a list; refuse none, for `what`."""
    records = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not records:
        raise UnusableInput(f"{what}: no recording; give at least one")
    return records


def same_grid(parts: Sequence[Periods]) -> None:
    """Refuse recordings whose periods differ in samples or rate.

    Raises
    ------
    UnusableInput
        At the first that does.
    """
    first = parts[0]
    for p in parts[1:]:
        if p.period != first.period or abs(p.rate / first.rate - 1) > 1e-9:
            raise UnusableInput(
                f"{p.name}: period of {p.period} samples at {p.rate:g} Hz, but {first.name} has "
                f"{first.period} at {first.rate:g} Hz; analyse them one by one"
            )


def _must_repeat(drive: FloatArray, where: str, n: int) -> None:
    """Refuse periods in which the drive itself is another, such as a rest at the end."""
    apart = np.sqrt(np.mean(np.diff(drive, axis=0) ** 2, axis=1))
    if drive.shape[0] > 1 and not apart.max() <= LARGEST_CHANGE * float(drive.std()):
        raise UnusableInput(
            f"{where}: it does not repeat every {n} samples up to the end of the record; cut off "
            "what follows the last whole period with Recording.slice, or give period="
        )


def run_in(values: FloatArray) -> tuple[int, str]:
    """Return how many leading periods still decay, and the verdict in words.

    Noise makes all differences of neighbouring periods equally large; a run-in makes the early
    ones larger. A period is dropped while its difference exceeds the median of the later ones by
    more than five standard deviations of a mean square (degrees of freedom from the spectrum of
    the last difference). The last two periods always stay.

    Parameters
    ----------
    values : ndarray, shape (P, N, n_y)
    """
    count = values.shape[0]
    if count < 3:
        return 0, f"{count} periods are too few to test for a run-in"
    step = np.diff(values, axis=0)
    spectrum = np.abs(rfft(step[-1], axis=0)) ** 2
    freedom = spectrum.sum(axis=0) ** 2 / np.maximum((spectrum**2).sum(axis=0), 1e-300)
    spread = np.sqrt(2.0 / np.maximum(2.0 * freedom, 1.0))
    power = np.mean(step**2, axis=1)
    tiny = 1e-24 * np.mean(values**2, axis=(0, 1))
    dropped = 0
    while dropped < count - 2:
        later = np.median(power[dropped + 1 :], axis=0) if dropped + 1 < count - 1 else None
        if later is None or (power[dropped] <= later * (1.0 + 5.0 * spread) + tiny).all():
            break
        dropped += 1
    if dropped == count - 2 and count > 3:
        return dropped, f"still decaying after {dropped} periods: let it settle longer"
    return dropped, f"{dropped} of {count} periods dropped as run-in"


def noise_of_mean(
    spectra: Sequence[tuple[ComplexArray, ComplexArray]], responses: Sequence[ComplexArray]
) -> FloatArray:
    """Variance of the mean over the periods of ``Y - G U``, mean over realisations, (F, n_y).

    What a noisy input shows at a line goes into the mean with `G`, so it counts, too; what of it
    really drives the plant cancels. NaN where no recording has two periods.

    Parameters
    ----------
    spectra : sequence of (ndarray, ndarray), shapes (P, F, n_u) and (P, F, n_y)
        Of the inputs and outputs of each realisation.
    responses : sequence of ndarray, shape (F, n_y, n_u)
    """
    found = [
        np.var(y - np.einsum("fyu,pfu->pfy", g, u), axis=0, ddof=1) / y.shape[0]
        for (u, y), g in zip(spectra, responses, strict=True)
        if y.shape[0] > 1
    ]
    return np.asarray(np.mean(found, axis=0)) if found else np.full(responses[0].shape[:2], np.nan)


def period_lines(spectrum: ComplexArray, where: str = "drive") -> NDArray[np.intp]:
    """Return the lines that a drive excites, from the amplitudes of its mean period.

    A line counts from 1 % of the largest amplitude on, or from the middle of the widest gap
    (at least a factor 3) among the amplitudes within 60 dB of the largest.

    Parameters
    ----------
    spectrum : ndarray, shape (F,)
        Lines 0 .. F - 1; line 0 (the mean) never counts.
    """
    size = np.abs(spectrum)
    size[0] = 0.0
    if not size.max() > 0.0:
        raise UnusableInput(f"{where}: it excites no line; name another drive or give lines=")
    order = np.sort(size[size >= 1e-3 * size.max()])
    limit = 1e-2 * size.max()
    if order.size > 1:
        ratio = order[1:] / order[:-1]
        widest = int(np.argmax(ratio))
        if ratio[widest] > 3.0:
            limit = float(np.sqrt(order[widest] * order[widest + 1]))
    return np.flatnonzero(size >= limit)


def excited_lines(
    spectra: ComplexArray, lines: Sequence[int] | None, inputs: Sequence[str]
) -> NDArray[np.intp]:
    """Return the lines below Nyquist that any of `inputs` excites, or check those given.

    Parameters
    ----------
    spectra : ndarray, shape (R, F, n_u)
    """
    if lines is not None:
        at = np.unique(np.asarray(lines, np.intp))
        if at.size == 0 or at[0] < 1 or at[-1] >= spectra.shape[1]:
            raise UnusableInput(
                f"lines must lie within 1 .. {spectra.shape[1] - 1}; mind the Nyquist rate"
            )
        return at
    power = np.sqrt(np.mean(np.abs(spectra) ** 2, axis=0))
    at = np.unique(np.concatenate([period_lines(power[:, j], n) for j, n in enumerate(inputs)]))
    return np.asarray(at[at < spectra.shape[1] - 1])
