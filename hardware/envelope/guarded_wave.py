"""Waveforms through the same envelope, and the way down when one is broken off."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol, final, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.errors import UnusableInput
from hardware.contracts import Chunk, Flag, Written
from hardware.envelope.guard import GuardedOutput
from hardware.envelope.plain_numbers import finite_number, finite_wave
from hardware.envelope.runs import trail
from hardware.envelope.wave import check_join, check_wave
from hardware.errors import HardwareError, LimitViolation, Overrun, ProtocolFault

__all__ = ["GuardedWave", "RawWave"]

Array = NDArray[np.float64]


@runtime_checkable
class RawWave(Protocol):
    """A player of waveforms without protection, on the same device as a raw output.

    Give it an attribute ``position``, how many samples were really put out, valid after `abort`.
    Without it a waveform that is broken off leaves the output unknown: it is looked for by its
    read-back or, if the device has none, powered up anew. One that may run faster than asked to
    catch up after a stall says how much in an attribute ``haste`` (1.1: a tenth).
    """

    def load(self, volts: Array, rate: float) -> None:
        """Transfer a waveform (V at the actuator, (n,)) and its rate (Hz); nothing moves."""
        ...

    def play(self) -> Iterator[Written]:
        """Play what was loaded; yields about every 20 ms, and at the end."""
        ...

    def abort(self) -> None:
        """End playing at once: no further sample is put out. Never raises."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class _Prepared:
    volts: Array
    rate: float
    cut: NDArray[np.bool_]
    loaded: bool


