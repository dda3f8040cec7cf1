"""Waveforms through the same envelope, and the way down when one is broken off."""

from __future__ import annotations

import math
import threading
from collections.abc import Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import NoReturn, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.contracts import WaveProgress
from hardware.envelope.guard import GuardedOutput
from hardware.envelope.marks import marked
from hardware.envelope.plain_numbers import finite_number, finite_wave
from hardware.envelope.raw_wave import RawWave
from hardware.envelope.readiness import (
    overstay,
    refuse_again,
    require_open,
    require_ready,
    require_rest,
)
from hardware.envelope.runs import trail
from hardware.envelope.wave import check_join, check_wave
from hardware.errors import HardwareError, LimitViolation, Overrun, ProtocolFault

PATIENCE = 1.0
"""How long a stop waits for another thread that is inside the player (s, real time)."""
LATE, SLACK = 1.01, 0.1
"""Share of its length, and time (s), by which one that tells nothing may come late to its end."""


@dataclass(frozen=True, slots=True, eq=False)
class _Prepared:
    volts: Array
    rate: float
    cut: NDArray[np.bool_]


@final
class GuardedWave:
    """A `WaveOut`.

    Parameters
    ----------
    output : GuardedOutput
        Guard of the same device; its envelope, converter and clamping hold here too.
    raw : RawWave
        Handed over for good.

    Examples
    --------
    >>> from hardware import P840_1_UNIPOLAR, check_wave
    >>> swing = 40.0 - 40.0 * np.cos(2 * np.pi * 10.0 * np.arange(100) * 1e-3)
    >>> check_wave(P840_1_UNIPOLAR, swing, 1e3)  # what prepare() of a guarded wave asks first
    """

    __slots__ = (
        "_count", "_end", "_idle", "_inside", "_looked", "_output", "_player", "_playing",
        "_prepared", "_raw", "_samples", "_since",
    )  # fmt: skip

    def __init__(self, output: GuardedOutput, raw: RawWave) -> None:
        refuse_again(self)
        self._output = output
        self._raw = raw
        self._prepared: _Prepared | None = None
        self._playing: _Prepared | None = None
        self._samples = 0
        self._count, self._since, self._looked, self._end = 0, 0.0, 0.0, 0.0
        self._inside = False
        self._player = 0
        self._idle = threading.Event()
        self._idle.set()

    @property
    def rate(self) -> float:
        """Nominal rate of the prepared waveform (Hz); NaN before one is prepared."""
        return math.nan if (prepared := self._prepared) is None else prepared.rate

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
        line = self._output._line
        try:
            prepared = self._judged(volts, rate)
        except BaseException:
            with line.lock:
                if line.halt is None:
                    self._prepared = None
            raise
        with line.lock:
            require_open(line, "prepare")
            require_rest(line, "prepare")
            self._prepared = prepared
            if self._output.present is not None:
                self._load(prepared)

    def play(self) -> Generator[WaveProgress, None, None]:
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
        line = self._output._line
        with line.lock:
            if (prepared := self._prepared) is None:
                raise LimitViolation("play: no waveform is prepared; call prepare(volts, rate)")
            self._judge_start(prepared)
            if line.loaded is not prepared:
                self._load(prepared)
        return self._run(prepared)

    def abort(self) -> None:
        """Stop playing; never raises. The output stays where it is."""
        line = self._output._line
        with line.lock:
            if line.halt is not None:
                line.new_epoch()
                line.end_wave()

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        """Refuse copies."""
        raise TypeError("GuardedWave: cannot be copied or pickled; pass the object itself on")

    def _run(self, prepared: _Prepared) -> Generator[WaveProgress, None, None]:
        line = self._output._line
        with line.lock:
            if prepared is not self._prepared or line.loaded is not prepared:
                raise LimitViolation("play: another waveform was prepared since; call play() again")
            judged = line.epoch
            require_ready(line, "play")
            line.settle(judged)
            self._judge_start(prepared)
            epoch = line.whole(lambda: self._begun(prepared, judged))
        error: BaseException | None = None
        source: Iterator[WaveProgress] | None = None
        try:
            source = self._raw.play()
            while (written := self._next(source, prepared, epoch)) is not None:
                yield marked(written, prepared.cut)
            if self._samples != prepared.volts.size:
                raise ProtocolFault(
                    f"play: ended after {self._samples} of {prepared.volts.size} samples without "
                    "an error; see whether the device has stopped itself"
                )
            self._ended(prepared, epoch)
        except BaseException as caught:
            error = caught
            raise
        finally:
            if error is not None and epoch == line.epoch:
                self._rescue(error)
            _close(source)

    def _begun(self, prepared: _Prepared, judged: int) -> int:
        """Note that it plays from now on; return its number."""
        line = self._output._line
        epoch = line.new_epoch()
        if epoch != judged + 1:
            raise HardwareError("play: another command came in between; nothing was put out")
        self._playing = prepared
        self._samples = 0
        self._inside = False
        self._player = 0
        now = line.clock.now()
        self._count, self._since = 0, now if line.last is None else line.last
        self._looked, self._end = now, now + LATE * prepared.volts.size / prepared.rate + SLACK
        line.dwelling.moved(float(prepared.volts[0]), now)
        line.standing = self._standing
        line.halt = self._halted
        return epoch

    def _next(
        self, source: Iterator[WaveProgress], prepared: _Prepared, epoch: int
    ) -> WaveProgress | None:
        """Return the next report; None at the end."""
        written = self._output._line.whole(lambda: self._stepped(source, prepared, epoch))
        self._require_reign(epoch)
        return written

    def _stepped(
        self, source: Iterator[WaveProgress], prepared: _Prepared, epoch: int
    ) -> WaveProgress | None:
        line = self._output._line
        with line.lock:
            self._require_reign(epoch)
            if (late := line.overstayed()) is not None:
                # whoever raises out of here ramps down
                raise overstay(line, *late)
            self._player = threading.get_ident()
            # stays set if an interrupt ends the transfer: the last report is not the last sample
            self._inside = True
            self._idle.clear()
        written = self._advanced(source)
        with line.lock:
            self._require_reign(epoch)
            if written is None:
                return None
            self._samples = written.samples
            self._counted(written.samples, line.clock.now(), prepared.rate)
            if written.samples > 0:
                k = min(written.samples, prepared.volts.size) - 1
                line.reached(float(prepared.volts[k]), "playing a waveform")
            line.beat()
        return written

    def _advanced(self, source: Iterator[WaveProgress]) -> WaveProgress | None:
        try:
            written = next(source, None)
            self._inside = False
            return written
        except Exception as error:
            self._output._line.lose(error, "play")
            raise
        finally:
            self._idle.set()

    def _require_reign(self, epoch: int) -> None:
        if epoch != self._output._line.epoch:
            raise LimitViolation("play: the waveform was ended by another command")

    def _ended(self, prepared: _Prepared, epoch: int) -> None:
        """Note the regular end; the last voltage stays."""
        line, envelope, trailing = self._output._line, self._output.envelope, list[float | None]()
        for dwell in envelope.dwell:
            above = dwell.level > envelope.safe
            beyond = prepared.volts > dwell.level if above else prepared.volts < dwell.level
            trailing.append(None if beyond.all() else trail(beyond) / prepared.rate)

        def noted() -> None:
            self._require_reign(epoch)
            line.halt = None
            # it may have come to its end long before somebody asked
            whole = self._count == prepared.volts.size
            line.dwelling.after_wave(trailing, self._since if whole else line.clock.now())
            line.reached(float(prepared.volts[-1]), "end of a waveform")

        with line.lock:
            line.whole(noted)

    def _halted(self) -> tuple[float, float] | None:
        """Abort; return where the output stands and where it may be (V), None if unknown."""
        self._raw.abort()
        if not self._idle.is_set() and self._player != threading.get_ident():
            # a player that has only just begun may not have heard it
            heard = self._idle.wait(PATIENCE)
            self._raw.abort()
            if not heard:
                return None
        prepared, line = self._playing, self._output._line
        if not self._player:
            # nobody has asked for a sample yet, and what is told is that of the last waveform
            return line.present, line.present
        count = getattr(self._raw, "position", None)
        if prepared is None or not isinstance(count, int) or not 0 <= count <= prepared.volts.size:
            return None
        line.interrupted = self._inside
        here = float(prepared.volts[count - 1]) if count else line.present
        after = min(count, prepared.volts.size - 1)
        return here, float(prepared.volts[after]) if self._inside else here

    def _counted(self, count: int, now: float, rate: float) -> None:
        """Note how many samples are out, and since when the last may be: no sooner than at `rate`.

        The next was not out when it was looked for last.
        """
        if (n := count - self._count) > 0:
            soonest = max(self._since + n / rate, self._looked + (n - 1) / rate)
            self._count, self._since = count, min(now, soonest)
        self._looked = now

    def _standing(self, now: float) -> tuple[float, float] | None:
        """Voltage put out last (V) and for how long (s); None if the player cannot tell.

        It is asked itself: one that goes on while nobody iterates is further than its last report.
        One that tells nothing while it plays stands at its end once its time is over.
        """
        prepared = self._playing
        told = getattr(self._raw, "position", 0) if self._player else 0
        if prepared is None:
            return None
        if not isinstance(told, int):
            return None if now <= self._end else (float(prepared.volts[-1]), now - self._end)
        self._counted(min(told, prepared.volts.size), now, prepared.rate)
        k = self._count - 1
        volts = self._output._line.present if k < 0 else float(prepared.volts[k])
        return volts, now - self._since

    def _rescue(self, error: BaseException) -> None:
        """Ramp down after `error`, which goes on; a failure of the ramp becomes its note."""
        try:
            self._output.stop()
        except Exception as second:
            error.add_note(f"the way down failed too: {second}; {self._output.status}")

    @property
    def _haste(self) -> float:
        return max(float(getattr(self._raw, "haste", 1.0)), 1.0)

    def _check_haste(self, wave: Array, rate: float) -> None:
        """Refuse what leaves the limits when the player hurries after a stall."""
        haste = self._haste
        if haste <= 1.0:
            return
        try:
            check_wave(self._output._line.envelope, wave, haste * rate)
        except LimitViolation as error:
            raise LimitViolation(
                f"{error}; this player runs up to {haste:g} times faster to catch up after a stall"
            ) from None

    def _judged(self, volts: ArrayLike, rate: float) -> _Prepared:
        """Return a copy that was held against the envelope."""
        wave, rate = finite_wave(volts, "wave"), finite_number(rate, "wave: rate")
        output, envelope = self._output, self._output.envelope
        low, high = output.limits
        cut = (wave < low) | (wave > high)
        rounding = (wave >= low - envelope.slack) & (wave <= high + envelope.slack)
        if output.clamp or rounding.all():
            wave = np.clip(wave, low, high)
            wave.setflags(write=False)
        check_wave(envelope, wave, rate, converter=output.converter, haste=self._haste)
        self._check_haste(wave, rate)
        return _Prepared(wave, rate, cut & ~rounding)

    def _judge_start(self, prepared: _Prepared) -> None:
        """Refuse to play from where the output stands now."""
        line, envelope = self._output._line, self._output.envelope
        require_ready(line, "play")
        check_join(envelope, line.present, float(prepared.volts[0]), prepared.rate, "entry")
        held = line.dwelling.held(line.clock.now())
        if any(held):
            check_wave(envelope, prepared.volts, prepared.rate, held=held)

    def _load(self, prepared: _Prepared) -> None:
        self._output._line.whole(lambda: self._loaded(prepared))

    def _loaded(self, prepared: _Prepared) -> None:
        line = self._output._line
        line.loaded = None
        try:
            self._raw.load(prepared.volts, prepared.rate)
        except (LimitViolation, Overrun, UnusableInput):
            # a refusal of the device's own, before anything moved
            self._prepared = None
            raise
        except Exception as error:
            self._prepared = None
            line.lose(error, "loading a waveform")
            raise
        line.loaded = prepared


def _close(source: Iterator[WaveProgress] | None) -> None:
    """Let the player clean up; what had to be said was said by the error before."""
    if isinstance(source, Generator):
        with suppress(HardwareError):
            source.close()
