"""Records and materials with known answers for the tests of the judgement."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bondgraph.support.arrays import Array
from identification.validation.validation_data import Number, ValidationData, ValidationRecord


def coloured(rng: np.random.Generator, n: int, phi: float) -> Array:
    """Autoregressive noise of order one with unit innovations, settled."""
    e = rng.standard_normal(n + 300)
    for k in range(1, e.size):
        e[k] += phi * e[k - 1]
    return np.asarray(e[300:])


def record(
    residual: Array,
    *,
    simulated: Array | None = None,
    inputs: Mapping[str, Array] | None = None,
    floor: float = 1.0,
    name: str = "run",
    held: float = 1 / 3,
    whitening: tuple[Array, ...] = (),
    sha256: str = "",
) -> ValidationRecord:
    """Return a record of one reading whose residual is the one given."""
    n = residual.size
    s = 10 * np.sin(0.05 * np.arange(n)) if simulated is None else simulated
    cut = round(n * (1 - held))
    train = np.arange(n) < cut
    return ValidationRecord(
        name, 0.01 * np.arange(n), ("x",), ("m",), (s + residual)[:, None], s[:, None],
        np.array([floor]), train, ~train, dict(inputs or {}), sha256, whitening,
    )  # fmt: skip


def material(
    *records: ValidationRecord, numbers: tuple[Number, ...] = (), n_free: int = 3
) -> ValidationData:
    """Return a converged fit of these records."""
    return ValidationData("plant", records, numbers, n_free, "converged")