@final
class GuardedWave:
    """A `WaveOut`.

    Parameters
    ----------
    output : GuardedOutput
        Guard of the same device; its envelope, converter and clamping hold here too.
    raw : RawWave
        Handed over for good.
    """

    __slots__ = ("_inside", "_output", "_prepared", "_raw", "_samples")

    def __init__(self, output: GuardedOutput, raw: RawWave) -> None:
        self._output = output
        self._raw = raw
        self._prepared: _Prepared | None = None
        self._samples = 0
        self._inside = False

    @property
    def rate(self) -> float:
        """Nominal rate of the prepared waveform (Hz); NaN before one is prepared."""
        return math.nan if self._prepared is None else self._prepared.rate

    @property
    def samples(self) -> int:
        """Samples reported as put out since the start of the last waveform."""
        return self._samples

    def prepare(self, volts: ArrayLike, rate: float) -> None:
        """Check a waveform (V, (n,)) at a rate (Hz) against the envelope and load a copy of it.

        The step from the present voltage into it is judged by `play`, so that a ramp to its first
        sample can come in between. An output that is not powered up is loaded by `play`.

        Raises
        ------
        LimitViolation
            Before a byte is sent.
        HardwareError
            Of the device.
        """
        output, line = self._output, self._output._line
        if line.halt is not None:
            raise LimitViolation("prepare: a waveform is playing; end it with stop() first")
        self._prepared = None
        wave = finite_wave(volts, "wave")
        low, high = output.limits
        cut = (wave < low) | (wave > high)
        rounding = (wave >= low - line.envelope.slack) & (wave <= high + line.envelope.slack)
        if output.clamp or rounding.all():
            wave = np.clip(wave, low, high)
            wave.setflags(write=False)
        check_wave(line.envelope, wave, rate, converter=output.converter)
        self._check_haste(wave, finite_number(rate, "wave"))
        with line.lock:
            known = output.present is not None
            self._prepared = _Prepared(wave, finite_number(rate, "wave"), cut & ~rounding, False)
            if known:
                self._load()

    def play(self) -> Generator[Written, None, None]:
        """Play the prepared waveform; the last voltage stays.

        Any error, also of the one who iterates, ends it with a ramp to the safe value; so close
        the iterator (or use `parked`) when you leave it early.

        Raises
        ------
        LimitViolation
            The step into it or the time beyond a level is not allowed; nothing moved.
        HardwareError
            Of the device.
        """
        output, line = self._output, self._output._line
        prepared = self._require("play")
        with line.lock:
            output._ready("play")
            envelope, present = line.envelope, line.present
            check_join(envelope, present, float(prepared.volts[0]), prepared.rate, "entry")
            held = line.dwelling.held(line.clock.now())
            if any(held):
                check_wave(envelope, prepared.volts, prepared.rate, held=held)
            if not prepared.loaded:
                self._load()
        return self._run(self._require("play"))

    def abort(self) -> None:
        """Stop playing; never raises. The output stays where it is."""
        line = self._output._line
        with line.lock:
            if line.halt is not None:
                line.new_epoch()
                line.end_wave()

    def _run(self, prepared: _Prepared) -> Generator[Written, None, None]:
        line = self._output._line
        with line.lock:
            self._output._ready("play")
            if prepared is not self._prepared:
                raise LimitViolation("play: another waveform was prepared since; call play() again")
            check_join(
                line.envelope, line.present, float(prepared.volts[0]), prepared.rate, "entry"
            )
            line.settle()
            epoch = line.new_epoch()
            self._samples = 0
            self._inside = False
            line.dwelling.moved(float(prepared.volts[0]), line.clock.now())
            line.halt = self._halted
        error: BaseException | None = None
        source: Iterator[Written] | None = None
        try:
            source = self._raw.play()
            while (written := self._next(source, epoch)) is not None:
                yield _marked(written, prepared.cut)
            if self._samples != prepared.volts.size:
                raise ProtocolFault(
                    f"play: ended after {self._samples} of {prepared.volts.size} samples without "
                    "an error; see whether the device has stopped itself"
                )
            self._ended(prepared)
        except BaseException as caught:
            error = caught
            raise
        finally:
            if error is not None and epoch == line.epoch:
                self._rescue(error)
            _close(source)

    def _next(self, source: Iterator[Written], epoch: int) -> Written | None:
        """Return the next report; None at the end."""
        line = self._output._line
        with line.lock:
            self._require_reign(epoch)
        # stays set if an interrupt ends the transfer: then the last report is not the last sample
        self._inside = True
        try:
            written = next(source, None)
        except Exception as error:
            line.lose(error, "play")
            raise
        self._inside = False
        with line.lock:
            self._require_reign(epoch)
            if written is None:
                return None
            self._samples = written.samples
            if written.samples > 0:
                prepared = self._require("play")
                k = min(written.samples, prepared.volts.size) - 1
                line.reached(float(prepared.volts[k]), "playing a waveform")
            line.beat()
        return written

    def _require_reign(self, epoch: int) -> None:
        if epoch != self._output._line.epoch:
            raise LimitViolation("play: the waveform was ended by another command")

    def _ended(self, prepared: _Prepared) -> None:
        """Note the regular end: the last voltage stays, and the time beyond levels counts on."""
        line, envelope = self._output._line, self._output.envelope
        trailing: list[float | None] = []
        for dwell in envelope.dwell:
            above = dwell.level > envelope.safe
            beyond = prepared.volts > dwell.level if above else prepared.volts < dwell.level
            trailing.append(None if beyond.all() else trail(beyond) / prepared.rate)
        with line.lock:
            line.halt = None
            line.dwelling.after_wave(trailing, line.clock.now())
            line.reached(float(prepared.volts[-1]), "end of a waveform")

    def _halted(self) -> float | None:
        """Abort, and return where the output stands (V), None if nobody can tell."""
        self._raw.abort()
        prepared, line = self._require("abort"), self._output._line
        count = getattr(self._raw, "position", None)
        if not isinstance(count, int) or not 0 <= count <= prepared.volts.size:
            return None
        line.interrupted = self._inside
        return float(prepared.volts[count - 1]) if count else line.present

    def _rescue(self, error: BaseException) -> None:
        """Ramp down after `error`, which goes on; a failure of the ramp becomes its note."""
        try:
            self._output.stop()
        except Exception as second:
            error.add_note(f"the way down failed too: {second}; {self._output.status}")

    def _check_haste(self, wave: Array, rate: float) -> None:
        """Refuse what leaves the limits when the player hurries after a stall."""
        haste = float(getattr(self._raw, "haste", 1.0))
        if haste <= 1.0:
            return
        try:
            check_wave(self._output._line.envelope, wave, haste * rate)
        except LimitViolation as error:
            raise LimitViolation(
                f"{error}; this player runs up to {haste:g} times faster to catch up after a stall"
            ) from None

    def _load(self) -> None:
        prepared = self._require("load")
        try:
            self._raw.load(prepared.volts, prepared.rate)
        except (LimitViolation, Overrun, UnusableInput):
            # a refusal of the device's own, before anything moved
            self._prepared = None
            raise
        except Exception as error:
            self._prepared = None
            self._output._line.lose(error, "loading a waveform")
            raise
        self._prepared = replace(prepared, loaded=True)

    def _require(self, what: str) -> _Prepared:
        if self._prepared is None:
            raise LimitViolation(f"{what}: no waveform is prepared; call prepare(volts, rate)")
        return self._prepared


def _close(source: Iterator[Written] | None) -> None:
    """Let the player clean up; what had to be said was said by the error before."""
    if isinstance(source, Generator):
        with suppress(HardwareError):
            source.close()


def _marked(written: Written, cut: NDArray[np.bool_]) -> Written:
    """Return the report with the samples flagged that were cut to the limits."""
    if not cut.any():
        return written
    return replace(written, chunks=_flagged(written.chunks, cut))


def _flagged(chunks: Sequence[Chunk], cut: NDArray[np.bool_]) -> tuple[Chunk, ...]:
    marked = []
    for chunk in chunks:
        flags = chunk.flags.copy()
        here = cut[chunk.first : chunk.first + chunk.n]
        flags[: here.size][here] |= np.uint16(Flag.CLAMPED)
        marked.append(replace(chunk, flags=flags))
    return tuple(marked)
