"""How recordings of single machines are read and parted; the parts are our own unless said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bondgraph.signals.recording import Recording, default_split
from bondgraph.signals.split import whole
from bondgraph.support.errors import UnusableInput
from identification.datasets import loaders
from identification.datasets.public_set import Parts, changed, cut

__all__ = [
    "ball_and_beam",
    "flexible_arm",
    "hair_dryer",
    "mr_damper",
    "pendulum",
    "piezo_actuator",
    "piezo_beam",
    "pneumatic_cylinder",
    "pnzt_creep",
    "rack_and_pinion",
]

_GAP = 0.05
_CYLINDER_RATE = 100.0


def _halves(recording: Recording, first: int) -> Parts:
    return Parts({"first": cut(recording, 0, first)}, {"last": cut(recording, first, recording.n)})


def _last_third(recording: Recording) -> Parts:
    return _halves(recording, recording.n - recording.n // 3)


def piezo_actuator(paths: tuple[Path, ...]) -> Parts:
    """Piezo actuator: V (V), x (m); whole periods."""
    read = loaders.piezo(paths[0])
    split = default_split(read, 1.0 / 3.0, drive="V")
    train, test = (cut(read, s.start, s.stop) for s in (whole(split.train), whole(split.test)))
    return Parts({"periods": train}, {"last_periods": test})


def pendulum(paths: tuple[Path, ...]) -> Parts:
    """Pendulum, free swing: theta (rad) from hanging; omega (rad/s) in the large swing."""
    small = Recording.read(paths[0], {"theta": "angle_rad"})
    large = Recording.read(paths[1], {"theta": "angle_rad", "omega": "angular_velocity_rad_per_s"})
    parts = []
    for read in (small, large):
        channels = {**read.channels, "theta": read["theta"] - np.pi}
        parts.append(changed(read, channels, read.units, "theta is the angle less pi (hanging)"))
    return Parts({"small_swing": parts[0]}, {"large_swing": parts[1]})


def mr_damper(paths: tuple[Path, ...]) -> Parts:
    """Magnetorheological damper: v (m/s), F (N)."""
    path = paths[0]
    if path.suffix == ".mat":
        read = Recording.read(path, {"v": "X[cm/s]", "F": "y[N]"}, fs=200.0)
    else:
        read = Recording.read(path, {"v": "velocity_cm_per_s", "F": "force_N"})
    return _halves(read, 2000)


def hair_dryer(paths: tuple[Path, ...]) -> Parts:
    """Hair dryer: u (V), y (V)."""
    return _halves(loaders.hair_dryer(paths[0]), 500)


def ball_and_beam(paths: tuple[Path, ...]) -> Parts:
    """Ball and beam: angle (rad), x (m)."""
    path = paths[0]
    if path.suffix == ".mat":
        read = Recording.read(path, {"angle": "X[rad]", "x": "y[m]"}, fs=10.0)
    else:
        read = Recording.read(path, {"angle": "beam_angle_rad", "x": "ball_position_m"})
    return _halves(read, 500)


def flexible_arm(paths: tuple[Path, ...]) -> Parts:
    """Flexible robot arm: u, y without units over the number of the sample."""
    read = Recording.read(paths[0], {"u": "reaction_torque[1]", "y": "arm_acceleration[1]"}, fs=1.0)
    return _last_third(read)


def rack_and_pinion(paths: tuple[Path, ...]) -> Parts:
    """Rack and pinion drive: v (m/s), F (N)."""
    return _last_third(Recording.read(paths[0], {"v": "velocity_m_per_s", "F": "force_N"}))


def piezo_beam(paths: tuple[Path, ...]) -> Parts:
    """Beam with piezo patches: i (A) of the exciter, v (velocity, unit not stated)."""
    read = Recording.read(paths[0], {"i": "coil_current_A", "v": "velocity[1]"}, fs=1000.0)
    return _last_third(read)


def pnzt_creep(paths: tuple[Path, ...]) -> Parts:
    """PNZT ceramic: V (V), i (A), P (C/m^2), x (m); steps with rests, and loops."""
    plan = {
        "V": "voltage_V", "i": "current_A", "P": "polarization_uC_per_cm2", "x": "displacement_nm",
    }  # fmt: skip
    read = {p.stem: Recording.read(p, plan) for p in paths}
    fitted = ("record1_60s", "record3_105s")
    return Parts({k: read[k] for k in fitted}, {k: v for k, v in read.items() if k not in fitted})


def pneumatic_cylinder(paths: tuple[Path, ...]) -> Parts:
    """Pneumatic cylinder: x (m), p (Pa), F (N) at 100 Hz."""
    read = {p.stem: _cylinder(p) for p in paths}
    judged = ("O_ring_5bar", "X_ring257_3bar")
    return Parts({k: v for k, v in read.items() if k not in judged}, {k: read[k] for k in judged})


def _cylinder(path: Path) -> Recording:
    """Longest stretch without a pause of the logger, on an even grid."""
    plan = {"clock": "t_s[s]", "x": "position_mm", "p": "pressure_bar", "F": "force_N"}
    read = Recording.read(path, plan, fs=_CYLINDER_RATE)
    clock = read["clock"]
    if np.any(np.diff(clock) <= 0.0):
        raise UnusableInput(f"{path.name}: the time stamps do not increase; get the file again")
    ends = np.concatenate(([0], np.flatnonzero(np.diff(clock) > _GAP) + 1, [clock.size]))
    longest = int(np.argmax(np.diff(ends)))
    kept = slice(int(ends[longest]), int(ends[longest + 1]))
    stamps = clock[kept] - clock[kept][0]
    time = np.arange(int(stamps[-1] * _CYLINDER_RATE) + 1) / _CYLINDER_RATE
    note = (
        f"samples {kept.start} to {kept.stop - 1} of {clock.size}, the longest stretch without a "
        f"pause of more than {_GAP} s, resampled by linear interpolation to {_CYLINDER_RATE:g} Hz"
    )
    channels = {k: np.asarray(np.interp(time, stamps, read[k][kept])) for k in ("x", "p", "F")}
    units = {k: read.units[k] for k in channels}
    return changed(replace(read, time=time, channels=channels, units=units), channels, units, note)
