"""What a station file says: plain values, checked once.

The file is TOML::

    name = "stack in the laboratory"

    [envelope]
    preset = "P-840.1-unipolar"      # or v_min, v_max, slew, i_max, capacitance, ...

    [output]
    kind = "mf634"                   # mf624, mf634, ni, gcs, pipython
    trigger = 0                      # digital output that starts the interferometer
    clock = 1                        # digital output that clocks it

    [amplifier]
    gain = 20.0
    voltage_monitor = 0.05           # V at the monitor per V at the actuator, on input 0

    [ultrasonic]                     # instead of an amplifier: the board C-184.161
    lower_end = 0                    # digital inputs of the switches at the ends of travel
    upper_end = 1

    [interferometer]
    connection = "usb:0"
    dead_path = 0.1
    clocked = "fast"                 # "block" if edges can clock blocks too

    [readout]                        # an analogue input as a sensor, for loops
    channel = "phase"
    scale = 5.0                      # V per unit

    [gauge]                          # a force gauge, channel F
    connection = "/dev/ttyUSB0"      # or HOST:PORT

    [noise]
    x = 1e-9                         # standard deviation of a channel, SI, where it is known
"""

from __future__ import annotations

import dataclasses
import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from bondgraph.support.bounds import Count, Positive, one_of
from bondgraph.support.errors import UnusableInput, real_number
from bondgraph.support.typed_reader import Rules, bad, make, off_default, record
from hardware.devices.amplifier import UltrasonicLimits
from hardware.envelope import PRESETS, Envelope
from hardware.optics import Ellipse

CLOCKED = ("fast", "block")
OUTPUTS = ("mf634", "mf624", "ni", "gcs", "pipython")


@dataclass(frozen=True, slots=True)
class ClockSettings:
    """Time of the program: of the computer, or of a virtual bench at an address.

    Parameters
    ----------
    bench : str
        ``host:port`` of a virtual bench; empty for the computer's time.
    ppm : float
        Error of the program's clock against the bench's true time (millionths).
    """

    bench: str = ""
    ppm: float = 0.0


@dataclass(frozen=True, slots=True)
class OutputSettings:
    """The device that gives the voltage.

    Parameters
    ----------
    kind : str
        One of mf634, mf624, ni, gcs, pipython.
    address : str
        ``host:port``, a serial device, an NI device; empty for the first card found.
    channel : int
        Analogue output.
    trigger, clock : int or None
        Digital outputs that start and clock the interferometer.
    """

    kind: Annotated[str, one_of(*OUTPUTS)]
    address: str = ""
    channel: Count = 0
    trigger: Count | None = None
    clock: Count | None = None


@dataclass(frozen=True, slots=True)
class AmplifierSettings:
    """An analogue amplifier behind the output.

    Parameters
    ----------
    name : str
    gain, offset : float
        V/V, V.
    voltage_monitor, current_monitor : float or None
        V per V, V per A, on the inputs below.
    voltage_input, current_input : int
        Analogue inputs.
    lag, lag_error : float
        First-order lag and its standard deviation (s), where they are known.
    """

    name: str = "amplifier"
    gain: float = 1.0
    offset: float = 0.0
    voltage_monitor: float | None = None
    voltage_input: Count = 0
    current_monitor: float | None = None
    current_input: Count = 1
    lag: float | None = None
    lag_error: float = 0.0


@dataclass(frozen=True, slots=True)
class ReadoutSettings:
    """An analogue input of the card as a sensor: a strain gauge, a phase detector, ...

    Parameters
    ----------
    channel, unit : str
        Name and unit of the reading.
    input : int
        Analogue input.
    scale, offset : float
        V per unit, V.
    rate : float
        Readings a second that it may be asked for (Hz).
    """

    channel: str
    scale: float
    unit: str = "1"
    input: Count = 2
    offset: float = 0.0
    rate: Positive = 10e3


@dataclass(frozen=True, slots=True)
class GaugeSettings:
    """A force gauge.

    Parameters
    ----------
    connection : str
        A serial device, or ``HOST:PORT`` of a converter.
    baud : int
    rate : float
        Readings a second at most (Hz); the thesis took 100.
    """

    connection: str
    baud: Count = 19_200
    rate: Positive = 100.0


@dataclass(frozen=True, slots=True)
class InterferometerSettings:
    """The interferometer.

    Parameters
    ----------
    connection : str
        ``"usb:0"``, ``"net:HOST:PORT"``, ``"com:NAME"`` or ``"demo"``.
    library : str
        Path of the vendor's library; empty for BONDSIGHT_SIOS_LIB or the system's.
    channel : int
    dead_path : float
        m.
    rate : float or None
        Hz on its own clock; chosen from the waveform if not given.
    quadrature : bool
        Record sine and cosine too, and correct the periodic error from them.
    ellipse : Ellipse or None
        Of a calibration (``bondsight calibrate``), for records of less than a fringe.
    clocked : {"fast", "block"}
        Where edges on its clock input can take samples: in the fast mode only, as the device of
        the thesis (its sections 4.2.2 and 6.6), or in a block too.
    """

    connection: str = "usb:0"
    library: str = ""
    channel: Count = 0
    dead_path: float = 0.0
    rate: float | None = None
    quadrature: bool = False
    ellipse: Ellipse | None = None
    clocked: Annotated[str, one_of(*CLOCKED)] = "fast"


