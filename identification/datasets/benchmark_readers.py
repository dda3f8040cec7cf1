"""How the sets of published protocols are read and parted; official splits where files allow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.recording import Recording
from bondgraph.signals.recording_file import sha256_of
from bondgraph.support.errors import UnusableInput
from identification.datasets import loaders
from identification.datasets.public_set import Parts, changed, cut

__all__ = [
    "bouc_wen",
    "coupled_drives",
    "emps",
    "f16",
    "silverbox",
    "steering_mirror",
    "wiener_hammerstein",
]

SILVERBOX_TRAIN = 65_062
"""First 75 % of the 86 750 samples of the multisines."""
MIRROR_RATE = 6400.0
MIRROR_LEVELS = ("100mV", "200mV", "300mV")
MIRROR_REALISATIONS = (6, 3)
F16_PERIOD = 8192


def silverbox(paths: tuple[Path, ...]) -> Parts:
    """Silverbox: u (V), y (V); the means of the training part are removed."""
    path = paths[0]
    if path.suffix == ".mat":
        plan = {"u": "V1[V]", "y": "V2[V]"}
        read = Recording.read(path, plan, fs=loaders.SILVERBOX_RATE)
    else:
        read = Recording.read(path, {"u": "snls80mV_u_V", "y": "snls80mV_y_V"})
    sines = loaders.SILVERBOX_MULTISINE
    first = sines.start + SILVERBOX_TRAIN
    cut(read, 0, sines.stop)
    fitted = slice(sines.start, first)
    centred = {k: v - v[fitted].mean() for k, v in read.channels.items()}
    read = changed(read, centred, read.units, "the mean of the training part is removed")
    tests = {
        "multisine": cut(read, first, sines.stop),
        "arrow_full": cut(read, 100, 40_575),
        "arrow_no_extrapolation": cut(read, 100, 32_100),
    }
    return Parts({"multisine": cut(read, sines.start, first)}, tests)


def wiener_hammerstein(paths: tuple[Path, ...]) -> Parts:
    """Wiener-Hammerstein circuit: u (V), y (V) as recorded."""
    path = paths[0]
    if path.suffix == ".mat":
        read = Recording.read(path, {"u": "uBenchMark[V]", "y": "yBenchMark[V]"}, fs=51_200.0)
    else:
        read = Recording.read(path, {"u": "u_V", "y": "y_V"})
    train, test = cut(read, 5200, 105_200), cut(read, 105_200, 184_000)
    return Parts({"noise": train}, {"noise": test})


def bouc_wen(paths: tuple[Path, ...]) -> Parts:
    """Bouc-Wen oscillator (simulated): F (N), x (m)."""
    names = ("train_multisine", "test_multisine", "test_sinesweep")
    found = {}
    for name in names:
        part, _, signal = name.partition("_")
        if len(paths) == 1:
            plan = {"F": f"{name}_u_N", "x": f"{name}_y_m"}
            found[name] = Recording.read(paths[0], plan)
        else:
            plan = {"F": f"{signal}/u[N]", "x": f"{signal}/y[m]"}
            file = next(p for p in paths if p.stem == part)
            found[name] = Recording.read(file, plan, fs=750.0)
    return Parts(
        {"multisine": found[names[0]]},
        {"multisine": found[names[1]], "sinesweep": found[names[2]]},
    )


def coupled_drives(paths: tuple[Path, ...]) -> Parts:
    """Coupled drives, binary sequences: u (V), y (sensor reading, no unit)."""
    path = paths[0]
    train, tests = {}, {}
    for i, level in enumerate(("1V", "1.5V", "0.5V"), 1):
        if path.suffix == ".mat":
            read = Recording.read(path, {"u": f"u{i}[V]", "y": f"z{i}[1]"}, fs=50.0)
        else:
            read = Recording.read(path, {"u": f"u{i}_V", "y": f"y{i}[1]"})
        train[level], tests[level] = cut(read, 0, 400), cut(read, 400, 500)
    return Parts(train, tests)


def emps(paths: tuple[Path, ...]) -> Parts:
    """EMPS: F (N), x (m); both official records if they are there, else the first one parted."""
    first = loaders.emps(paths[0])
    if len(paths) > 1:
        return Parts({"record": first}, {"pulses": loaders.emps(paths[1])})
    kept = first.n - first.n // 3
    parts = {"first": cut(first, 0, kept)}, {"last_third": cut(first, kept, first.n)}
    return Parts(*parts, own=True)


def steering_mirror(paths: tuple[Path, ...]) -> Parts:
    """Steering mirror: u1..u3 (V), y1..y3 (m); each record holds two periods of 8192 samples."""
    if len(paths) == 1:
        with np.load(paths[0], allow_pickle=False) as stored:
            arrays = {k: stored[k] for k in stored.files}
        digests = dict.fromkeys(arrays, sha256_of(paths[0]))
        files = dict.fromkeys(arrays, paths[0].name)
    else:
        arrays = {p.stem: np.load(p, allow_pickle=False) for p in paths}
        digests = {p.stem: sha256_of(p) for p in paths}
        files = {p.stem: p.name for p in paths}
    found: dict[str, dict[str, Recording]] = {"train": {}, "test": {}}
    for level in MIRROR_LEVELS:
        for part, records in found.items():
            u, y = (_mirror_array(arrays, f"{k}_{level}_{part}") for k in "uy")
            for r in range(u.shape[2]):
                channels = {f"u{i + 1}": _periods(u, i, r) for i in range(3)}
                channels |= {f"y{i + 1}": _periods(y, i, r) for i in range(3)}
                units = {k: "V" if k[0] == "u" else "m" for k in channels}
                name = level if u.shape[2] == 1 else f"{level}_{r + 1}"
                time = np.arange(channels["u1"].size) / MIRROR_RATE
                meta = {"period": u.shape[0], "level": level}
                key = f"y_{level}_{part}"
                records[name] = Recording(
                    name, time, channels, units, files[key], digests[key], meta
                )
    counts = tuple(len(v) // len(MIRROR_LEVELS) for v in found.values())
    return Parts(found["train"], found["test"], own=counts != MIRROR_REALISATIONS)


def _mirror_array(arrays: dict[str, NDArray[np.float64]], name: str) -> NDArray[np.float64]:
    if name not in arrays or arrays[name].ndim != 4 or arrays[name].shape[1] != 3:
        raise UnusableInput(
            f"steering_mirror: no array {name!r} of shape (samples, 3, realisations, periods); get "
            "the file again"
        )
    return arrays[name]


def _periods(values: NDArray[np.float64], channel: int, realisation: int) -> NDArray[np.float64]:
    """Periods one after the other, (samples * periods,)."""
    return np.asarray(values[:, channel, realisation, :].T.ravel(), dtype=np.float64)


def f16(paths: tuple[Path, ...]) -> Parts:
    """F-16, lowest level: F (N), a1..a3 (m/s^2); nine periods of one multisine."""
    plan = {"F": "force_N", "a1": "acc1_m_s2", "a2": "acc2_m_s2", "a3": "acc3_m_s2"}
    read = Recording.read(paths[0], plan)
    # the first period is not settled
    train, test = cut(read, F16_PERIOD, 5 * F16_PERIOD), cut(read, 5 * F16_PERIOD, 9 * F16_PERIOD)
    return Parts({"periods_2_to_5": train}, {"periods_6_to_9": test})
