"""How each known recording is read: converted copies first, originals where that is easy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnknownName, UnusableInput

__all__ = ["emps", "hair_dryer", "piezo", "silverbox_arrow", "silverbox_multisine"]

EMPS_FORCE_PER_VOLT = 35.15065188248547
"""Motor force per drive voltage of the EMPS benchmark, N/V."""

SILVERBOX_MULTISINE = slice(40_650, 127_400)
"""Samples of the odd random-phase multisines of the Silverbox record."""

SILVERBOX_ARROW_STOP = 40_400
"""End of the growing noise at the start of the Silverbox record, samples."""

HAIR_DRYER_RATE = 12.5
"""Sampling rate of the hair dryer, Hz."""

SILVERBOX_RATE = 1e7 / 2**14
"""Sampling rate of the Silverbox, Hz."""


def piezo(path: Path) -> Recording:
    """Piezo actuator: V (V), x (m), whole record."""
    return Recording.read(path, {"V": "voltage_V", "x": "displacement_um"})


def emps(path: Path) -> Recording:
    """EMPS: F (N) from the drive voltage, x (m)."""
    if path.suffix == ".mat":
        read = Recording.read(path, {"t": "t", "F": "vir[V]", "x": "qm[m]"})
    else:
        read = Recording.read(path, {"F": "drive_voltage_V", "x": "position_m"})
    force = EMPS_FORCE_PER_VOLT * read["F"]
    return _changed(
        read,
        {"F": force, "x": read["x"]},
        {"F": "N", "x": "m"},
        f"F is the drive voltage times {EMPS_FORCE_PER_VOLT} N/V",
    )


def _silverbox(path: Path) -> Recording:
    if path.suffix == ".mat":
        read = Recording.read(path, {"u": "V1[V]", "y": "V2[V]"}, fs=SILVERBOX_RATE)
    else:
        read = Recording.read(path, {"u": "snls80mV_u_V", "y": "snls80mV_y_V"})
    if read.n < SILVERBOX_MULTISINE.stop:
        raise UnusableInput(f"{path.name}: {read.n} samples; the whole record has 131072")
    centred = {k: v - v.mean() for k, v in read.channels.items()}
    return _changed(read, centred, read.units, "the mean of the whole record is removed")


def silverbox_multisine(path: Path) -> Recording:
    """Silverbox, multisine part: u (V), y (V), means of the whole record removed."""
    part = SILVERBOX_MULTISINE
    return _silverbox(path).slice(part.start, part.stop)


def silverbox_arrow(path: Path) -> Recording:
    """Silverbox, arrow part: u (V), y (V), means of the whole record removed."""
    return _silverbox(path).slice(0, SILVERBOX_ARROW_STOP)


def hair_dryer(path: Path) -> Recording:
    """Hair dryer: u (V), y (V) as recorded."""
    if path.suffix != ".mat":
        return Recording.read(path, {"u": "heater_voltage_V", "y": "air_temperature_V"})
    wanted: UnknownName | None = None
    for u, y in (("u2", "y2"), ("u", "y"), ("X", "y")):
        try:
            return Recording.read(path, {"u": f"{u}[V]", "y": f"{y}[V]"}, fs=HAIR_DRYER_RATE)
        except UnknownName as error:
            wanted = wanted or error
    raise UnknownName(str(wanted))


def _changed(
    recording: Recording, channels: Mapping[str, Any], units: Mapping[str, str], note: str
) -> Recording:
    """Return the recording with other values and a note that says so."""
    meta = {**recording.meta, "notes": (*recording.notes, note)}
    return replace(recording, channels=channels, units=units, meta=meta)