@dataclass(frozen=True, slots=True)
class StationSettings:
    """A whole bench.

    Parameters
    ----------
    name : str
    envelope : Envelope
        Limits between every command and the actuator.
    output, amplifier, ultrasonic, interferometer, readout, gauge, clock
        Its parts; what is None is not there. With `ultrasonic` the board C-184.161 stands in the
        amplifier's place, and all voltages are its control voltage.
    noise : mapping
        Standard deviation of the noise of channels, SI, where it is known: recordings carry it.

    Examples
    --------
    >>> _ = (folder / "bench.toml").write_text(STATION)
    >>> read_settings(folder / "bench.toml").output.kind
    'mf634'
    """

    name: str
    envelope: Envelope
    output: OutputSettings
    amplifier: AmplifierSettings = field(default_factory=AmplifierSettings)
    ultrasonic: UltrasonicLimits | None = None
    interferometer: InterferometerSettings | None = None
    readout: ReadoutSettings | None = None
    gauge: GaugeSettings | None = None
    clock: ClockSettings = field(default_factory=ClockSettings)
    noise: Mapping[str, Positive] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse parts that exclude each other."""
        card = self.output.kind.startswith("mf")
        if self.ultrasonic is not None and (self.amplifier != AmplifierSettings() or not card):
            raise UnusableInput(
                "[ultrasonic] takes the place of [amplifier], behind a card (mf624, mf634); "
                "leave one of them out"
            )
        if self.readout is not None and not card:
            raise UnusableInput(
                f"[readout] reads an input of a card (mf624, mf634), not of {self.output.kind}"
            )


def read_settings(path: str | Path) -> StationSettings:
    """Read a station file.

    Raises
    ------
    UnusableInput
        One line: no such file, no TOML, a key missing, unknown or of another type.
    UnknownName
        Via `UnusableInput`, with the nearest names.

    Examples
    --------
    >>> _ = (folder / "station.toml").write_text(STATION)
    >>> settings = read_settings(folder / "station.toml")
    >>> settings.name, settings.envelope.v_max
    ('laboratory', 80.0)
    """
    return settings_from(toml_of(Path(path), "a station file"), Path(path).name)


def toml_of(file: Path, what: str) -> dict[str, Any]:
    """Return the plain values of a TOML file, or raise `UnusableInput` in one line."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UnusableInput(f"{file}: cannot be read, {error.strerror}; give {what}") from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise UnusableInput(f"{file.name}: is no TOML, {error}") from None


def toml_text(table: Mapping[str, Any]) -> str:
    """Return plain values as TOML, tables inside them last.

    Examples
    --------
    >>> toml_text({"clock": {"ppm": 3.0}, "name": "bench"}).splitlines()
    ['name = "bench"', '', '[clock]', 'ppm = 3.0']
    """
    return "\n".join([*_lines("", table), ""])


def _lines(name: str, table: Mapping[str, Any]) -> list[str]:
    # a JSON text of numbers, texts and lists is a TOML text too
    lines = [f"{k} = {json.dumps(v)}" for k, v in table.items() if not isinstance(v, Mapping)]
    for key, inner in table.items():
        if isinstance(inner, Mapping):
            full = f"{name}.{key}" if name else key
            lines += ["", f"[{full}]", *_lines(full, inner)]
    return lines


def settings_from(content: Mapping[str, Any], where: str = "station") -> StationSettings:
    """Check plain values and freeze them; see `read_settings`."""
    given = {"name": "bench", **content}
    return make(lambda: record(StationSettings, given, "", _RULES, "a station"), where)


@dataclass(frozen=True, slots=True)
class _Limits:
    """What a file may say of an envelope: all of it, or what differs from a preset."""

    preset: Annotated[str, one_of(*PRESETS)] | None = None
    name: str | None = None
    v_min: float | None = None
    v_max: float | None = None
    slew: float | None = None
    i_max: float | None = None
    capacitance: float | None = None
    f_max: float | None = None
    safe: float | None = None
    gentle: float | None = None
    update_period: float | None = None


def _envelope(_: Any, value: Any, place: str) -> Envelope:
    given = dict(off_default(record(_Limits, value, place, _RULES, "an envelope")))
    preset = given.pop("preset", None)
    if preset is not None:
        return dataclasses.replace(PRESETS[preset], **given)
    for k in ("v_min", "v_max", "slew"):
        if k not in given:
            raise UnusableInput(
                f"{place}.{k} is missing; give it, or a preset ({', '.join(PRESETS)})"
            )
    return Envelope(**given)


def _number(_: Any, value: Any, place: str) -> float:
    """Return a finite number; one in quotes is taken as the number it is."""
    if isinstance(value, bool):
        raise bad(place, value, "a number")
    return real_number(place, value)


_RULES = Rules({Envelope: _envelope, float: _number})
