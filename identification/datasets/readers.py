"""What is done to records that their columns alone do not give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import check_file, readable
from bondgraph.signals.recording import Recording
from bondgraph.signals.recording_file import sha256_of
from bondgraph.support.errors import UnusableInput
from identification.datasets.public_set import Records, changed

EMPS_FORCE_PER_VOLT = 35.15065188248547
"""Motor force per drive voltage of the EMPS benchmark, N/V."""
SILVERBOX_TRAIN, SILVERBOX_STOP = (40_650, 40_650 + 65_062), 127_400
"""First 75 % of the multisines of the Silverbox record, and the end of these."""
MIRROR_RATE = 6400.0
MIRROR_LEVELS = ("100mV", "200mV", "300mV")
CYLINDER_RATE = 100.0
MOTO_PULSES = {"board1": 14, "board2": 28}
"""Pulses of the counter in a turn."""
SERVO_ROLLOUTS = 96
SERVO_STEP = 2.0 * np.pi / 4096
"""rad; the encoder has 12 bits."""
_GAP = 0.05


def silverbox_centred(records: Records) -> Records:
    """Silverbox without the means of the training part; `whole` without those of all samples."""
    (read,) = records.values()
    if read.n < SILVERBOX_STOP:
        raise UnusableInput(f"{read.source}: {read.n} samples; the whole record has 131072")
    found = {}
    for name, samples, of in (
        ("", slice(*SILVERBOX_TRAIN), "training part"),
        ("whole", slice(None), "whole record"),
    ):
        channels = {k: v - v[samples].mean() for k, v in read.channels.items()}
        found[name] = changed(read, channels, read.units, f"the mean of the {of} is removed")
    return found


def emps_force(records: Records) -> Records:
    """EMPS: F (N) from the drive voltage, x (m)."""
    note = f"F is the drive voltage times {EMPS_FORCE_PER_VOLT} N/V"
    return {
        name: changed(
            r, {"F": EMPS_FORCE_PER_VOLT * r["F"], "x": r["x"]}, {"F": "N", "x": "m"}, note
        )
        for name, r in records.items()
    }


def hanging_angle(records: Records) -> Records:
    """Pendulum: theta (rad) from hanging."""
    note = "theta is the angle less pi (hanging)"
    return {
        name: changed(r, {**r.channels, "theta": r["theta"] - np.pi}, r.units, note)
        for name, r in records.items()
    }


def longest_stretches(records: Records) -> Records:
    """Pneumatic cylinder: longest stretches without a pause of the logger, on an even grid."""
    return {name: _longest_stretch(r) for name, r in records.items()}


def _longest_stretch(read: Recording) -> Recording:
    clock = read["clock"]
    if np.any(np.diff(clock) <= 0.0):
        raise UnusableInput(f"{read.source}: the time stamps do not increase; get the file again")
    ends = np.concatenate(([0], np.flatnonzero(np.diff(clock) > _GAP) + 1, [clock.size]))
    longest = int(np.argmax(np.diff(ends)))
    kept = slice(int(ends[longest]), int(ends[longest + 1]))
    stamps = clock[kept] - clock[kept][0]
    time = np.arange(int(stamps[-1] * CYLINDER_RATE) + 1) / CYLINDER_RATE
    note = (
        f"samples {kept.start} to {kept.stop - 1} of {clock.size}, the longest stretch without a "
        f"pause of more than {_GAP} s, resampled by linear interpolation to {CYLINDER_RATE:g} Hz"
    )
    channels = {k: np.asarray(np.interp(time, stamps, read[k][kept])) for k in ("x", "p", "F")}
    units = {k: read.units[k] for k in channels}
    return changed(replace(read, time=time, channels=channels, units=units), channels, units, note)


def motor_pulses(records: Records) -> Records:
    """Small DC motor: the speed is a count of pulses in a sample, whose unit is declared."""
    return {
        name: replace(
            r, meta={**r.meta, "resolution": {"w": 2.0 * np.pi / (MOTO_PULSES[name] * r.dt)}}
        )
        for name, r in records.items()
    }


def rollouts(records: Records) -> Records:
    """Hobby servo: one record a rollout, ``rollout_00`` on, each from time 0."""
    (read,) = records.values()
    number = read["rollout"]
    found = {}
    for i in range(SERVO_ROLLOUTS):
        mine = np.flatnonzero(number == i)
        if not mine.size or mine[-1] - mine[0] != mine.size - 1:
            raise UnusableInput(
                f"{read.source}: rollout {i} is absent or in pieces; get the file again"
            )
        channels = {k: read[k][mine] for k in ("u", "q")}
        units = {k: read.units[k] for k in channels}
        meta = {**read.meta, "resolution": {"q": SERVO_STEP}}
        time = np.asarray(np.arange(mine.size) * read.dt, dtype=np.float64)
        found[f"rollout_{i:02d}"] = replace(
            read, time=time, channels=channels, units=units, meta=meta
        )
    return found


def steering_mirror(paths: tuple[Path, ...]) -> Records:
    """Steering mirror: u1..u3 (V), y1..y3 (m); each record holds two periods of 8192 samples."""
    arrays: dict[str, NDArray[np.float64]] = {}
    places: dict[str, Path] = {}
    for path in paths:
        made = _stored(path)
        arrays |= made
        places |= dict.fromkeys(made, path)
    digests = {p: sha256_of(p) for p in paths}
    found = {}
    for level in MIRROR_LEVELS:
        for side in ("train", "test"):
            u, y = (_mirror_array(arrays, f"{k}_{level}_{side}") for k in "uy")
            for r in range(u.shape[2]):
                pairs = [(f"{k}{i + 1}", a, i) for k, a in (("u", u), ("y", y)) for i in range(3)]
                channels = {name: _periods(values, i, r) for name, values, i in pairs}
                units = {k: "V" if k[0] == "u" else "m" for k in channels}
                name = level if u.shape[2] == 1 else f"{level}_{r + 1}"
                time = np.arange(channels["u1"].size) / MIRROR_RATE
                meta = {"period": u.shape[0], "level": level}
                place = places[f"y_{level}_{side}"]
                found[f"{side}/{name}"] = Recording(
                    name, time, channels, units, place.name, digests[place], meta
                )
    return found


def _stored(path: Path) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a NumPy file by name; one that is damaged is told in one line."""
    check_file(path)
    with readable(path.name, path.suffix, "get the file again"):
        if path.suffix != ".npz":
            return {path.stem: np.load(path, allow_pickle=False)}
        with np.load(path, allow_pickle=False) as stored:
            return dict(stored)


def _mirror_array(arrays: Mapping[str, NDArray[np.float64]], name: str) -> NDArray[np.float64]:
    if name not in arrays or arrays[name].ndim != 4 or arrays[name].shape[1] != 3:
        raise UnusableInput(
            f"steering_mirror: no array {name!r} of shape (samples, 3, realisations, periods); get "
            "the file again"
        )
    return arrays[name]


def _periods(values: NDArray[np.float64], channel: int, realisation: int) -> NDArray[np.float64]:
    """Periods one after the other, (samples * periods,)."""
    return np.asarray(values[:, channel, realisation, :].T.ravel(), dtype=np.float64)
