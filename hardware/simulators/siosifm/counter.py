"""The fringe counter: from what the rig does to the rows the library hands out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.arrays import Array
from hardware.simulators.noise import white
from hardware.simulators.rig import Rig
from hardware.simulators.siosifm.faults import Faults
from hardware.simulators.siosifm.optics import (
    VACUUM,
    AirAround,
    Quadrature,
    index_of_air,
    signals,
)

ROW = np.dtype(
    [
        ("length", "<f8"),
        ("raw", "<i8"),
        ("cosine", "<i4"),
        ("sine", "<i4"),
        ("norm", "<i4"),
        ("clock", "<u4"),
        ("sample", "<u4"),
        ("status", "<u4"),
    ]
)
"""One value as the stub library reads it."""

BEAM = 0x1 | 0x2
LEVEL = 0x2
STABLE = 0x10
WAS_UNSTABLE = 0x20
OVERFLOW_DEVICE = 0x100
OVERFLOW_LIBRARY = 0x200
MIRROR = 37.0
"""Frequency of the reference mirror's vibration (Hz)."""
WEAK = 0.12
"""Share of light below which the counter reports a low level."""


@dataclass(slots=True)
class Settings:
    """What the program has set.

    Parameters
    ----------
    dead_path : float
        m; in force from the next zero on.
    preset : float
        m; in force from the next zero on.
    edlen : bool
        Whether the device corrects for air.
    manual : dict of str to float
        Values of T (degC), P (Pa), H (%) given by the program.
    mirror : bool
        Whether the reference mirror vibrates.
    """

    dead_path: float = 0.0
    preset: float = 0.0
    edlen: bool = True
    manual: dict[str, float] = field(default_factory=dict)
    mirror: bool = False


