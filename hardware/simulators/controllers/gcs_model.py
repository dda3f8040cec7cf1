"""What kind of GCS controller is simulated, and how it refuses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from hardware.simulators.controllers.watchdog import CommandWatchdog

Arguments: TypeAlias = Sequence[str]
Acts: TypeAlias = dict[str, Callable[[Arguments], None]]
Asks: TypeAlias = dict[str, Callable[[Arguments], list[str]]]


class Refusal(Exception):
    """A command that the controller does not obey; the number is that of the public error list."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


@dataclass(frozen=True, slots=True)
class GcsModel:
    """A digital piezo controller of one axis.

    Parameters
    ----------
    identity : str
        Answer to ``*IDN?``.
    axis, stage : str
        Identifier of the axis and name of the stage on it.
    lowest, highest : float
        Voltages that the amplifier gives (V).
    travel : tuple of float
        Ends of the closed-loop range (um).
    servo_time : float
        Period of the servo and of the wave generator (s).
    tables, points : int
        Recorder tables and points of all of them together; as many for the wave tables.
    arguments : int
        Most arguments of one command.
    noise : float
        Standard deviation of its own position sensor (m).
    voltage_noise : float
        Standard deviation of its voltage reading (V).
    closed_gain : float
        Part of the position error that the servo removes in a millisecond.
    tolerance : float
        Position error that counts as on target (um).
    watchdog : CommandWatchdog, optional
        None as in the public documents; an option of some special firmware.
    seed : int
        Of the noise.
    """

    identity: str = "(c)Simulated Instruments,E-700.1CD,0120034567,1.02.3"
    axis: str = "1"
    stage: str = "SIMSTACK"
    lowest: float = -20.0
    highest: float = 120.0
    travel: tuple[float, float] = (0.0, 4.0)
    servo_time: float = 50e-6
    tables: int = 4
    points: int = 262144
    arguments: int = 32
    noise: float = 0.0
    voltage_noise: float = 0.0
    closed_gain: float = 0.2
    tolerance: float = 0.005
    watchdog: CommandWatchdog | None = None
    seed: int = 0
