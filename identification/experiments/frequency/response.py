"""A measured frequency response with what is noise in it and what is not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from bondgraph.signals.files.checks import optional
from bondgraph.support.arrays import ComplexArray, FloatArray
from bondgraph.support.errors import UnusableInput, require_known


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Best linear approximation from n_u inputs to n_y outputs at F lines.

    Variances are those of complex numbers, ``E |z - E z|^2``; NaN where the data do not tell.

    Parameters
    ----------
    name : str
    frequency : ndarray, shape (F,), Hz
    response : ndarray, shape (F, n_y, n_u), output unit per input unit
    noise_variance : ndarray, shape (F, n_y, n_u)
        Of the response, by what changes from period to period.
    total_variance : ndarray, shape (F, n_y, n_u)
        Of the response, by noise and by nonlinear distortion that changes with the realisation.
    output_noise, output_total : ndarray, shape (F, n_y)
        The same for the complex peak amplitude of the outputs, one realisation averaged over its
        periods; a frequency-domain fit weighs with them.
    inputs, outputs : tuple of str
    units : mapping of str to str
    method : str
        How it was found, in words.
    realisations, periods : int
        Records, and the fewest periods in one; 0 periods if the data are not periodic.

    Examples
    --------
    >>> from identification import best_linear_approximation, multisine
    >>> tone = multisine(200.0, 400, band=(1.0, 30.0), rms=2.0, periods=6, name="F", unit="N")
    >>> answer = simulate(graph, tone.time, {"F": tone.values}, hold="band-limited")
    >>> periodic = Recording.from_arrays(
    ...     "tones", {"t[s]": tone.time, "F[N]": tone.values, "x[m]": answer["x"]}
    ... )
    >>> response = best_linear_approximation(periodic, ["F"], ["x"], period=400, discard=1600)
    >>> round(float(1 / abs(response.response[0, 0, 0])), -2)  # the stiffness
    2000.0
    """

    name: str
    frequency: FloatArray
    response: ComplexArray
    noise_variance: FloatArray
    total_variance: FloatArray
    output_noise: FloatArray
    output_total: FloatArray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: Mapping[str, str]
    method: str
    realisations: int = 1
    periods: int = 0

    def __post_init__(self) -> None:
        """Check the shapes and freeze the table of units."""
        full = (self.frequency.size, len(self.outputs), len(self.inputs))
        for what in ("response", "noise_variance", "total_variance"):
            if getattr(self, what).shape != full:
                raise UnusableInput(f"{self.name}: {what} has not the shape {full}")
        for what in ("output_noise", "output_total"):
            if getattr(self, what).shape != full[:2]:
                raise UnusableInput(f"{self.name}: {what} has not the shape {full[:2]}")
        object.__setattr__(self, "units", MappingProxyType(dict(self.units)))

    def entry(self, output: str, given: str) -> tuple[ComplexArray, FloatArray, FloatArray]:
        """Return response, noise and total standard deviation of one path, shape (F,) each."""
        require_known("output", self.name, self.outputs, output)
        require_known("input", self.name, self.inputs, given)
        i, j = self.outputs.index(output), self.inputs.index(given)
        return (
            self.response[:, i, j],
            np.sqrt(self.noise_variance[:, i, j]),
            np.sqrt(self.total_variance[:, i, j]),
        )

    @property
    def output_distortion(self) -> FloatArray:
        """Total less noise, standard deviation of the outputs in one realisation, (F, n_y)."""
        return np.asarray(np.sqrt(np.maximum(self.output_total - self.output_noise, 0.0)))

    def band(self, low: float, high: float) -> FrequencyResponse:
        """Return the lines between `low` and `high` (Hz, both included)."""
        kept = (self.frequency >= low) & (self.frequency <= high)
        if not kept.any():
            raise UnusableInput(
                f"{self.name}: no line between {low:g} and {high:g} Hz; it has "
                f"{self.frequency[0]:.4g} .. {self.frequency[-1]:.4g} Hz"
            )
        along = ("frequency", "response", "noise_variance", "total_variance", "output_noise")
        return replace(self, **{n: getattr(self, n)[kept] for n in (*along, "output_total")})

    def spread(self, kind: str = "total") -> FloatArray:
        """Return the relative standard deviation of the response over all lines, (n_y, n_u).

        Root of the summed variance over the summed squared magnitude; `kind` is ``"noise"`` or
        ``"total"``.
        """
        require_known("spread", self.name, ("noise", "total"), kind)
        variance = self.noise_variance if kind == "noise" else self.total_variance
        power = np.sum(np.abs(self.response) ** 2, axis=0)
        return np.asarray(np.sqrt(variance.sum(axis=0) / np.maximum(power, 1e-300)))

    def to_pandas(self) -> Any:
        """Return a DataFrame: index `f_Hz`; response and standard deviations of every path."""
        pandas = optional("pandas", "to_pandas", "tables")
        columns: dict[str, Any] = {}
        for y in self.outputs:
            for u in self.inputs:
                g, noise, total = self.entry(y, u)
                columns[f"{y}/{u}"] = g
                columns[f"{y}/{u} noise"], columns[f"{y}/{u} total"] = noise, total
        return pandas.DataFrame(columns, index=pandas.Index(self.frequency, name="f_Hz"))

    def to_xarray(self) -> Any:
        """Return a Dataset over `frequency`, `output`, `input`."""
        xarray = optional("xarray", "to_xarray", "tables")
        path, out = ("frequency", "output", "input"), ("frequency", "output")
        return xarray.Dataset(
            {
                "response": (path, self.response),
                "noise_variance": (path, self.noise_variance),
                "total_variance": (path, self.total_variance),
                "output_noise": (out, self.output_noise),
                "output_total": (out, self.output_total),
            },
            coords={
                "frequency": ("frequency", self.frequency, {"units": "Hz"}),
                "output": list(self.outputs),
                "input": list(self.inputs),
            },
            attrs={"name": self.name, "method": self.method},
        )

    def __repr__(self) -> str:
        """Return size, method and how large noise and distortion are."""
        noise, total = (float(np.sqrt(np.mean(self.spread(k) ** 2))) for k in ("noise", "total"))
        said = [f"{w} {100 * v:.2g} %" for w, v in (("noise", noise), ("total", total)) if v == v]
        return (
            f"FrequencyResponse({self.name!r}: {', '.join(self.inputs)} -> "
            f"{', '.join(self.outputs)}, {self.frequency.size} lines, {self.frequency[0]:.4g} .. "
            f"{self.frequency[-1]:.4g} Hz; {self.method}; standard deviation: "
            f"{', '.join(said) or 'unknown'})"
        )
