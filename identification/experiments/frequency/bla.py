"""Best linear approximation from periodic data, noise and nonlinear distortion told apart.

What changes from period to period is noise; what changes from realisation to realisation of the
random phases, and not from period to period, is nonlinear distortion (Pintelon and Schoukens,
System Identification, 2nd ed. (2012), chapter 4, the robust method). At each line

    Y_m = G U_m + V_m,  m = 1 .. M,    G = sum_m Y_m U_m^H (sum_m U_m U_m^H)^-1,

``n_u`` realisations determine G (best with orthogonal phases), more of them the total variance.
With no more than ``n_u``, neighbouring lines step in for it by local polynomials, which count
what of a sharp resonance they cannot follow as variance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import ComplexArray, FloatArray
from bondgraph.support.errors import UnusableInput
from identification.experiments.frequency.local import LocalFit, half_width, local_fit
from identification.experiments.frequency.periods import (
    Periods,
    cut,
    excited_lines,
    listed_records,
    noise_of_mean,
    same_grid,
)
from identification.experiments.frequency.response import FrequencyResponse


def best_linear_approximation(
    recordings: Recording | Sequence[Recording],
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    period: int | None = None,
    discard: int | None = None,
    lines: Sequence[int] | None = None,
) -> FrequencyResponse:
    """Return the best linear approximation of one or several periodic recordings.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        One a realisation of the phases; at one level of the drive.
    inputs, outputs : sequence of str
        Channels, inputs as measured.
    period : int, optional
        Samples; found from the first input if not given.
    discard : int, optional
        Leading samples to leave out; found from the decay if not given.
    lines : sequence of int, optional
        Excited lines; found from the inputs if not given.

    Raises
    ------
    UnusableInput
        If the recordings do not fit together or a line is not excited.

    Examples
    --------
    >>> from identification import multisine
    >>> tone = multisine(200.0, 400, band=(1.0, 30.0), rms=2.0, periods=6, name="F", unit="N")
    >>> answer = simulate(graph, tone.time, {"F": tone.values}, hold="band-limited")
    >>> periodic = Recording.from_arrays(
    ...     "tones", {"t[s]": tone.time, "F[N]": tone.values, "x[m]": answer["x"]}
    ... )
    >>> response = best_linear_approximation(periodic, ["F"], ["x"], period=400, discard=1600)
    >>> response.response.shape
    (59, 1, 1)
    """
    records = listed_records(recordings, "best linear approximation")
    parts = [cut(r, inputs[0], outputs, period=period, discard=discard) for r in records]
    return response_of_periods(parts, inputs, outputs, lines)


def response_of_periods(
    parts: Sequence[Periods],
    inputs: Sequence[str],
    outputs: Sequence[str],
    lines: Sequence[int] | None = None,
) -> FrequencyResponse:
    """Return the best linear approximation of recordings already cut into periods."""
    first = parts[0]
    same_grid(parts)
    spectra = [(p.spectra(inputs), p.spectra(outputs)) for p in parts]
    u = np.stack([s.mean(axis=0) for s, _ in spectra])
    y = np.stack([s.mean(axis=0) for _, s in spectra])
    at = excited_lines(u, lines, inputs)
    u, y = u[:, at], y[:, at]
    response, gain, factor, total, how = _solve(u, y, at)
    noise = noise_of_mean([(a[:, at], b[:, at]) for a, b in spectra], [response] * len(parts))
    return FrequencyResponse(
        first.name, at * first.rate / first.period, response,
        noise[:, :, None] * gain[:, None, :], total[:, :, None] * factor[:, None, :],
        noise, total, tuple(inputs), tuple(outputs),
        {c: first.units[c] for c in (*inputs, *outputs)}, how, len(parts),
        min(p.count for p in parts),
    )  # fmt: skip


def _solve(
    u: ComplexArray, y: ComplexArray, at: NDArray[np.intp]
) -> tuple[ComplexArray, FloatArray, FloatArray, FloatArray, str]:
    """Response, variance factors by noise and in total, total variance of an output, method."""
    realisations, _, n_u = u.shape
    said = f"{realisations} realisation{'s' if realisations > 1 else ''}"
    if realisations < n_u:
        local = _neighbours(u, y, at)
        how = f"local polynomials, {said} for {n_u} inputs"
        return local.response, local.factor, local.factor, local.variance, how
    ua, ya = u.transpose(1, 2, 0), y.transpose(1, 2, 0)
    gram = ua @ ua.conj().transpose(0, 2, 1)
    power = np.trace(gram, axis1=1, axis2=2).real / n_u
    smallest = np.linalg.eigvalsh(gram)[:, 0]
    if not np.all(smallest > 1e-8 * power):
        bad = int(at[int(np.argmin(smallest / np.maximum(power, 1e-300)))])
        raise UnusableInput(
            f"line {bad}: the realisations do not separate the {n_u} inputs; use orthogonal "
            "phases, another realisation, or leave the line out with lines="
        )
    inverse = np.linalg.inv(gram)
    response = ya @ ua.conj().transpose(0, 2, 1) @ inverse
    factor = np.diagonal(inverse, axis1=1, axis2=2).real
    if realisations > n_u:
        rest = ya - response @ ua
        total = np.sum(np.abs(rest) ** 2, axis=2) / (realisations - n_u)
        return response, factor, factor, total, f"robust method, {said}"
    try:
        total = _neighbours(u, y, at).variance
        how = f"line by line, {said}; total variance from neighbouring lines"
    except UnusableInput:
        total = np.full(response.shape[:2], np.nan)
        how = f"line by line, {said}; too few lines for a total variance"
    return response, factor, factor, total, how


def _neighbours(u: ComplexArray, y: ComplexArray, at: NDArray[np.intp]) -> LocalFit:
    """Local polynomials of order 4, which follow a resonance closely; 2 if lines are few."""
    every = np.arange(at.size)
    if at.size > 1 and 2 * half_width(u.shape[2], u.shape[0], 4, False) + 1 <= at.size:
        return local_fit(u, y, at, every, order=4, transient=False)
    return local_fit(u, y, at, every, order=2, transient=False)
