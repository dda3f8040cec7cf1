"""Noise, even and odd nonlinear distortion of an output, line by line.

A random odd multisine leaves some odd lines and all even lines out. A linear system answers there
with noise only; an even nonlinearity fills the even lines, an odd one the odd lines left out.
Noise is what changes from period to period. Pintelon and Schoukens, System Identification, 2nd
ed. (2012), chapter 4; Schoukens, Vaes, Pintelon, IEEE Control Systems Magazine 36(3) (2016) 38.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import optional
from bondgraph.signals.recording import Recording
from bondgraph.support.arrays import ComplexArray, FloatArray
from bondgraph.support.errors import UnusableInput, require_known
from identification.experiments.frequency.periods import (
    cut,
    excited_lines,
    listed_records,
    noise_of_mean,
    same_grid,
)

KINDS = ("excited", "odd", "even")


@dataclass(frozen=True, slots=True)
class DistortionLevel:
    """Root mean square amplitude per line of one output in a band, output unit.

    Parameters
    ----------
    output : str
    linear : float
        At the excited lines, noise taken off.
    noise : float
        Of the mean over the periods, at all lines; NaN where a recording holds one period.
    odd, even : float
        At the detection lines, noise taken off where it is known; NaN if there is no such line.
    stochastic : float
        At the excited lines, from the spread over realisations less noise; NaN with one.
    odd_certain, even_certain : bool
        Whether noise alone explains the lines with a probability below 0.1 %.
    """

    output: str
    linear: float
    noise: float
    odd: float
    even: float
    stochastic: float
    odd_certain: bool
    even_certain: bool

    def __str__(self) -> str:
        """One line in words, in per cent of the linear part."""

        def said(value: float, certain: bool) -> str:
            if not value == value:
                return "not measured"
            if self.noise != self.noise:
                return f"{100 * value / self.linear:.3g} % (noise unknown, and in it)"
            return f"{100 * value / self.linear:.3g} %" if certain else "none beyond the noise"

        more = "" if self.stochastic != self.stochastic else (
            f", over realisations {100 * self.stochastic / self.linear:.3g} %"
        )  # fmt: skip
        noise = "unknown" if self.noise != self.noise else f"{100 * self.noise / self.linear:.3g} %"
        return (
            f"{self.output}: noise {noise}, even distortion "
            f"{said(self.even, self.even_certain)}, odd distortion "
            f"{said(self.odd, self.odd_certain)}{more} of the linear part"
        )


@dataclass(frozen=True, slots=True, eq=False)
class Distortions:
    """Spectrum of the outputs by kind of line; F lines from 1 on.

    Parameters
    ----------
    name : str
    frequency : ndarray, shape (F,), Hz
    kind : ndarray of str, shape (F,)
        ``"excited"``, ``"odd"`` or ``"even"`` (lines that were left out).
    mean : ndarray, shape (R, F, n_y)
        Complex peak amplitudes, mean over the periods, of R realisations; at detection lines less
        what a small drive there would explain linearly.
    noise : ndarray, shape (F, n_y)
        Variance of `mean` by noise, mean over the realisations; with one input, of the output less
        what the input explains, as both were measured.
    stochastic : ndarray, shape (F, n_y)
        Variance of `mean` over the realisations at excited lines (noise included); NaN elsewhere
        and with one realisation.
    outputs : tuple of str
    units : tuple of str
    periods : int
    """

    name: str
    frequency: FloatArray
    kind: NDArray[np.str_]
    mean: ComplexArray
    noise: FloatArray
    stochastic: FloatArray
    outputs: tuple[str, ...]
    units: tuple[str, ...]
    periods: int

    @property
    def amplitude(self) -> FloatArray:
        """Root mean square amplitude over the realisations, shape (F, n_y)."""
        return np.asarray(np.sqrt(np.mean(np.abs(self.mean) ** 2, axis=0)))

    def level(self, output: str, band: tuple[float, float] | None = None) -> DistortionLevel:
        """Levels of one output over a band (Hz; the excited one if not given)."""
        from scipy.stats import f as fisher

        require_known("output", self.name, self.outputs, output)
        c = self.outputs.index(output)
        excited = self.frequency[self.kind == "excited"]
        low, high = band if band is not None else (0.0, float(excited[-1]))
        inside = (self.frequency >= low) & (self.frequency <= high)
        if not (inside & (self.kind == "excited")).any():
            raise UnusableInput(f"{self.name}: no excited line between {low:g} and {high:g} Hz")
        power, noise = self.amplitude[:, c] ** 2, self.noise[:, c]
        freedom = self.mean.shape[0] * (self.periods - 1)

        def left(kind: str) -> tuple[float, bool]:
            at = inside & (self.kind == kind)
            n = int(at.sum())
            if not n:
                return float("nan"), False
            over, by_noise = float(power[at].mean()), float(noise[at].mean())
            if freedom < 1:
                return float(np.sqrt(over)), False
            limit = fisher.ppf(0.999, 2 * n * self.mean.shape[0], 2 * n * freedom)
            return float(np.sqrt(max(over - by_noise, 0.0))), over > limit * by_noise

        linear, _ = left("excited")
        (odd, odd_certain), (even, even_certain) = left("odd"), left("even")
        spread = self.stochastic[inside & (self.kind == "excited"), c]
        less = noise[inside & (self.kind == "excited")]
        stochastic = float(np.sqrt(max(np.mean(spread - np.nan_to_num(less)), 0.0)))
        if np.isnan(spread).any():
            stochastic = float("nan")
        by_noise = float(np.sqrt(noise[inside].mean())) if freedom > 0 else float("nan")
        return DistortionLevel(
            output, linear, by_noise, odd, even, stochastic, odd_certain, even_certain
        )

    def to_pandas(self) -> Any:
        """Return a DataFrame: index `f_Hz`, kind of line, amplitude and deviations."""
        pandas = optional("pandas", "to_pandas", "tables")
        columns: dict[str, Any] = {"kind": self.kind}
        for c, n in enumerate(self.outputs):
            columns[n] = self.amplitude[:, c]
            columns[f"{n} noise"] = np.sqrt(self.noise[:, c])
            columns[f"{n} over realisations"] = np.sqrt(self.stochastic[:, c])
        return pandas.DataFrame(columns, index=pandas.Index(self.frequency, name="f_Hz"))

    def __repr__(self) -> str:
        """Return the levels of all outputs in words."""
        counts = ", ".join(f"{int((self.kind == k).sum())} {k}" for k in KINDS)
        body = "; ".join(str(self.level(o)) for o in self.outputs)
        return f"Distortions({self.name!r}, lines: {counts}; {body})"


def distortions(
    recordings: Recording | Sequence[Recording],
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    period: int | None = None,
    discard: int | None = None,
    lines: Sequence[int] | None = None,
    highest: int | None = None,
) -> Distortions:
    """Separate noise, even and odd distortion in periodic recordings.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        Realisations of the same lines with different random phases.
    inputs, outputs : sequence of str
        Channels. With one input, a drive that is not clean at the detection lines is allowed for:
        the response, interpolated between excited lines, times what it shows there. With several
        inputs it is not, and the spread over realisations is left to
        `best_linear_approximation`.
    period, discard : int, optional
        As in `identification.experiments.frequency.periods.cut`.
    lines : sequence of int, optional
        Excited lines; found from the inputs if not given.
    highest : int, optional
        Last line given out; three times the last excited one, below the Nyquist rate.

    Raises
    ------
    UnusableInput
        The recordings differ in period or rate, or no excited line is given out.

    Examples
    --------
    >>> from identification import multisine
    >>> tone = multisine(
    ...     200.0, 400, band=(1.0, 30.0), kind="random_odd", periods=6, name="F", unit="N"
    ... )
    >>> answer = simulate(graph, tone.time, {"F": tone.values}, hold="band-limited")
    >>> periodic = Recording.from_arrays(
    ...     "tones", {"t[s]": tone.time, "F[N]": tone.values, "x[m]": answer["x"]}
    ... )
    >>> level = distortions(periodic, ["F"], ["x"], period=400, discard=800).level("x")
    >>> level.odd < 0.01
    True
    """
    records = listed_records(recordings, "distortions")
    parts = [cut(r, inputs[0], outputs, period=period, discard=discard) for r in records]
    same_grid(parts)
    u = np.stack([p.spectra(inputs).mean(axis=0) for p in parts])
    excited = excited_lines(u, lines, inputs)
    below = (parts[0].period - 1) // 2
    last = min(3 * int(excited[-1]) if highest is None else int(highest), below)
    if excited[-1] > below or excited[0] > last:
        raise UnusableInput(
            f"{parts[0].name}: lines {excited[0]} .. {excited[-1]} are excited, but {last} is the "
            "last given out; raise highest, or leave the Nyquist rate out of lines"
        )
    y = np.stack([p.spectra(outputs).mean(axis=0) for p in parts])
    number = np.arange(1, last + 1)
    kind = np.where(number % 2 == 1, "odd", "even").astype("<U7")
    at = excited[excited <= last]
    kind[at - 1] = "excited"
    spread = np.full((last, len(outputs)), np.nan)
    gain = np.zeros((len(parts), last, len(outputs)), complex)
    if len(inputs) == 1:
        g = y[:, excited] / u[:, excited]
        gain = _between(g, excited, number)
        if len(parts) > 1:
            power = np.mean(np.abs(u[:, excited]) ** 2, axis=0)
            spread[at - 1] = (np.var(g, axis=0, ddof=1) * power)[: at.size]
    given_out = slice(1, last + 1)
    each = [(p.spectra(inputs[:1]), p.spectra(outputs)) for p in parts]
    noise = noise_of_mean(
        [(a[:, given_out], b[:, given_out]) for a, b in each], list(gain[..., None])
    )
    y = y[:, given_out]
    left_out = (kind != "excited")[:, None]
    y = y - np.where(left_out, gain * u[:, given_out, :1], 0.0)
    return Distortions(
        parts[0].name, number * parts[0].rate / parts[0].period, kind, y, noise, spread,
        tuple(outputs), tuple(parts[0].units[o] for o in outputs), min(p.count for p in parts),
    )  # fmt: skip


def _between(g: ComplexArray, excited: NDArray[np.intp], number: NDArray[np.intp]) -> ComplexArray:
    """Response from the first excited line to the last, linear between, shape (R, F, n_y)."""
    found = np.zeros((g.shape[0], number.size, g.shape[2]), complex)
    inside = (number >= excited[0]) & (number <= excited[-1])
    for r in range(g.shape[0]):
        for c in range(g.shape[2]):
            real = np.interp(number[inside], excited, g[r, :, c].real)
            found[r, inside, c] = real + 1j * np.interp(number[inside], excited, g[r, :, c].imag)
    return found
