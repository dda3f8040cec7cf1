"""What the tool may know of each recording, and the one text of the truths that is hashed."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True, slots=True)
class Public:
    """What the tool is told of one recording, beside the recording itself.

    Attributes
    ----------
    hold : str
        What the command does between samples, ``hold`` or ``linear``: a laboratory knows its
        converter.
    delay : float
        Dead time of the command that the laboratory declares, s; 0 for none.
    resolution : tuple of float
        Unit of each sensor's converter where it is coarse and declared, SI; 0 for fine ones.
    """

    id: str
    plant: str
    sensors: tuple[str, ...]
    hold: str = "hold"
    delay: float = 0.0
    resolution: tuple[float, ...] = ()


def canonical(data: Any) -> str:
    """Return the one text of plain data that is hashed: sorted keys, no spaces."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def read_public(path: Path) -> tuple[Public, ...]:
    """Read the public list of a trial.

    Raises
    ------
    UnusableInput
        The file is missing or no list of recordings.
    """
    if not path.is_file():
        raise UnusableInput(f"{path}: there is no trial here; run bondsight blind generate first")
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["recordings"]
        return tuple(
            Public(
                str(r["id"]),
                str(r["plant"]),
                tuple(map(str, r["sensors"])),
                str(r["hold"]),
                float(r["delay"]),
                tuple(map(float, r.get("resolution", ()))),
            )
            for r in rows
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UnusableInput(f"{path}: no list of recordings ({error!r})") from None
