"""The devices before a bench, made from its configuration, and what can go wrong with them."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

from hardware.simulators.bench_server.config import BenchConfig
from hardware.simulators.bench_server.plants import Stand
from hardware.simulators.control import Fault
from hardware.simulators.rig import Rig


class Front(Protocol):
    """A simulated device behind an address."""

    def start(self) -> str:
        """Answer from now on; returns the address."""
        ...

    def stop(self) -> None:
        """End all connections."""
        ...


@dataclass(frozen=True, slots=True)
class BenchDevice:
    """A front, its faults by name, and what moves its output when its program is gone.

    Parameters
    ----------
    front : Front
        The front.
    faults : mapping
        What injects each fault.
    drive : callable, optional
        Sets its voltage at the terminals (V) as the device itself would.
    """

    front: Front
    faults: Mapping[str, Fault] = field(default_factory=dict)
    drive: Callable[[float], None] | None = None


def _by_itself(volts: float) -> None:
    """Do nothing: the device has its own watchdog and only needs the time to pass."""


def make_device(name: str, rig: Rig, config: BenchConfig, stand: Stand) -> BenchDevice:
    """Make one of the devices of a configuration, before what stands there."""
    return _MAKERS[name](rig, config, stand)


def stub_library() -> str | None:
    """Return the stub of the vendor's library, compiled into the user's cache; None without gcc."""
    from hardware.simulators.siosifm import build

    try:
        return str(build())
    except (OSError, subprocess.SubprocessError):
        return None


def _interferometer(rig: Rig, config: BenchConfig, stand: Stand) -> BenchDevice:
    from hardware.simulators.siosifm import AirAround, InterferometerFront

    a = config.air
    air = AirAround(
        temperature=a.temperature,
        pressure=a.pressure,
        humidity=a.humidity,
        warming=a.kelvin_per_hour / 3600.0,
        rising=a.pascal_per_hour / 3600.0,
    )
    front = InterferometerFront(
        rig,
        config.interferometer,
        air=air,
        quadrature=config.quadrature,
        dead_path=a.dead_path,
        noise=stand.noise_x,
        clocked_blocks=config.clocked == "block",
        seed=config.plant.noise_seed,
    )
    return BenchDevice(front, {"interferometer": _setting("interferometer", front.faults)})


def _card(rig: Rig, config: BenchConfig, stand: Stand) -> BenchDevice:
    from hardware.simulators.registers import AmplifierData, CardFront, Wires

    direct = config.driver != "amplifier"
    gain, offset = (1.0, 0.0) if direct else (config.gain, config.offset)
    data = AmplifierData(gain=gain, offset=offset, slew=config.slew)
    wires = Wires(readout=config.readout)
    front = CardFront(rig, config.card, config.card_model, amplifier=data, wires=wires)

    def drive(volts: float) -> None:
        code = round((volts - offset) / gain / (20.0 / 16384.0))
        front.registers.write16(2, 0x20, 0x2000 + min(max(code, -0x2000), 0x1FFF))
        if volts == 0.0 and abs(rig.volts) > gain * (20.0 / 16384.0):
            rig.drive(0.0)  # whatever else holds the terminals: the watchdog grounds them

    return BenchDevice(front, {"card": _setting("card", front.faults)}, drive)


def _gcs(rig: Rig, config: BenchConfig, stand: Stand) -> BenchDevice:
    from hardware.simulators.controllers import CommandWatchdog, GcsFront, GcsModel

    dog = CommandWatchdog(config.watchdog) if config.watchdog else None
    front = GcsFront(
        rig,
        config.controller,
        GcsModel(noise=stand.noise_x, watchdog=dog, seed=config.plant.noise_seed),
    )
    return BenchDevice(front, {"controller": _answers(front.faults)}, _by_itself)


def _ascii(rig: Rig, config: BenchConfig, stand: Stand) -> BenchDevice:
    from hardware.simulators.controllers import ASCII_DEVICES, AsciiFront, CommandWatchdog

    name = config.ascii_model or next(iter(ASCII_DEVICES))
    if name not in ASCII_DEVICES:
        raise ValueError(f"bench: no ASCII controller {name!r}; known: {', '.join(ASCII_DEVICES)}")
    dog = CommandWatchdog(config.watchdog) if config.watchdog else None
    made: Callable[..., Any] = ASCII_DEVICES[name]
    front = AsciiFront(rig, made(rig, watchdog=dog))
    return BenchDevice(front, {"controller": _answers(front.faults)}, _by_itself)


def _gauge(rig: Rig, config: BenchConfig, stand: Stand) -> BenchDevice:
    from hardware.simulators.gauge import GaugeFront

    pressed = None if stand.press is None else stand.press.force
    front = GaugeFront(rig, config.gauge, pressed)
    return BenchDevice(front, {"gauge": _answers(front.faults)})


_MAKERS: Mapping[str, Callable[[Rig, BenchConfig, Stand], BenchDevice]] = {
    "interferometer": _interferometer,
    "card": _card,
    "gcs": _gcs,
    "ascii": _ascii,
    "gauge": _gauge,
}


def _setting(name: str, faults: Any) -> Fault:
    """Return what sets the entries of a table of faults."""
    known = {f.name: str(f.type) for f in fields(faults)}

    def inject(values: Mapping[str, float | str]) -> None:
        for key, value in values.items():
            if key not in known:
                raise ValueError(f"{name} has no fault {key!r}; known: {', '.join(known)}")
            setattr(faults, key, _as(known[key], f"{name} {key}", value))

    return inject


def _answers(queue: Any) -> Fault:
    """Return what lets the next answers of a controller suffer; ``count`` says how many."""
    from hardware.simulators.controllers import Fault as Answer

    known = {f.name: str(f.type) for f in fields(Answer)}

    def inject(values: Mapping[str, float | str]) -> None:
        given = dict(values)
        count = int(_as("int", "controller count", given.pop("count", 1.0)))
        entries = {}
        for key, value in given.items():
            if key not in known:
                raise ValueError(f"a controller has no fault {key!r}; known: {', '.join(known)}")
            entries[key] = _as(known[key], f"controller {key}", value)
        queue.next(*[Answer(**entries)] * count)

    return inject


def _as(kind: str, where: str, value: float | str) -> Any:
    """Turn a word of the protocol into the type of an entry."""
    if "bytes" in kind:
        return str(value).encode("ascii", "replace")
    if value == "none" and "None" in kind:
        return None
    if not isinstance(value, float):
        raise ValueError(f"{where} takes a number, not {value!r}")
    if "bool" in kind:
        return bool(value)
    return int(value) if "int" in kind else value
