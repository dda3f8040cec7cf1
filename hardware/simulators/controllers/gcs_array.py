"""The form in which GCS controllers hand out tables."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def gcs_array(
    identity: str, period: float, names: list[str], values: NDArray[np.float64]
) -> list[str]:
    """Return the lines of a table ``(n, columns)`` with its header.

    Parameters
    ----------
    identity : str
        Of the device.
    period : float
        Time between rows (s).
    names : list of str
        Of the columns.
    values : ndarray
        (n, columns).
    """
    header = [
        f"# REM {identity}",
        "#",
        "# VERSION = 1",
        "# TYPE = 1",
        "# SEPARATOR = 32",
        f"# DIM = {values.shape[1]}",
        f"# SAMPLE_TIME = {period:.9f}",
        f"# NDATA = {values.shape[0]}",
        "#",
        *(f"# NAME{k} = {name}" for k, name in enumerate(names)),
        "#",
        "# END_HEADER",
    ]
    return header + [" ".join(f"{v:.6f}" for v in row) for row in values.tolist()]
