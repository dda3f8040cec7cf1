"""Blocks of consecutive samples: comparisons and covariances that hold for coloured residuals.

The covariance is ``V (sum_b g_b g_b') V`` with the scores ``g_b`` of blocks of samples that are
long compared with the memory of the residuals (White, Econometrica 50 (1982) 1; Newey and West,
Econometrica 55 (1987) 703).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput

BLOCKS = 40
FEWEST = 12
LEAST_LEFT = 0.1
"""Share of a direction that a block leaves to the others, at least."""


def student(blocks: int) -> float:
    """Return what Student's t of the few blocks adds to the variance."""
    from scipy.stats import t

    return float((t.ppf(0.975, max(blocks - 1, 1)) / 1.959964) ** 2)


def blocks_for(
    residual: FloatArray, channels: Sequence[int] = (), readings: Sequence[int] = ()
) -> int:
    """Return how many blocks keep each well longer than the memory of the residuals.

    At most `BLOCKS`, at least `FEWEST`, otherwise eight integrated correlation times a block. Many
    windows are taken as one run of their readings: memory reaches over their edges.

    Parameters
    ----------
    channels, readings : sequence of int
        As in `block_rows`.
    """
    spans = _spans(residual.size, channels, readings)
    series = [residual[row] for rows in spans for row in rows]
    if len(spans) >= FEWEST:
        most = max(len(rows) for rows in spans)
        series = [
            np.concatenate([residual[rows[c]] for rows in spans if c < len(rows)])
            for c in range(most)
        ]
    times = []
    for e in series:
        size = e.size
        e = e - e.mean() if size else e
        power = float(e @ e)
        if size < 32 or power == 0:
            continue
        spectrum = np.abs(np.fft.rfft(e, 2 * size)) ** 2
        rho = np.fft.irfft(spectrum)[: size // 4] / power
        # sum until the correlation is lost in its own noise
        quiet = np.flatnonzero(rho < 2.0 / np.sqrt(size))
        end = int(quiet[0]) if quiet.size else rho.size
        times.append(1.0 + 2.0 * float(rho[1:end].sum()))
    if not times:
        return BLOCKS
    longest = max(e.size for e in series)
    return int(np.clip(longest / (8.0 * max(times)), FEWEST, BLOCKS))


def block_rows(
    count: int, channels: Sequence[int] = (), blocks: int = BLOCKS, readings: Sequence[int] = ()
) -> list[NDArray[np.intp]]:
    """Return the rows of consecutive blocks of samples.

    The readings of a window are cut alike and their rows put together, because noise of two
    readings at the same time may be correlated. Of `FEWEST` windows or more those that are not far
    longer than a block stay whole: what their own initial states took out of the residuals ties the
    samples of each.

    Parameters
    ----------
    channels : sequence of int
        Rows of each reading of each window, in order.
    readings : sequence of int, optional
        How many of the channels are the readings of each window; those of equal length that follow
        each other, if not given.
    """
    spans = _spans(count, channels, readings)
    total = sum(rows.shape[1] for rows in spans)
    many = len(spans) >= FEWEST
    blocks = min(blocks, len(spans)) if many else blocks
    found: list[NDArray[np.intp]] = []
    for rows in spans:
        size = rows.shape[1]
        share = blocks * size / max(total, 1)
        wanted = min(max(1, int(share / 2) if many else round(share)), max(size, 1))
        found += [rows[:, p] for p in np.array_split(np.arange(size), wanted)]
    if not many:
        return [rows.ravel() for rows in found]
    sizes = np.array([rows.shape[1] for rows in found])
    of = ((np.cumsum(sizes) - 0.5 * sizes) * blocks / max(total, 1)).astype(int)
    return [
        np.concatenate([found[i].ravel() for i in np.flatnonzero(of == k)]) for k in np.unique(of)
    ]


def _spans(count: int, channels: Sequence[int], readings: Sequence[int]) -> list[NDArray[np.intp]]:
    """Return the rows of each window, shape (readings, samples)."""
    sizes = tuple(channels) or (count,)
    if sum(sizes) != count:
        raise UnusableInput(f"blocks: channels {sizes} do not add up to {count} residuals")
    if not readings:
        readings = [len(list(same)) for _, same in groupby(sizes)]
    found, channel, row = [], 0, 0
    for many in readings:
        own = sizes[channel : channel + many]
        if len(own) != many or len(set(own)) != 1:
            raise UnusableInput(f"blocks: readings {tuple(readings)} are not those of {sizes}")
        found.append(np.arange(row, row + sum(own)).reshape(many, own[0]))
        channel, row = channel + many, row + sum(own)
    if channel != len(sizes):
        raise UnusableInput(f"blocks: readings {tuple(readings)} are not those of {sizes}")
    return found


def block_scores(
    jacobian: FloatArray,
    residual: FloatArray,
    rows: Sequence[NDArray[np.intp]],
    covariance: FloatArray,
) -> FloatArray:
    """Return the scores ``J_b' (1 - J_b V J_b')^-1 r_b`` of blocks, shape (n_blocks, n).

    The inverse makes up for what the fit took out of the residuals of a block (the jackknife, CR3:
    Bell and McCaffrey, Survey Methodology 28 (2002) 169); without it slow colours look too small.
    A block that alone decides a direction has nothing left over to judge it by: what is made up for
    is bounded.
    """
    power, axes = np.linalg.eigh(0.5 * (covariance + covariance.T))
    kept = power > 1e-14 * power.max(initial=0.0)
    spread = np.sqrt(power[kept])
    root, back = axes[:, kept] * spread, axes[:, kept] / spread
    found = []
    for part in rows:
        seen = jacobian[part] @ root
        lever, turn = np.linalg.eigh(seen.T @ seen)
        score = turn.T @ (seen.T @ residual[part])
        found.append(back @ (turn @ (score / np.maximum(1.0 - lever, LEAST_LEFT))))
    return np.array(found)


def sandwich(
    jacobian: FloatArray,
    residual: FloatArray,
    inverse: FloatArray,
    prior: FloatArray,
    channels: Sequence[int] = (),
    readings: Sequence[int] = (),
) -> FloatArray:
    """Return the covariance that holds for coloured residuals too, shape (n, n).

    Priors keep their own part, so that numbers the data do not excite stay unknown.

    Parameters
    ----------
    jacobian : ndarray, shape (M, n)
    residual : ndarray, shape (M,)
    inverse : ndarray, shape (n, n)
        Inverse information, which holds for white residuals.
    prior : ndarray, shape (n,)
        Precision of a normal prior on each unknown.
    channels, readings : sequence of int
        As in `block_rows`.
    """
    blocks = blocks_for(residual, channels, readings)
    rows = block_rows(residual.size, channels, blocks, readings)
    scores = block_scores(jacobian, residual, rows, inverse)
    # a prior is a measurement with an error of its own
    middle = np.diag(prior) + student(len(rows)) * scores.T @ scores
    return np.asarray(inverse @ middle @ inverse)


def block_means(values: FloatArray, most: int = BLOCKS) -> FloatArray:
    """Means over `most` consecutive blocks, or over the samples where there are fewer."""
    return np.array([float(np.mean(b)) for b in np.array_split(values, min(most, values.size))])


def paired_z(worse: FloatArray, better: FloatArray) -> float:
    """How many standard errors `better` lies below `worse`, block by block.

    The logarithm of each block's mean square is compared, so that a few blocks with a large misfit
    (peaks that saturate) neither carry nor drown the comparison.
    """
    d = np.log(np.maximum(worse, 1e-300)) - np.log(np.maximum(better, 1e-300))
    return mean_z(d, np.inf)


def mean_z(d: FloatArray, alike: float = 0.0) -> float:
    """Mean of `d` in standard errors; `alike`, with its sign, where all values are the same."""
    spread = float(d.std(ddof=1)) / np.sqrt(d.size) if d.size > 1 else 0.0
    if spread > 0:
        return float(d.mean() / spread)
    return float(np.copysign(alike, d.mean())) if alike and d.size > 1 and d.any() else 0.0


def block_index(n: int, blocks: int) -> NDArray[np.intp]:
    """Return the block of each of `n` samples."""
    return np.asarray(np.arange(n) * blocks // max(n, 1))


def block_sums(rows: FloatArray, blocks: int) -> FloatArray:
    """Return the sums over consecutive blocks of the rows (N, k), shape (blocks, k)."""
    edges = np.linspace(0, rows.shape[0], blocks + 1).astype(int)[:-1]
    return np.asarray(np.add.reduceat(rows, edges, axis=0))
