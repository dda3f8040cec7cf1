"""Local polynomial method: response and transient are smooth from one line to the next.

Around each line ``k`` the spectra of K records obey, with polynomials in the distance ``r``,

    Y(k + r) = sum_s r^s [G_s U(k + r) + T_s] + V,        G = G_0,

a linear least-squares problem in ``G_s`` and ``T_s``; its residual estimates the variance of V,
which is noise and stochastic distortion together. Pintelon and Schoukens, System Identification,
2nd ed. (2012), chapter 7; the transient ``T`` is what leakage is made of, so no window is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft

from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import ComplexArray, FloatArray, IntArray
from bondgraph.support.errors import UnusableInput
from identification.experiments.frequency.periods import listed_records
from identification.experiments.frequency.response import FrequencyResponse

CHUNK = 512
"""Lines solved at once; bounds the memory."""


@dataclass(frozen=True, slots=True, eq=False)
class LocalFit:
    """Result at C centre lines.

    Parameters
    ----------
    response : ndarray, shape (C, n_y, n_u)
    factor : ndarray, shape (C, n_u)
        Variance of ``response[:, i, j]`` over the variance of output i.
    variance : ndarray, shape (C, n_y)
        Of V, from the residual.
    """

    response: ComplexArray
    factor: FloatArray
    variance: FloatArray


def half_width(n_u: int, records: int, order: int, transient: bool, spare: int = 6) -> int:
    """Return the fewest lines to each side that leave `spare` degrees of freedom."""
    unknowns = (order + 1) * (n_u + (records if transient else 0))
    return max(1, int(np.ceil(((unknowns + spare) / records - 1) / 2)))


def local_fit(
    u: ComplexArray,
    y: ComplexArray,
    lines: IntArray,
    centres: IntArray,
    *,
    order: int = 2,
    transient: bool = True,
) -> LocalFit:
    """Fit local polynomials around chosen lines.

    Parameters
    ----------
    u : ndarray, shape (K, F, n_u)
    y : ndarray, shape (K, F, n_y)
        Spectra of K records.
    lines : ndarray, shape (F,)
        Line numbers of the spectra, increasing.
    centres : ndarray, shape (C,)
        Places (not line numbers) among the F where the response is wanted.
    order : int
        Of the polynomials.
    transient : bool
        Whether the records have one; periodic ones in steady state have none.

    Raises
    ------
    UnusableInput
        If there are too few lines, or the inputs move together.
    """
    records, size, n_u = u.shape
    half = half_width(n_u, records, order, transient)
    width = 2 * half + 1
    if size < width:
        raise UnusableInput(
            f"local polynomial: {size} lines, but order {order} with {n_u} inputs needs {width}; "
            "record longer, widen the band or lower the order"
        )
    parts = [
        _chunk(u, y, lines, centres[i : i + CHUNK], order, half, transient)
        for i in range(0, centres.size, CHUNK)
    ]
    return LocalFit(
        np.concatenate([p.response for p in parts]),
        np.concatenate([p.factor for p in parts]),
        np.concatenate([p.variance for p in parts]),
    )


def _chunk(
    u: ComplexArray, y: ComplexArray, lines: IntArray, centres: IntArray,
    order: int, half: int, transient: bool,
) -> LocalFit:  # fmt: skip
    records, size, n_u = u.shape
    first = np.clip(centres - half, 0, size - 2 * half - 1)
    at = first[:, None] + np.arange(2 * half + 1)
    reach = np.maximum(lines[at[:, -1]] - lines[at[:, 0]], 1)
    r = 2.0 * (lines[at] - lines[centres][:, None]) / reach[:, None]
    powers = r[:, :, None] ** np.arange(order + 1)
    count, width = at.shape
    # rows: record by record; columns: powers of the inputs, then of each record's transient
    ua, ya = u[:, at], y[:, at]
    with_input = np.einsum("cws,kcwu->ckwsu", powers, ua).reshape(count, records * width, -1)
    columns = [with_input]
    if transient:
        eye = np.eye(records)
        own = np.einsum("cws,kl->ckwls", powers, eye).reshape(count, records * width, -1)
        columns.append(own.astype(complex))
    a = np.concatenate(columns, axis=2)
    scale = np.linalg.norm(a, axis=1)
    scale = np.where(scale > 0.0, scale, 1.0)
    q, upper = np.linalg.qr(a / scale[:, None, :])
    diagonal = np.abs(np.diagonal(upper, axis1=1, axis2=2)).min(axis=1)
    if not diagonal.min() > 1e-9:
        bad = int(lines[centres[int(np.argmin(diagonal))]])
        raise UnusableInput(
            f"local polynomial: near line {bad} the inputs do not move, or move together; choose "
            "a band they excite, or give as many different realisations as there are inputs"
        )
    b = ya.transpose(1, 0, 2, 3).reshape(count, records * width, -1)
    projected = q.conj().transpose(0, 2, 1) @ b
    theta = np.linalg.solve(upper, projected) / scale[:, :, None]
    inverse = np.linalg.inv(upper)[:, :n_u] / scale[:, :n_u, None]
    residual = b - q @ projected
    freedom = records * width - a.shape[2]
    return LocalFit(
        theta[:, :n_u].transpose(0, 2, 1),
        np.sum(np.abs(inverse) ** 2, axis=2),
        np.sum(np.abs(residual) ** 2, axis=1) / freedom,
    )


def _spectra(records: Sequence[Recording], names: Sequence[str]) -> ComplexArray:
    """Complex peak amplitudes, shape (K, F, len(names))."""
    each = [rfft(np.stack([r[c] for c in names], axis=1), axis=0) for r in records]
    return np.asarray(np.stack(each) * (2.0 / records[0].n), complex)


def local_polynomial(
    recordings: Recording | Sequence[Recording],
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    band: tuple[float, float] | None = None,
    order: int = 2,
    points: int = 1024,
) -> FrequencyResponse:
    """Best linear approximation from arbitrary records: noise, sweeps, steps, anything.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        Of one length and rate.
    inputs, outputs : sequence of str
        Channels.
    band : (low, high), optional
        Hz; from the first line to nine tenths of the Nyquist rate if not given.
    order : int
        Of the local polynomials.
    points : int
        At most so many lines, evenly spread over the band, are given out.

    Returns
    -------
    FrequencyResponse
        Its noise variances are NaN: noise and distortion are told apart by periods only.

    Raises
    ------
    UnusableInput
        There is no recording, they do not fit together, or the band holds too few lines.
    """
    records = listed_records(recordings, "local polynomial")
    first = records[0]
    if any(r.n != first.n or abs(r.dt / first.dt - 1) > 1e-9 for r in records):
        raise UnusableInput("local polynomial: the recordings differ in length or rate; cut them")
    u, y = (_spectra(records, names) for names in (inputs, outputs))
    f = np.arange(u.shape[1]) * first.fs / first.n
    low, high = band if band is not None else (0.5 * f[1], 0.45 * first.fs)
    kept = np.flatnonzero((f >= max(low, 0.5 * f[1])) & (f <= high))
    if kept.size == 0:
        raise UnusableInput(f"{first.name}: no line between {low:g} and {high:g} Hz")
    centres = np.unique(np.round(np.linspace(0, kept.size - 1, points)).astype(np.intp))
    found = local_fit(u[:, kept], y[:, kept], kept, centres, order=order)
    nothing = np.full(found.response.shape, np.nan)
    return FrequencyResponse(
        first.name, f[kept[centres]], found.response, nothing,
        found.variance[:, :, None] * found.factor[:, None, :], nothing[:, :, 0],
        found.variance, tuple(inputs), tuple(outputs),
        {c: first.units[c] for c in (*inputs, *outputs)},
        f"local polynomials of order {order} with transients", len(records),
    )  # fmt: skip
