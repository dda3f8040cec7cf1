"""A memory that is there is found by the regression on plays, and by nothing else."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bondgraph.hysteresis import play_record
from bondgraph.signals.recording import Recording
from tests.proof.real import mirror_memory
from tests.proof.real.steering_mirror import AXES, PERIOD

RATE = 6400.0


def settled(name: str, seed: int) -> Recording:
    """Two periods of three multisines below 3 kHz, and readings that remember the first one."""
    rng = np.random.default_rng(seed)
    lines = np.zeros((PERIOD // 2 + 1, 3), complex)
    excited = slice(1, int(3000 * PERIOD / RATE))
    lines[excited] = np.exp(2j * np.pi * rng.random((excited.stop - 1, 3)))
    u = np.fft.irfft(lines, PERIOD, axis=0) * 20
    fine = mirror_memory.finer(u)[:, 0]  # it turns between samples, too
    held = play_record(np.tile(fine, 2), np.array([0.3]), np.zeros(1))[fine.size :: 8]
    y = u @ np.array([[1.0, 0.2, 0.1], [0.3, 1.0, 0.2], [0.1, 0.3, 1.0]]) + 0.3 * held
    channels = {f"u{a}": np.tile(u[:, i], 2) for i, a in enumerate(AXES)}
    channels |= {f"y{a}": np.tile(y[:, i], 2) for i, a in enumerate(AXES)}
    units = {c: "V" if c.startswith("u") else "m" for c in channels}
    return Recording(f"mirror/{name}", np.arange(2 * PERIOD) / RATE, channels, units)


def test_a_memory_that_is_there_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    train = tuple(settled(f"train/300mV_{i}", i) for i in (1, 2, 3))
    found = SimpleNamespace(train=train, tests={"300mV": settled("test/300mV", 4)})
    monkeypatch.setattr(mirror_memory, "protocol", lambda *_: found)
    left = mirror_memory.left_by_forms("300mV")
    alone = left["linear filter alone"]
    assert (alone < 0.5 * left["reading"]).all()
    assert (left["plays of the commands"] < 0.3 * alone).all()
    assert (left["odd powers of the commands"] > 0.6 * alone).all()
