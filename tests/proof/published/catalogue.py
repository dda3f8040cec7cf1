"""All published protocols by name."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType

from bondgraph.support.errors import unknown_name
from tests.proof.published.outcome import Outcome
from tests.proof.published.staging import Progress

__all__ = ["PROTOCOLS", "Run", "run_protocol"]

Run = Callable[..., Outcome]

_PACKAGE = "tests.proof.published"
_NAMES = (
    "silverbox",
    "wiener_hammerstein",
    "bouc_wen",
    "coupled_drives",
    "emps",
    "steering_mirror",
)


def _late(name: str) -> Run:
    def run(
        folder: str | os.PathLike[str] | None = None,
        *,
        share: float = 1.0,
        progress: Progress | None = None,
    ) -> Outcome:
        module = import_module(f"{_PACKAGE}.{name}")
        outcome: Outcome = module.run(folder, share=share, progress=progress)
        return outcome

    run.__doc__ = f"Run the protocol of {name}."
    return run


PROTOCOLS: Mapping[str, Run] = MappingProxyType(
    {n: _late(n) for n in _NAMES if find_spec(f"{_PACKAGE}.{n}") is not None}
)
"""Name -> ``run(folder=None, *, share=1.0, progress=None)``."""


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
        Part of the training samples that is used; below 1 the outcome is a trial.
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
        raise unknown_name("published protocol", name, _PACKAGE, PROTOCOLS)
    return PROTOCOLS[name](folder, share=share, progress=progress)
