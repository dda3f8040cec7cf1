"""Recording on the virtual bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.draw import Truth, deviation_ratio
from hardware.simulators.excitation import N_SAMPLES, SAMPLE_RATE, training_samples, voltage
from hardware.simulators.simulation import SUBSTEPS, simulate

CSV_HEADER = "t_s,V[V],x[m],i[A]"


@dataclass(frozen=True, slots=True)
class BenchRecording:
    """What the bench shows.

    Parameters
    ----------
    time
        Instants (s), ``(N,)``.
    V
        Commanded voltage (V), exact, ``(N,)``.
    x
        Displacement from the first sample (m), with noise and offset, ``(N,)``.
    i
        Current (A), with noise and offset, ``(N,)``.
    meta
        Sampling rate, samples meant for training, hold of the converter: nothing of the truth.
    """

    time: Array
    V: Array
    x: Array
    i: Array
    meta: Mapping[str, float | int | str]

    def write_csv(self, path: str | Path) -> None:
        """Write the channels with 17 significant digits, ``t_s,V[V],x[m],i[A]``."""
        table = np.column_stack([self.time, self.V, self.x, self.i])
        np.savetxt(path, table, fmt="%.17g", delimiter=",", header=CSV_HEADER, comments="")


def record(
    truth: Truth, seed: int, *, n_samples: int = N_SAMPLES, substeps: int = SUBSTEPS
) -> BenchRecording:
    """Record the channels of a bench.

    The class of strength is exact for the excitation on which the truth was sized, that is for
    ``seed == truth.seed`` and a full record.

    Parameters
    ----------
    truth
        Bench with its concealed effect.
    seed
        Seed of excitation and noise.
    n_samples
        Length of the record.
    substeps
        Steps of the integrator per sample.
    """
    command = voltage(seed, n_samples)
    clean = simulate(truth.plant, truth.effect, command, substeps=substeps)
    rng = np.random.default_rng([seed, 0x401])
    noise = truth.noise
    meta: dict[str, float | int | str] = {
        "sample_rate_hz": SAMPLE_RATE,
        "n_samples": n_samples,
        "n_training": training_samples(n_samples),
        "hold": "first-order (linear between samples)",
        "device": "virtual P-840.1 stack with payload",
    }
    return BenchRecording(
        time=np.arange(n_samples) / SAMPLE_RATE,
        V=command,
        x=clean.x + noise.x_offset + noise.x_rms * rng.standard_normal(n_samples),
        i=clean.i + noise.i_offset + noise.i_rms * rng.standard_normal(n_samples),
        meta=MappingProxyType(meta),
    )


def visibility(truth: Truth, seed: int, *, n_samples: int = N_SAMPLES, substeps: int = 3) -> float:
    """Rms deviation from the twin without the effect over noise, of the more touched channel.

    Parameters
    ----------
    truth
        Bench with its concealed effect.
    seed
        Seed of the excitation.
    n_samples, substeps
        As in ``record``.
    """
    command = voltage(seed, n_samples)
    pair = [
        simulate(truth.plant, t.effect, command, substeps=substeps) for t in (truth, truth.twin())
    ]
    changed, plain = ((r.x, r.i) for r in pair)
    return deviation_ratio(changed, plain, truth.noise)
