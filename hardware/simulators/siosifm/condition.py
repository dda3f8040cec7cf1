"""What the simulated interferometer answers about itself: identity, health, air."""

from __future__ import annotations

import struct

import numpy as np

from hardware.simulators.rig import Rig
from hardware.simulators.siosifm.counter import Counter
from hardware.simulators.siosifm.optics import VACUUM

Answer = tuple[int, bytes]

REQUEST, USB = -11, -12


class Condition:
    """The part of the device that only tells.

    Parameters
    ----------
    rig : Rig
        The bench.
    counter : Counter
        The beam.
    serial : int
        Number on the bus.
    """

    def __init__(self, rig: Rig, counter: Counter, serial: int) -> None:
        self.counter = counter
        self._rig = rig
        self._serial = serial
        self._lost = 0
        self._air_asked = self._quality_asked = -1.0

    def _do_search(self) -> int:
        return 1

    def _do_usbserial(self, number: str) -> int:
        return self._serial if number == "0" else USB

    def _do_firmware(self) -> int:
        return 314

    def _do_channels(self) -> int:
        return 1

    def _do_type(self) -> int:
        return 2

    def _do_property(self, number: str) -> int:
        return int(number == "1")

    def _do_text(self, number: str) -> Answer:
        text = f"B{self._serial:06d}" if number == "32" else "3.14 simulated"
        return 0, text.encode()

    def _do_status(self) -> int:
        return self.counter.status

    def _do_quality(self, channel: str, select: str) -> int:
        amplitude = round(self.counter.shape.amplitude * self.counter.level)
        values = {0x10: amplitude, 0x20: 0, 0x40: amplitude, 0x80: 0, 0x200: 0, 0x400: 0}
        return values.get(int(select), round(100.0 * self.counter.level))

    def _do_newquality(self) -> int:
        fresh = self._rig.now > self._quality_asked
        self._quality_asked = self._rig.now
        return int(fresh)

    def _do_wasbreak(self, channel: str) -> int:
        return int(bool(self.counter.status & 3))

    def _do_waslost(self) -> int:
        return int(self._lost > 0)

    def _do_wasunstable(self, channel: str) -> int:
        return int(bool(self.counter.status & 0x20))

    def _do_newair(self) -> int:
        now = float(np.floor(self._rig.now))
        fresh = now > self._air_asked and not self.counter.faults.stale_air
        self._air_asked = now
        return int(fresh)

    def _do_sensors(self) -> int:
        return 3

    def _do_airflags(self, channel: str, kind: str) -> int:
        if kind in self.counter.settings.manual:
            return 0x0400
        number = "TPH".index(kind)
        return number | 0x0100 | (0 if self.counter.faults.stale_air else 0x0200)

    def _do_manual(self, channel: str) -> int:
        bits = {"T": 2, "H": 4, "P": 8}
        return sum(bits[k] for k in self.counter.settings.manual)

    def _do_edlen(self, channel: str) -> int:
        return int(self.counter.settings.edlen)

    def _do_setedlen(self, channel: str, on: str) -> int:
        self.counter.settings.edlen = on != "0"
        return 0

    def _do_setair(self, kind: str, channel: str, value: str) -> int:
        self.counter.settings.manual[kind] = float(value)
        return 0

    def _do_resetair(self, channel: str, mask: str) -> int:
        for kind, bit in {"T": 2, "H": 4, "P": 8}.items():
            if int(mask) & bit:
                self.counter.settings.manual.pop(kind, None)
        return 0

    def _do_air(self, kind: str, channel: str) -> Answer:
        now = np.array([self._rig.now])
        T, P, H = (float(v[0]) for v in self.counter.sensors(now))
        n = float(self.counter.index(now)[0])
        vapour = H / 100.0 * 611.2 * np.exp(17.62 * T / (243.12 + T))
        value = {
            "T": T, "P": P, "H": H, "F": vapour, "N": n, "L": 1e9 * VACUUM / n,
            "V": 1e9 * VACUUM, "C": 632.83e-9 * n / VACUUM, "D": n - 1.0,
        }[kind]  # fmt: skip
        return 0, struct.pack("<d", value)