@final
class Counter:
    """Phase, zero, status of one beam.

    Parameters
    ----------
    rig : Rig
        What the mirror stands on.
    faults : Faults
        Read anew for every sample.
    air : AirAround
        The true air.
    shape : Quadrature
        The detectors.
    dead_path : float
        True length of air before the zero position (m).
    noise : float
        Standard deviation of a reading (m).
    resolution : float
        Step of the counter (m).
    seed : int
        Of the noise.
    """

    def __init__(
        self,
        rig: Rig,
        faults: Faults,
        air: AirAround,
        shape: Quadrature,
        *,
        dead_path: float,
        noise: float,
        resolution: float,
        seed: int,
    ) -> None:
        self.rig, self.faults, self.air, self.shape = rig, faults, air, shape
        self.settings = Settings()
        self.ellipse_fit = False
        self.status = STABLE
        self.level = 1.0
        self.samples = 0
        self._true_path = dead_path
        self._noise, self._resolution, self._seed = noise, resolution, seed
        self._taken = 0
        self._fringes = 0
        self._beam_fault: int | None = None
        self.sensors_stopped: float | None = None
        self._zero_phase = 0.0
        self._zero_index = 1.0
        self._active_path = 0.0
        self._active_preset = 0.0

    # ---- air

    def sensors(self, t: Array) -> tuple[Array, Array, Array]:
        """Return what the device takes for T (degC), p (Pa), RH (%) at instants (s)."""
        read = np.floor(np.asarray(t, dtype=float))
        if self.faults.stale_air:
            self.sensors_stopped = (
                float(np.floor(self.rig.now))
                if (self.sensors_stopped is None)
                else self.sensors_stopped
            )
            read = np.minimum(read, self.sensors_stopped)
        else:
            self.sensors_stopped = None
        told = {"T": self.faults.temperature, "P": self.faults.pressure, "H": self.faults.humidity}
        told = {k: self.settings.manual.get(k, v) for k, v in told.items()}
        values = self.air.at(read)
        T, P, H = (
            v if told[k] is None else np.full_like(v, told[k])
            for k, v in zip("TPH", values, strict=True)
        )
        return T, P, H

    def index(self, t: Array) -> Array:
        """Index of air the device corrects with."""
        if not self.settings.edlen:
            return np.ones_like(t)
        return index_of_air(*self.sensors(t))

    # ---- zero

    def zero(self) -> None:
        """Set to zero here: settings come into force, flags of the beam are cleared."""
        now = np.array([self.rig.now])
        self._fringes = 0
        self._zero_phase = float(self._counted(self._phase(now), np.ones(1))[0])
        self._zero_index = float(self.index(now)[0])
        self._active_path = self.settings.dead_path
        self._active_preset = self.settings.preset
        self.status = STABLE
        if self.faults.beam_loss_at is not None and self._beam_fault == self.faults.beam_loss_at:
            self.faults.beam_loss_at = None
        self._beam_fault = None

    # ---- values

    def rows(
        self, instants: Array, first: int, own_time: Array, average: int = 1, period: float = 0.0
    ) -> NDArray[np.void]:
        """Take samples at true instants (s); `first` counts from the start of the measurement.

        With `average` each is the mean of so many primary values over its last period (s).
        """
        n = instants.size
        number = first + np.arange(n)
        level, status = self._faults(number)
        primary = self._phase(instants)
        for k in range(1, average):
            primary = primary + self._phase(instants - k * period / average)
        phase = primary / average + 2.0 * np.pi * self._jumps(number)
        random = white(self._seed, self._taken, n) / np.sqrt(average)
        noisy = phase + 4.0 * np.pi / VACUUM * self._noise * random
        u1, u2 = signals(noisy, level, self.shape)
        counted = self._counted(noisy, level)
        length = self._length(counted, instants)
        out = np.zeros(n, ROW)
        out["length"] = np.round(length / self._resolution) * (1e9 * self._resolution)
        out["raw"] = np.round(counted / (2.0 * np.pi) * 4096.0)
        out["cosine"], out["sine"] = np.round(u1), np.round(u2)
        out["norm"] = np.round(np.hypot(u1, u2))
        out["clock"] = np.mod(np.round(own_time * 50e6), 2.0**32)
        out["sample"] = (self.samples + np.arange(n)) & 0xFFFFFFFF
        out["status"] = status
        self.samples += n
        self._taken += n
        if n:
            self.status, self.level = int(status[-1]), float(level[-1])
        return out

    def skip(self, count: int) -> None:
        """Count samples that are lost."""
        self.samples += count

    def _phase(self, t: Array) -> Array:
        x = self.rig.seen(t).x
        if self.settings.mirror:
            x = x + self.faults.mirror_stroke * np.sin(2.0 * np.pi * MIRROR * t)
        n = index_of_air(*self.air.at(t))
        return np.asarray(4.0 * np.pi / VACUUM * n * (x + self._true_path))

    def _counted(self, phase: Array, level: Array) -> Array:
        """Phase as counted from the signals: with the periodic error of their figure."""
        if self.shape.ideal or self.ellipse_fit:
            return phase
        u1, u2 = signals(phase, np.maximum(level, 1e-3), self.shape)
        turn = np.arctan2(u2, u1) - phase
        return np.asarray(phase + np.arctan2(np.sin(turn), np.cos(turn)))

    def _length(self, counted: Array, t: Array) -> Array:
        n = self.index(t)
        x = (counted - self._zero_phase) * VACUUM / (4.0 * np.pi * n)
        return np.asarray(
            x - self._active_path * (1.0 - self._zero_index / n) + self._active_preset
        )

    def _faults(self, number: NDArray[np.int64]) -> tuple[Array, NDArray[np.uint32]]:
        f = self.faults
        status = np.full(number.size, self.status | STABLE, np.uint32)
        level = np.full(number.size, 1.0)
        if f.fade_from is not None:
            level = np.clip(1.0 - (number - f.fade_from) / max(f.fade_samples, 1), 0.0, 1.0)
            self._latch(status, level < WEAK, LEVEL)
            self._latch(status, level <= 0.0, BEAM)
        if f.beam_loss_at is not None:
            self._latch(status, number >= f.beam_loss_at, f.beam_bits)
        if f.overrun_at is not None:
            self._latch(status, number >= f.overrun_at, OVERFLOW_DEVICE)
        if f.laser_unstable_at is not None:
            bad = number >= f.laser_unstable_at
            status[bad] &= ~np.uint32(STABLE)
            self._latch(status, bad, WAS_UNSTABLE)
        return level, status

    @staticmethod
    def _latch(status: NDArray[np.uint32], where: NDArray[np.bool_], bits: int) -> None:
        """Set bits from the first true place on."""
        hits = np.flatnonzero(where)
        if hits.size:
            status[hits[0] :] |= np.uint32(bits)

    def _jumps(self, number: NDArray[np.int64]) -> Array:
        at = self.faults.beam_loss_at
        jumps = np.full(number.size, float(self._fringes))
        if at is not None and self._beam_fault is None:
            jumps[number >= at] += self.faults.fringes
            if number.size and number[-1] >= at:
                self._fringes += self.faults.fringes
                self._beam_fault = at
        return jumps
