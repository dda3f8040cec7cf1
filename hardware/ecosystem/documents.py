"""Descriptions and readings in the form of Bluesky's event model."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from hardware.contracts import Identity


def source_of(identity: Identity) -> str:
    """Return who measured, as the event model's source."""
    parts = (identity.maker, identity.model, identity.serial)
    return " ".join(p for p in parts if p) or "unnamed device"


def or_nan(value: float | None) -> float:
    """Return a number, NaN for one that nobody knows."""
    return float("nan") if value is None else value


def number_key(source: str, unit: str, precision: int = 6) -> dict[str, Any]:
    """Return the data key of one number."""
    return {
        "source": source,
        "dtype": "number",
        "shape": [],
        "units": unit,
        "precision": precision,
        "dtype_numpy": "<f8",
    }


def array_key(source: str, unit: str, samples: int, dtype: np.dtype[Any]) -> dict[str, Any]:
    """Return the data key of a whole block, one array."""
    return {
        "source": source,
        "dtype": "array",
        "shape": [samples],
        "units": unit,
        "dims": ["sample"],
        "dtype_numpy": dtype.newbyteorder("<").str,
    }


def readings(values: Mapping[str, Any], stamp: float | None = None) -> dict[str, dict[str, Any]]:
    """Return values with one time stamp (s since 1970)."""
    now = time.time() if stamp is None else stamp
    return {k: {"value": v, "timestamp": now} for k, v in values.items()}
