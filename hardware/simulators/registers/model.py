"""The registers of a Humusoft card with their side effects.

Written from the public facts about these cards. Where a fact is doubtful the model takes the worse
one: the output registers wake up at 0x3FFF (+10 V), and enabling connects whatever they hold.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, final

import numpy as np

from hardware.simulators.registers.amplifier import AmplifierData, SimulatedAmplifier
from hardware.simulators.rig import DeviceClock, Rig

READ16, WRITE16, READ32, WRITE32 = range(4)
_CONVERTING, _HOLD, _ENABLE = 1 << 17, 1 << 23, 1 << 26
_ZERO, _TOP, _RESET = 0x2000, 0x3FFF, 0x3FFF
_STEP = 20.0 / 16384.0
_DATA_BAR = 2
_INPUTS, _DIGITAL, _START, _OUTPUTS = 0x00, 0x10, 0x20, 0x20
_LOG = 200_000


class Logged(NamedTuple):
    """One access as the card saw it; `instant` is the true time (s)."""

    instant: float
    kind: int
    bar: int
    offset: int
    value: int


@dataclass(slots=True)
class CardFaults:
    """What is wrong with the card; change it while it runs.

    Parameters
    ----------
    gone : bool
        Every read gives ones, writes do nothing.
    endless : bool
        A conversion never ends.
    looks : int
        Reads of the control register during which a conversion still runs.
    delay : float
        Answers come so much later (s of the computer).
    cut : int
        Accesses after which the connection is cut, in the middle of an answer; 0 for never.
    """

    gone: bool = False
    endless: bool = False
    looks: int = 0
    delay: float = 0.0
    cut: int = 0


@dataclass(frozen=True, slots=True)
class Wires:
    """What is connected to the card.

    Parameters
    ----------
    output : int
        Output to the amplifier.
    voltage, current : int
        Inputs from its monitors.
    trigger : int
        Digital output to the trigger line of the bench.
    both_edges : bool
        Whether falling edges count as well.
    noise : float
        Of the inputs, standard deviation (V).
    position : int
        Input from a readout of the displacement.
    readout : float
        Of that (V/m); 0 if nothing is wired there.
    """

    output: int = 0
    voltage: int = 0
    current: int = 1
    trigger: int = 0
    both_edges: bool = False
    noise: float = 0.3e-3
    position: int = 2
    readout: float = 0.0


@final
class RegisterModel:
    """The card itself; the accesses of an accessor in the same process are its methods.

    Parameters
    ----------
    rig : Rig
        The bench behind it.
    model : str
        ``"MF634"`` or ``"MF624"``.
    amplifier : AmplifierData
        Between its output and the terminals.
    wires : Wires
        What is connected.
    clock : DeviceClock
        Its seed is that of the noise; its rate is the business of the program's clock, because
        the program paces these cards.
    """

    CONTROL: ClassVar[dict[str, tuple[int, int]]] = {"MF624": (0, 0x54), "MF634": (3, 0x68)}

    def __init__(
        self,
        rig: Rig,
        model: str = "MF634",
        amplifier: AmplifierData | None = None,
        wires: Wires | None = None,
        clock: DeviceClock | None = None,
    ) -> None:
        if model not in self.CONTROL:
            raise ValueError(f"no card {model!r}; choose {', '.join(self.CONTROL)}")
        self.rig = rig
        self.model = model
        self.faults = CardFaults()
        self.lines_in = 0
        self.log: deque[Logged] = deque(maxlen=_LOG)
        self._where = self.CONTROL[model]
        self._wires = Wires() if wires is None else wires
        self._amplifier = SimulatedAmplifier(rig, amplifier or AmplifierData())
        self._rng = np.random.default_rng(clock.seed if clock else 0)
        self._wake_up()
        self._amplifier.settle()

    def _wake_up(self) -> None:
        self._registers = [_RESET] * 8
        self._outputs = [_RESET] * 8
        self._control = 0
        self._lines = 0
        self._scan = 0
        self._queue: deque[int] = deque()
        self._looks = 0

    @property
    def address(self) -> str:
        """For messages."""
        return f"simulated {self.model}"

    @property
    def terminals(self) -> tuple[float, ...]:
        """Voltages at its outputs (V)."""
        if not self._control & _ENABLE:
            return (0.0,) * 8
        return tuple((c - _ZERO) * _STEP for c in self._outputs)

    def power_cycle(self) -> None:
        """Switch the computer off and on: registers wake up, outputs are grounded."""
        with self.rig.lock:
            self._wake_up()
            self._amplifier.follow(0.0)

    def access(self, kind: int, bar: int, offset: int, value: int = 0) -> int:
        """One access; what is read, 0 for a write."""
        with self.rig.lock:
            if self.faults.gone:
                result = (0xFFFF, 0, 0xFFFFFFFF, 0)[kind]
            elif kind == READ32 or kind == WRITE32:
                result = self._wide(kind, bar, offset, value)
            elif bar != _DATA_BAR:
                result = 0
            elif kind == READ16:
                result = self._read(offset)
            else:
                result = 0
                self._write(offset, value)
            seen = value if kind in (WRITE16, WRITE32) else result
            self.log.append(Logged(self.rig.now, kind, bar, offset, seen))
            return result

    def read16(self, bar: int, offset: int) -> int:
        """Read 16 bits."""
        return self.access(READ16, bar, offset)

    def write16(self, bar: int, offset: int, value: int) -> None:
        """Write 16 bits."""
        self.access(WRITE16, bar, offset, value)

    def read32(self, bar: int, offset: int) -> int:
        """Read 32 bits."""
        return self.access(READ32, bar, offset)

    def write32(self, bar: int, offset: int, value: int) -> None:
        """Write 32 bits."""
        self.access(WRITE32, bar, offset, value)

    def batch(self, accesses: Iterable[tuple[int, int, int, int]]) -> list[int]:
        """Do several accesses (kind, bar, offset, value) in their order."""
        with self.rig.lock:
            return [self.access(*a) for a in accesses]

    def close(self) -> None:
        """Nothing: the card does not notice that a program goes, and keeps its outputs."""

    def _wide(self, kind: int, bar: int, offset: int, value: int) -> int:
        if (bar, offset) != self._where:
            return 0
        if kind == READ32:
            busy = self.faults.endless or self._looks > 0
            self._looks = max(self._looks - 1, 0)
            return self._control | (_CONVERTING if busy and self._scan else 0)
        self._control = value & ~_CONVERTING
        if not self._control & _HOLD:
            self._outputs = list(self._registers)
        self._drive()
        return 0

    def _read(self, offset: int) -> int:
        if offset == _INPUTS:
            return self._queue.popleft() if self._queue else 0
        if offset == _DIGITAL:
            return self.lines_in & 0xFF
        if offset == _START:
            self._convert()
        return 0

    def _write(self, offset: int, value: int) -> None:
        if offset == _INPUTS:
            self._scan = value & 0xFF
        elif offset == _DIGITAL:
            self._digital(value & 0xFF)
        elif _OUTPUTS <= offset < _OUTPUTS + 16 and offset % 2 == 0:
            n = (offset - _OUTPUTS) // 2
            self._registers[n] = value & _TOP
            if not self._control & _HOLD:
                self._outputs[n] = self._registers[n]
                self._drive()

    def _drive(self) -> None:
        self._amplifier.follow(self.terminals[self._wires.output])

    def _digital(self, lines: int) -> None:
        mask = 1 << self._wires.trigger
        before, self._lines = self._lines & mask, lines
        if (lines & mask) != before and (self._wires.both_edges or lines & mask):
            self.rig.trigger()

    def _convert(self) -> None:
        self._queue.clear()
        self._looks = self.faults.looks
        chosen = [n for n in range(8) if self._scan >> n & 1]
        if not chosen:
            return
        d, w = self._amplifier.data, self._wires
        volts = {w.voltage: d.voltage_monitor * self.rig.volts}
        if w.current in chosen:
            current = float(self.rig.seen(np.array([self.rig.now])).i[0])
            volts[w.current] = 0.0 if math.isnan(current) else d.current_monitor * current
        if w.readout and w.position in chosen:
            volts[w.position] = w.readout * float(self.rig.seen(np.array([self.rig.now])).x[0])
        for n in chosen:
            exact = volts.get(n, 0.0) + w.noise * float(self._rng.standard_normal())
            word = min(max(round(exact / _STEP), -_ZERO), _ZERO - 1)
            self._queue.append(word & _TOP)
