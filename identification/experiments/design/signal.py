"""A designed input: samples, what lies between them, and how they came about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.signals.units import parse_unit
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, require_known

BETWEEN = ("band-limited", "linear", "hold")


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """One command over time.

    Parameters
    ----------
    name : str
        Source of the model that it drives.
    time : ndarray, shape (N,), s
        Even, from 0.
    values : ndarray, shape (N,), SI
    unit : str
        SI unit of the values.
    kind : str
        ``"multisine, random odd"``, ``"linear sweep"``, ...
    between : {"band-limited", "linear", "hold"}
        What it does between samples; limits are checked on that course.
    period : int
        Samples after which it repeats; 0 if it does not.
    lines : tuple of int
        Excited lines, multiples of ``rate / period``.
    detection : tuple of int
        Odd lines left out on purpose, to see odd distortion in.
    marks : tuple of int
        Samples of turning points or steps.
    notes : tuple of str
        What else a reader of the record should know.

    Examples
    --------
    >>> from identification import sweep
    >>> chirp = sweep(200.0, 1.0, 30.0, 4.0, amplitude=8.0, name="F", unit="N")
    >>> chirp.kind
    'linear sweep'
    """

    name: str
    time: FloatArray
    values: FloatArray
    unit: str
    kind: str
    between: str
    period: int = 0
    lines: tuple[int, ...] = ()
    detection: tuple[int, ...] = ()
    marks: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check shape, finiteness, unit and the course between samples; freeze the arrays."""
        require_known("inter-sample behaviour", self.name, BETWEEN, self.between)
        if self.values.shape != self.time.shape or self.time.ndim != 1 or self.time.size < 2:
            raise UnusableInput(f"{self.name}: values and time must be (N,) with N >= 2")
        if not np.isfinite(self.values).all():
            raise UnusableInput(f"{self.name}: a value is not finite; check amplitude and bias")
        if not parse_unit(self.unit, self.name).is_si:
            raise UnusableInput(f"{self.name}: {self.unit} is not SI; design in SI units")
        for what in ("time", "values"):
            array = np.array(getattr(self, what), float)
            array.flags.writeable = False
            object.__setattr__(self, what, array)

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""
        return float((self.time.size - 1) / (self.time[-1] - self.time[0]))

    @property
    def periods(self) -> int:
        """Whole periods; 0 if it does not repeat."""
        return self.values.size // self.period if self.period else 0

    @property
    def one_period(self) -> FloatArray:
        """First period, or all samples if it does not repeat."""
        return self.values[: self.period] if self.period else self.values

    @property
    def bias(self) -> float:
        """Mean over a period."""
        return float(self.one_period.mean())

    @property
    def rms(self) -> float:
        """Root mean square about the mean, over a period."""
        return float(self.one_period.std())

    @property
    def frequencies(self) -> FloatArray:
        """Frequencies of the excited lines, Hz."""
        return np.asarray(self.lines, float) * self.rate / max(self.period, 1)

    @property
    def commands(self) -> Mapping[str, FloatArray]:
        """As `bondgraph.simulate` takes it."""
        return {self.name: self.values}

    @property
    def recording(self) -> Recording:
        """As a recording, to write it to a file."""
        notes = (f"{self.kind}, {self.between} between samples", *self.notes)
        return Recording(
            self.name, self.time, {self.name: self.values}, {self.name: self.unit},
            meta={"notes": notes, "period": self.period, "lines": self.lines},
        )  # fmt: skip

    def scaled(self, factor: float) -> Signal:
        """Return the signal with its course about the mean times `factor`."""
        return replace(self, values=self.bias + factor * (self.values - self.bias))

    def moved(self, bias: float) -> Signal:
        """Return the signal about another mean."""
        return replace(self, values=self.values + (bias - self.bias))

    def slowed(self, factor: float) -> Signal:
        """Return the same samples, played `factor` times slower."""
        return replace(self, time=self.time * factor)

    def repeated(self, periods: int) -> Signal:
        """Return the same signal with another number of periods."""
        if not self.period:
            raise UnusableInput(f"{self.name}: a {self.kind} has no period to repeat")
        if periods < 1:
            raise UnusableInput(f"{self.name}: {periods} periods; take at least one")
        values = np.tile(self.one_period, periods)
        return replace(self, values=values, time=np.arange(values.size) / self.rate)

    def __repr__(self) -> str:
        """Short text."""
        lines = f", {len(self.lines)} lines" if self.lines else ""
        held = f", {len(self.detection)} detection lines" if self.detection else ""
        repeats = f", {self.periods} periods of {self.period}" if self.period else ""
        return (
            f"Signal({self.name!r}: {self.kind}, {self.values.size} samples at {self.rate:.6g} Hz"
            f"{repeats}{lines}{held}, {self.values.min():.4g} .. {self.values.max():.4g} "
            f"{self.unit}, rms {self.rms:.4g})"
        )
