"""A waveform written by compiled code in a thread of its own, to a card mapped into memory.

The instants are those of the computer's monotonic clock, as of `WallClock`. The accuracy is that of
the operating system: run the program with real-time priority (``chrt -f 50``) where samples must
not be late.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Iterator
from functools import lru_cache
from importlib.resources import files
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from bondgraph.support.native import build
from hardware.contracts import Chunk, Flag, WallClock, WaveProgress
from hardware.devices.amplifier.data import Amplifier
from hardware.devices.daq.card import Card
from hardware.devices.daq.card_wave import REPORT, CardWave, CardWiring, LoadedWave, SampleClock
from hardware.devices.daq.codes import input_volts
from hardware.devices.daq.mapped import MappedRegisters
from hardware.errors import DriverMissing, HardwareError, TimedOut

_FLAGS = ("-O2", "-fPIC", "-shared", "-Wall")
_PLAYING, _DONE, _STOPPED, _GONE, _ENDLESS = range(5)
_CLOCKING = {SampleClock.NONE: 0, SampleClock.TOGGLE: 1, SampleClock.PULSE: 2}
_POINTERS = ("output", "digital", "start", "inputs", "control", "codes")


class _Playback(ctypes.Structure):
    _fields_ = (
        *((n, ctypes.c_void_p) for n in (*_POINTERS, "instants", "lateness", "readings")),
        ("total", ctypes.c_int64),
        *((n, ctypes.c_double) for n in ("period", "closest", "lead", "spin", "patience")),
        ("converting", ctypes.c_uint32),
        ("enable", ctypes.c_uint32),
        ("hold", ctypes.c_uint32),
        *((n, ctypes.c_int32) for n in ("monitors", "lines", "trigger", "clock", "clocking")),
        ("position", ctypes.c_int64),
        ("stop", ctypes.c_int32),
        ("state", ctypes.c_int32),
    )


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL:
    path = build(files("hardware.devices.daq").joinpath("player.c").read_text(), _FLAGS)
    if path is None:
        raise DriverMissing(
            "the compiled player needs gcc; install it, or play with SoftwareTimedWave"
        )
    library = ctypes.CDLL(str(path))
    library.play.argtypes = [ctypes.POINTER(_Playback)]
    library.play.restype = None
    return library


class _Run:
    """One waveform under way, with the arrays that the compiled code fills."""

    def __init__(
        self,
        wave: LoadedWave,
        playback: _Playback,
        kept: tuple[Any, ...],
        arrays: dict[str, Any],
    ) -> None:
        self.wave = wave
        self.playback = playback
        self.kept = kept
        self.arrays = arrays
        self.thread = threading.Thread(target=_library().play, args=(playback,), daemon=True)

    @property
    def position(self) -> int:
        """Samples written; what lies before it is complete."""
        return int(self.playback.position)

    def end(self) -> None:
        """Stop and wait for the thread; a conversion under way is given its time."""
        self.playback.stop = 1
        if self.thread.ident is not None:
            self.thread.join(1.0)


@final
class CompiledWave(CardWave):
    """Plays in a thread of its own; needs registers mapped into memory and the wall clock.

    Parameters
    ----------
    card, amplifier, wiring, haste
        See `CardWave`.
    spin : float
        Time before every instant that is spent in a loop instead of asleep (s): the system wakes a
        sleeper late. A whole period keeps one processor busy.

    Raises
    ------
    UnusableInput
        The registers are not in memory, such as those of a simulator.
    DriverMissing
        There is no compiler.
    """

    def __init__(
        self,
        card: Card,
        amplifier: Amplifier,
        wiring: CardWiring | None = None,
        *,
        haste: float = 1.1,
        spin: float = 200e-6,
    ) -> None:
        super().__init__(card, amplifier, wiring, haste=haste)
        if not isinstance(card.registers, MappedRegisters):
            raise UnusableInput(
                f"{card.registers.address}: compiled code needs registers in memory; use "
                "SoftwareTimedWave here"
            )
        _library()
        self._registers = card.registers
        self._clock = WallClock()
        self._spin = spin
        self._run: _Run | None = None

    @property
    def position(self) -> int:
        """Samples of the last waveform that were really written."""
        return 0 if self._run is None else self._run.position

    def abort(self) -> None:
        """Stop before the next sample."""
        if self._run is not None:
            self._run.end()

    def _begin(self, wave: LoadedWave) -> Iterator[WaveProgress]:
        if self._names:
            self._card.select(self._wiring.monitors)
        run = self._prepared(wave)
        self._run = run
        return self._play(run)

    def _play(self, run: _Run) -> Iterator[WaveProgress]:
        total, reported, late = run.wave.total, 0, 0
        try:
            if not run.playback.stop:
                run.thread.start()
            while reported < total:
                if alive := run.thread.is_alive():
                    self._clock.sleep(REPORT)
                    alive = run.thread.is_alive()
                position = run.position
                if position > reported:
                    chunk = self._between(run, reported, position)
                    late += int(np.count_nonzero(chunk.flags & Flag.LATE))
                    reported = position
                    yield WaveProgress(reported, total, late, (chunk,))
                elif not alive:
                    self._raise_for(run.playback.state)
                    return
                else:
                    yield WaveProgress(reported, total, late)
        finally:
            run.end()
            self._card.lines_access(run.playback.lines)
            self._lower_lines()

    def _raise_for(self, state: int) -> None:
        """Turn the end of the thread into an error; all that was written has been reported."""
        error: HardwareError | None = None
        if state == _GONE:
            # the register itself tells whether the card is gone or was switched off
            self._card.control()
            self._card.forget()
            error = self._card.gone()
        elif state == _ENDLESS:
            self._card.forget_inputs()
            error = TimedOut(
                f"{self._card.layout.model} ({self._registers.address}): a conversion did not end; "
                "switch the card off and on"
            )
        if error is not None:
            raise error.carrying(())

    def _between(self, run: _Run, first: int, end: int) -> Chunk:
        here = slice(first, end)
        columns = self._columns()
        readings = input_volts(run.arrays["readings"][here])[:, columns]
        return self._chunk(
            run.wave, first, run.arrays["instants"][here], run.arrays["lateness"][here], readings
        )

    def _columns(self) -> list[int]:
        """Column of every monitor: the card's queue runs from the lowest input up."""
        ordered = sorted(self._wiring.monitors)
        return [ordered.index(c) for c in self._wiring.monitors]

    def _prepared(self, wave: LoadedWave) -> _Run:
        m, w, total = self._card.layout, self._wiring, wave.total
        data = ctypes.c_char.from_buffer(self._registers.window(m.data_bar))
        control = ctypes.c_char.from_buffer(self._registers.window(m.control_bar))
        base = ctypes.addressof(data)
        arrays: dict[str, NDArray[Any]] = {
            "instants": np.zeros(total),
            "lateness": np.zeros(total),
            "readings": np.zeros((total, len(self._names)), np.uint16),
        }
        playback = _Playback(
            output=base + self._card.output_access(w.output, 0).offset,
            digital=base + m.digital,
            start=base + m.start,
            inputs=base + m.inputs,
            control=ctypes.addressof(control) + m.control,
            codes=wave.codes.ctypes.data,
            total=total,
            period=1.0 / wave.rate,
            closest=1.0 / (wave.rate * self.haste),
            lead=1e-3,
            spin=self._spin,
            patience=self._card.timeout,
            converting=m.converting,
            enable=m.enable,
            hold=m.hold,
            monitors=len(self._names),
            lines=self._card.lines,
            trigger=0 if w.trigger is None else 1 << w.trigger,
            clock=0 if w.clock is None else 1 << w.clock,
            clocking=0 if w.clock is None else _CLOCKING[w.clocking],
            **{k: a.ctypes.data for k, a in arrays.items()},
        )
        return _Run(wave, playback, (data, control), arrays)
