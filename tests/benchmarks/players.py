"""How well a player keeps time on this machine.

Prints, for rising rates, what 0.3 s of playing do: over plain memory (what program and system cost,
without a bus), and over TCP to the simulated card. On a busy machine the numbers are those of its
scheduler; ``chrt -f 20 bondsight bench players`` shows what the players can do.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hardware.devices.amplifier import Amplifier, Monitors
from hardware.devices.daq.card import MF634
from hardware.devices.daq.card_wave import CardWave, CardWiring
from hardware.devices.daq.compiled_wave import CompiledWave
from hardware.devices.daq.mapped import MemoryRegisters
from hardware.devices.daq.registers import Registers
from hardware.devices.daq.socket_registers import SocketRegisters
from hardware.devices.daq.wave import SoftwareTimedWave

_AMPLIFIER = Amplifier(gain=20.0, monitors=Monitors(voltage=0.05, current=50.0))
_RATES = (1e3, 3.125e3, 10e3, 50e3, 200e3, 500e3)


@dataclass(frozen=True, slots=True)
class RunTiming:
    """What a run has shown.

    Parameters
    ----------
    asked, reached : float
        Rate (Hz).
    jitter : float
        Standard deviation of the instants about the schedule (s).
    middle, worst : float
        Median and largest delay behind the schedule (s).
    late : float
        Share of samples written later than half a period.
    """

    asked: float
    reached: float
    jitter: float
    middle: float
    worst: float
    late: float

    def __str__(self) -> str:
        """One line for a person."""
        return (
            f"{self.asked:8.0f} Hz asked, {self.reached:9.1f} reached, jitter "
            f"{1e6 * self.jitter:8.2f} us, delay {1e6 * self.middle:7.2f} us (worst "
            f"{1e6 * self.worst:9.1f}), late {100 * self.late:6.2f} %"
        )


def measure(wave: CardWave, rate: float, seconds: float = 0.3) -> RunTiming:
    """Play a sine and look at the instants.

    Parameters
    ----------
    wave : CardWave
        On a clock that is the computer's.
    rate : float
        Hz.
    seconds : float
        Length.
    """
    n = max(int(rate * seconds), 16)
    wave.load(50.0 - 50.0 * np.cos(2 * np.pi * 2.0 * np.arange(n) / rate), rate)
    reports = list(wave.play())
    at = np.concatenate([c.channels["instant"] for r in reports for c in r.chunks])
    delay = at - np.arange(n) / rate
    # the schedule's start is not reported; the earliest sample cannot be before it
    delay = delay - delay.min()
    return RunTiming(
        rate,
        (n - 1) / (at[-1] - at[0]),
        float(delay.std()),
        float(np.median(delay)),
        float(delay.max()),
        reports[-1].late / n,
    )


@contextlib.contextmanager
def _simulated() -> Iterator[Registers]:
    from hardware.simulators.plant_contract import PlantMotion
    from hardware.simulators.registers import CardFront
    from hardware.simulators.rig import Rig

    class Still:
        step = 1e-3

        def advance(self, volts: np.ndarray) -> PlantMotion:
            return PlantMotion(1e-8 * volts, np.zeros(volts.size))

    front = CardFront(Rig(Still()))
    registers = SocketRegisters(front.start())
    try:
        yield registers
    finally:
        registers.close()
        front.stop()


def _table(
    kind: type[CardWave], registers: Registers, title: str, rates: tuple[float, ...]
) -> None:
    for monitors in ((), (0, 1)):
        print(f"{title}, {len(monitors)} inputs")
        for rate in rates:
            card = MF634(registers)
            card.power_up()
            print(measure(kind(card, _AMPLIFIER, CardWiring(monitors=monitors, trigger=0)), rate))


def bench_players() -> None:
    """Print the tables."""
    _table(SoftwareTimedWave, MemoryRegisters(), "Python over plain memory", _RATES[:4])
    _table(CompiledWave, MemoryRegisters(), "compiled over plain memory", _RATES)
    with _simulated() as registers:
        _table(SoftwareTimedWave, registers, "Python over TCP to the simulated card", _RATES[:3])
