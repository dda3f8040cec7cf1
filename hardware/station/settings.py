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

    [interferometer]
    connection = "usb:0"
    dead_path = 0.1
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput
from hardware.envelope import PRESETS, Envelope
from hardware.station.section import Section

__all__ = [
    "AmplifierSettings",
    "ClockSettings",
    "InterferometerSettings",
    "OutputSettings",
    "StationSettings",
    "read_settings",
    "settings_from",
]

OUTPUTS = ("mf634", "mf624", "ni", "gcs", "pipython")
_NUMBERS = ("v_min", "v_max", "slew", "i_max", "capacitance", "f_max", "safe", "gentle",
            "update_period")  # fmt: skip


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

    kind: str
    address: str = ""
    channel: int = 0
    trigger: int | None = None
    clock: int | None = None


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
    voltage_input: int = 0
    current_monitor: float | None = None
    current_input: int = 1
    lag: float | None = None
    lag_error: float = 0.0


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
    """

    connection: str = "usb:0"
    library: str = ""
    channel: int = 0
    dead_path: float = 0.0
    rate: float | None = None
    quadrature: bool = False


@dataclass(frozen=True, slots=True)
class StationSettings:
    """A whole bench.

    Parameters
    ----------
    name : str
    envelope : Envelope
        Limits between every command and the actuator.
    output, amplifier, interferometer, clock
        Its parts; no interferometer if None.
    """

    name: str
    envelope: Envelope
    output: OutputSettings
    amplifier: AmplifierSettings = field(default_factory=AmplifierSettings)
    interferometer: InterferometerSettings | None = None
    clock: ClockSettings = field(default_factory=ClockSettings)


def read_settings(path: str | Path) -> StationSettings:
    """Read a station file.

    Raises
    ------
    UnusableInput
        One line: no such file, no TOML, a key missing, unknown or of another type.
    UnknownName
        Via `UnusableInput`, with the nearest names.
    """
    file = Path(path)
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UnusableInput(
            f"{file}: cannot be read, {error.strerror}; give a station file"
        ) from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise UnusableInput(f"{file.name}: is no TOML, {error}") from None
    return settings_from(content, file.name)


def settings_from(content: Mapping[str, Any], where: str = "station") -> StationSettings:
    """Check plain values and freeze them; see `read_settings`."""
    top = Section(content, where)
    name = top.text("name", "bench")
    envelope = _envelope(top.table("envelope"))
    output = _output(top.table("output"))
    amplifier = _amplifier(top.table("amplifier"))
    sensor = _interferometer(top.table("interferometer")) if "interferometer" in top else None
    clock = _clock(top.table("clock"))
    top.table("interferometer")
    top.finished()
    return StationSettings(name, envelope, output, amplifier, sensor, clock)


def _envelope(s: Section) -> Envelope:
    preset = s.text("preset", "", choices=("", *PRESETS))
    given = {k: s.number(k) for k in _NUMBERS if k in s}
    for k in _NUMBERS:
        s.optional(k)
    label = s.text("name", "")
    s.finished()
    names = {"name": label} if label else {}
    if preset:
        return dataclasses.replace(PRESETS[preset], **given, **names)  # type: ignore[arg-type]
    for k in ("v_min", "v_max", "slew"):
        if k not in given:
            raise UnusableInput(
                f"{s.where}: {k} is missing; give it, or a preset ({', '.join(PRESETS)})"
            )
    return Envelope(**given, **names)  # type: ignore[arg-type]


def _output(s: Section) -> OutputSettings:
    made = OutputSettings(
        s.text("kind", choices=OUTPUTS), s.text("address", ""), s.whole("channel", 0),
        s.whole("trigger") if "trigger" in s else None,
        s.whole("clock") if "clock" in s else None,
    )  # fmt: skip
    for k in ("trigger", "clock"):
        s.optional(k)
    s.finished()
    return made


def _amplifier(s: Section) -> AmplifierSettings:
    made = AmplifierSettings(
        s.text("name", "amplifier"), s.number("gain", 1.0), s.number("offset", 0.0),
        s.optional("voltage_monitor"), s.whole("voltage_input", 0),
        s.optional("current_monitor"), s.whole("current_input", 1),
        s.optional("lag"), s.number("lag_error", 0.0),
    )  # fmt: skip
    s.finished()
    return made


def _interferometer(s: Section) -> InterferometerSettings:
    made = InterferometerSettings(
        s.text("connection", "usb:0"), s.text("library", ""), s.whole("channel", 0),
        s.number("dead_path", 0.0), s.optional("rate"), s.flag("quadrature", False),
    )  # fmt: skip
    s.finished()
    return made


def _clock(s: Section) -> ClockSettings:
    made = ClockSettings(s.text("bench", ""), s.number("ppm", 0.0))
    s.finished()
    return made
