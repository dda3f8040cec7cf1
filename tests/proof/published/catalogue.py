"""All published protocols by name."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from importlib import import_module
from typing import cast

from bondgraph.support.errors import unknown_name
from identification.datasets import protocol
from tests.proof.published.outcome import Outcome
from tests.proof.published.staging import Progress

PROTOCOLS = (
    "silverbox", "wiener_hammerstein", "bouc_wen", "coupled_drives", "emps", "steering_mirror",
    "friction_damper",
)  # fmt: skip
"""Public data sets of `identification.datasets` with published numbers; each has a module here."""


def run_protocol(
    name: str,
    folder: str | os.PathLike[str] | None = None,
    *,
    share: float = 1.0,
    progress: Progress | None = None,
) -> Outcome:
    """Run one protocol.

    Parameters
    ----------
    name : str
        A name of `PROTOCOLS`.
    folder : path, optional
        Folder of the recordings; `BONDSIGHT_RECORDINGS` if not given.
    share : float
        Part of the training samples that is used, from their start; below 1 the outcome is a
        trial and does not count as official.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1.

    Raises
    ------
    UnknownName
        If there is no such protocol.
    UnusableInput
        If the recording is not there: the line says where to get it.
    """
    if name not in PROTOCOLS:
        raise unknown_name("published protocol", name, "tests.proof.published", PROTOCOLS)
    module = import_module(f"tests.proof.published.{name}")
    begin = time.perf_counter()
    made = cast("Outcome", module.run(protocol(name, folder), share, progress))
    return replace(made, seconds=time.perf_counter() - begin)
