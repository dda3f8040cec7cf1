"""What an interferometer tells: readings, health, its own ellipse correction, who it is."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

from hardware.contracts import Flag, Identity
from hardware.devices.interferometer.constants import Info, Quality, ValueStatus
from hardware.devices.interferometer.library import VendorLibrary

_MODELS = {1: "demo", 2: "RE-10", 3: "RE-06"}
_SERIAL_SIZE = 12
_LOWEST = 0xFFFF  # an "address" not above it is an error code or nothing


@dataclass(frozen=True, slots=True)
class OpticalReading:
    """One displacement: value (m), `Flag` sum, program time (s)."""

    value: float
    flags: Flag
    time: float


@dataclass(frozen=True, slots=True)
class Health:
    """State of the beam and the buffers since the last zero.

    Parameters
    ----------
    beam_broken, laser_unstable, values_lost : bool
        Whether it has happened.
    quality : float
        Overall quality of the signals, 0 to 1.
    status : ValueStatus
        Present status word.
    """

    beam_broken: bool
    laser_unstable: bool
    values_lost: bool
    quality: float
    status: ValueStatus


@dataclass(frozen=True, slots=True)
class EllipseCorrection:
    """What the device itself fits to its quadrature signals (Heydemann's correction).

    Parameters
    ----------
    active, updating : bool
        Whether it corrects, and whether it still adapts.
    samples : int
        Samples since the last fit.
    cosine_offset, sine_offset, amplitude : float
        Counts.
    phase : float
        As the device tells it.
    ratio : float
        Ratio of the amplitudes.
    """

    active: bool
    updating: bool
    samples: int
    cosine_offset: float
    sine_offset: float
    amplitude: float
    phase: float
    ratio: float


def info(library: VendorLibrary, device: int, which: Info) -> int:
    """Return a device information as a number; 0 if the device has it not."""
    return max(int(library.call("IfmDeviceInfo", device, which)), 0)


def number_at(library: VendorLibrary, device: int, which: Info) -> float:
    """Return a device information that is given as the address of a number; NaN without."""
    address = info(library, device, which)
    return ctypes.c_double.from_address(address).value if address > _LOWEST else float("nan")


def _text_at(library: VendorLibrary, device: int, which: Info, size: int) -> str:
    address = info(library, device, which)
    if address <= _LOWEST:
        return ""
    return ctypes.string_at(address, size).split(b"\0")[0].decode("latin-1").strip()


def identity_of(library: VendorLibrary, device: int) -> Identity:
    """Return maker, model, serial number and firmware."""
    serial = _text_at(library, device, Info.DEVICE_SERIAL_AT, _SERIAL_SIZE)
    kind = int(library.call("IfmDeviceType", device))
    firmware = _text_at(library, device, Info.VERSION_TEXT_AT, -1)
    return Identity(
        "SIOS",
        _MODELS.get(kind, f"type {kind}"),
        serial or str(info(library, device, Info.SERIAL)),
        firmware or str(library.call("IfmFirmwareVersion", device)),
    )


def health_of(library: VendorLibrary, device: int, channel: int) -> Health:
    """Return the state of beam, laser and buffers since the last zero."""
    call = library.call
    return Health(
        bool(call("IfmWasBeamBreak", device, channel)),
        bool(call("IfmWasLaserUnstable", device, channel)),
        bool(call("IfmWasLostValues", device)),
        0.01 * int(call("IfmSignalQuality", device, channel, Quality.SUM)),
        ValueStatus(int(call("IfmStatus", device, channel))),
    )


def ellipse_of(library: VendorLibrary, device: int) -> EllipseCorrection:
    """Return the device's own correction of its quadrature signals."""
    return EllipseCorrection(
        bool(info(library, device, Info.ELLIPSE_ON)),
        bool(info(library, device, Info.ELLIPSE_UPDATING)),
        info(library, device, Info.ELLIPSE_COUNT),
        number_at(library, device, Info.ELLIPSE_COSINE_OFFSET_AT),
        number_at(library, device, Info.ELLIPSE_SINE_OFFSET_AT),
        number_at(library, device, Info.ELLIPSE_AMPLITUDE_AT),
        number_at(library, device, Info.ELLIPSE_PHASE_AT),
        number_at(library, device, Info.ELLIPSE_RATIO_AT),
    )
