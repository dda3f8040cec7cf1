"""What stands on a bench and how its devices run, as plain values; read from JSON or TOML."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from hardware.simulators.gauge import GaugeConfig
from hardware.simulators.rig import DeviceClock
from hardware.simulators.siosifm.optics import Quadrature

FRONTS = ("interferometer", "card", "gcs", "ascii", "gauge")
DRIVERS = ("amplifier", "ultrasonic", "oscillator")


@dataclass(frozen=True, slots=True)
class PlantConfig:
    """What stands on the bench.

    Parameters
    ----------
    name : str
        ``"stack"``, or a plant that the one who starts the server offers.
    seed : int, optional
        Of the drawn parameters; by default one from the operating system.
    effect, place, strength : str
        Concealed effect; ``"none"`` for nothing, ``"drawn"`` to leave effect and place to the
        seed. Place and strength may be empty.
    sealed : bool
        Show only a hash of the truth; the seed may not be given then.
    drift_span : float
        Time (s) in which a sensor that drifts makes the drift of the truth.
    play_radii, play_gains : tuple of float
        Further hysteresis before the plant: half widths (V) and gains.
    creep_ratios, creep_times : tuple of float
        Further creep behind it: parts of the displacement and time constants (s).
    noise_x, noise_i : float
        White noise of the readings (m, A); NaN takes that of the truth, none if it has none.
    noise_seed : int
        Of noise, vibration and turbulence.
    vibration : tuple of (float, float)
        Frequency (Hz) and amplitude (m) of lines of the floor.
    press : (float, float), or ()
        Somebody presses on the stack, with so many N at most, once in so many s.
    keep : float
        Past that devices can ask for (s).
    """

    name: str = "stack"
    seed: int | None = None
    effect: str = "none"
    place: str = ""
    strength: str = ""
    sealed: bool = False
    drift_span: float = 10.0
    play_radii: tuple[float, ...] = ()
    play_gains: tuple[float, ...] = ()
    creep_ratios: tuple[float, ...] = ()
    creep_times: tuple[float, ...] = ()
    noise_x: float = math.nan
    noise_i: float = math.nan
    noise_seed: int = 0
    vibration: tuple[tuple[float, float], ...] = ()
    press: tuple[float, ...] = ()
    keep: float = 40.0


@dataclass(frozen=True, slots=True)
class AirConfig:
    """Air in the beam.

    Parameters
    ----------
    temperature, pressure, humidity : float
        At the start, as the sensors say: degC, Pa, % relative.
    dead_path : float
        Path that does not belong to the motion (m).
    kelvin_per_hour, pascal_per_hour : float
        Drift.
    swing, period : float
        A slow swing of the temperature (K) and its period (s).
    stir : float
        Rms of the turbulence (K), which the sensors do not see.
    """

    temperature: float = 20.0
    pressure: float = 101_325.0
    humidity: float = 50.0
    dead_path: float = 0.1
    kelvin_per_hour: float = 0.0
    pascal_per_hour: float = 0.0
    swing: float = 0.0
    period: float = 600.0
    stir: float = 0.0


@dataclass(frozen=True, slots=True)
class BenchConfig:
    """A whole bench.

    Parameters
    ----------
    plant : PlantConfig
        What stands on it.
    air : AirConfig
        Air in the beam of the interferometer.
    fronts : tuple of str
        Devices before it: ``interferometer``, ``card``, ``gcs``, ``ascii``, ``gauge``.
    quadrature : Quadrature
        Signals of the interferometer's detectors.
    interferometer, card, controller : DeviceClock
        Clocks of the devices. The program paces the card, so the ppm of `card` are for the
        program's clock (`BenchClock`).
    clocked : str
        ``"block"``: edges clock the interferometer's blocks too; ``"fast"``: its fast mode only.
    card_model : str
        ``"MF634"`` or ``"MF624"``.
    driver : str
        What stands behind the card: ``"amplifier"``, the board of the ``"ultrasonic"`` actuator or
        an ``"oscillator"``; the latter two take the voltage of the card as it is.
    gain, offset : float
        Of the amplifier behind the card (V/V, V).
    readout : float
        Voltage on input 2 of the card by the displacement (V/m); 0 if nothing is wired there.
    gauge : GaugeConfig
        The force gauge.
    slew : float
        Largest rate of the amplifier (V/s); infinite by default.
    ascii_model : str
        Which ASCII controller.
    watchdog : float
        Silence (s) after which the output goes to 0 V when the last program is gone; 0 for a
        device that has none.
    faults : tuple of str
        Faults from the start on, as after ``FAULT`` in the control protocol.
    speed : float
        0: virtual time, which passes when the program waits. Otherwise time passes by itself, so
        many times as fast as the wall clock.
    port : int
        Of the control front; 0 takes a free one.
    """

    plant: PlantConfig = field(default_factory=PlantConfig)
    air: AirConfig = field(default_factory=AirConfig)
    fronts: tuple[str, ...] = ("interferometer", "card")
    quadrature: Quadrature = field(default_factory=Quadrature)
    interferometer: DeviceClock = field(default_factory=DeviceClock)
    card: DeviceClock = field(default_factory=DeviceClock)
    controller: DeviceClock = field(default_factory=DeviceClock)
    clocked: str = "block"
    card_model: str = "MF634"
    driver: str = "amplifier"
    gain: float = 20.0
    offset: float = 0.0
    readout: float = 0.0
    gauge: GaugeConfig = field(default_factory=GaugeConfig)
    slew: float = math.inf
    ascii_model: str = ""
    watchdog: float = 0.0
    faults: tuple[str, ...] = ()
    speed: float = 0.0
    port: int = 0

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        for name in self.fronts:
            if name not in FRONTS:
                raise ValueError(f"bench: unknown front {name!r}; known: {', '.join(FRONTS)}")
        drivers = [n for n in self.fronts if n not in ("interferometer", "gauge")]
        if len(drivers) > 1:
            raise ValueError(
                f"bench: {' and '.join(drivers)} would both hold the terminals; choose one"
            )
        if self.driver not in DRIVERS:
            raise ValueError(f"bench: driver = {self.driver!r}; choose {', '.join(DRIVERS)}")
        if self.clocked not in ("fast", "block"):
            raise ValueError(f"bench: clocked = {self.clocked!r}; choose 'fast' or 'block'")
        for name in ("watchdog", "speed"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"bench: {name} = {value!r} must be finite and >= 0")
        press = self.plant.press
        if press and not (len(press) == 2 and press[1] > 0.0):
            raise ValueError(f"bench: press = {list(press)} must be [N, s], the time above 0")
        if press and self.plant.name != "stack":
            raise ValueError(f"bench: press = {list(press)} is for plant 'stack', whose k is known")
        if self.plant.sealed and self.plant.seed is not None:
            raise ValueError("bench: a sealed plant takes no seed: who knows it knows the truth")


def load_config(path: str | Path) -> BenchConfig:
    """Read a bench from a JSON or TOML file.

    Raises
    ------
    ValueError
        In one line: what, where, why.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
        data = tomllib.loads(text) if file.suffix == ".toml" else json.loads(text)
    except OSError as error:
        raise ValueError(f"bench: {file} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, json.JSONDecodeError) as error:
        raise ValueError(f"bench: {file} is no {file.suffix[1:] or 'JSON'}: {error}") from None
    try:
        return config_from(data)
    except ValueError as error:
        raise ValueError(f"{error} (in {file})") from None


def config_from(data: Mapping[str, Any]) -> BenchConfig:
    """Make a bench from plain values.

    Examples
    --------
    >>> config_from({"plant": {"effect": "creep"}, "watchdog": 0.2}).plant.effect
    'creep'
    """
    made = _filled(BenchConfig, data, "bench")
    assert isinstance(made, BenchConfig)
    return made


def _filled(kind: Any, data: Any, where: str) -> Any:
    if not isinstance(data, Mapping):
        raise ValueError(f"{where}: a table is needed, not {data!r:.60}")
    hints = get_type_hints(kind)
    known = [f.name for f in fields(kind)]
    for key in data:
        if key not in known:
            raise ValueError(f"{where}: unknown entry {key!r}; known: {', '.join(known)}")
    return kind(**{k: _value(hints[k], v, f"{where}.{k}") for k, v in data.items()})


def _value(kind: Any, value: Any, where: str) -> Any:
    if is_dataclass(kind):
        return _filled(kind, value, where)
    if get_origin(kind) is tuple:
        if not isinstance(value, list | tuple):
            raise ValueError(f"{where}: a list is needed, not {value!r:.60}")
        inner = get_args(kind)
        if inner[-1] is Ellipsis:
            return tuple(_value(inner[0], v, f"{where}[{k}]") for k, v in enumerate(value))
        if len(value) != len(inner):
            raise ValueError(f"{where}: {len(inner)} values are needed, not {len(value)}")
        return tuple(_value(t, v, where) for t, v in zip(inner, value, strict=True))
    if kind == int | None:
        kind = int
        if value is None:
            return None
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise ValueError(f"{where}: {kind.__name__} is needed, not {value!r:.60}")
    return value
