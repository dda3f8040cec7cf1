"""One bench with all its devices, in the threads of this process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self, final

from hardware.simulators.bench_server.config import BenchConfig
from hardware.simulators.bench_server.fronts import BenchDevice, make_device, stub_library
from hardware.simulators.bench_server.pacing import Pacer
from hardware.simulators.bench_server.plants import PlantMaker, Stand, stand_of
from hardware.simulators.control import ConnectionWatchdog, ControlFront, Departure, Fault
from hardware.simulators.rig import Extremes, Rig
from hardware.simulators.seal import SealedEnvelope


@final
class BenchServer:
    """Puts plant, rig, devices and the control front together.

    Parameters
    ----------
    config : BenchConfig
        What it is made of.
    stand : Stand, optional
        What stands on it, made outside.
    plants : mapping, optional
        Makers of plants that the configuration may name beside ``"stack"``.
    """

    def __init__(
        self,
        config: BenchConfig | None = None,
        *,
        stand: Stand | None = None,
        plants: Mapping[str, PlantMaker] | None = None,
    ) -> None:
        self.config = config = config or BenchConfig()
        made = stand or stand_of(config, plants)
        self.rig = Rig(made.plant, keep=config.plant.keep)
        self.envelope = SealedEnvelope.closed(made.truth)
        self.devices: dict[str, BenchDevice] = {
            name: make_device(name, self.rig, config, made) for name in config.fronts
        }
        faults: dict[str, Fault] = {}
        for device in self.devices.values():
            faults |= device.faults
        self.control = ControlFront(
            self.rig,
            faults,
            watchdog=_watchdog(config),
            drive=next((d.drive for d in self.devices.values() if d.drive), None),
            sealed=self.envelope.hash if config.plant.sealed else "",
            rate=config.speed,
            port=config.port,
        )
        self._pacer = Pacer(self.rig, config.speed) if config.speed else None
        self.addresses: dict[str, str] = {}

    @property
    def extremes(self) -> Extremes:
        """Worst voltages that the actuator has met."""
        return self.rig.extremes

    @property
    def departures(self) -> tuple[Departure, ...]:
        """When the last program went away, and what the output did then."""
        return self.control.departures

    @property
    def environment(self) -> dict[str, str]:
        """What a program that drives this bench needs in its environment."""
        found = {"BONDSIGHT_BENCH": self.addresses["control"]}
        if "interferometer" in self.addresses:
            found["BONDSIGHT_BENCH_SIOS"] = self.addresses["interferometer"]
            if library := stub_library():
                found["BONDSIGHT_SIOS_LIB"] = library
        return found

    def start(self) -> dict[str, str]:
        """Let all devices answer; returns their addresses by name.

        Raises
        ------
        ValueError
            If a fault of the configuration is unknown; nothing is left open.
        """
        try:
            self.addresses = {"control": self.control.start()}
            for name, device in self.devices.items():
                self.addresses[name] = device.front.start()
            for line in self.config.faults:
                answer = self.control.answer(f"FAULT {line}")
                if not answer.startswith("OK"):
                    raise ValueError(f"bench: fault {line!r}: {answer[4:]}")
            if self._pacer is not None:
                self._pacer.start()
        except BaseException:
            self.stop()
            raise
        return dict(self.addresses)

    def stop(self) -> None:
        """End everything; any number of times."""
        if self._pacer is not None:
            self._pacer.stop()
        self.control.stop()
        for device in self.devices.values():
            device.front.stop()

    def __enter__(self) -> Self:
        """Start."""
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Stop."""
        self.stop()

    def report(self) -> list[str]:
        """Return what is worth saying at the end, one line each."""
        e = self.extremes
        lines = [
            f"{self.rig.now:.3f} s of the bench; voltage at the actuator {e.lowest:.3f} to "
            f"{e.highest:.3f} V, largest step {e.largest_step:.3f} V"
        ]
        lines += [str(d) for d in self.departures if d.volts != 0.0]
        if self.rig.volts != 0.0:
            lines.append(f"the output is left at {self.rig.volts:g} V")
        return lines


def _watchdog(config: BenchConfig) -> ConnectionWatchdog | None:
    """Return that of the output; a controller's own one gets the time that it needs."""
    if not config.watchdog:
        return None
    own = any(n in config.fronts for n in ("gcs", "ascii"))
    return ConnectionWatchdog(config.watchdog, fall=1.0 if own else 0.05)
