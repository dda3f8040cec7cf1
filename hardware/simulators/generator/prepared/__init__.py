"""One recording that was made beforehand, for machines without gcc to compile the plants."""

from __future__ import annotations

import json
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from hardware.simulators.generator.showing import Channels, shown

PREPARED = (1, "tanks", "square_root_flow")
"""Seed, plant and effect of it."""

FILE = "tanks_1.npz"


def prepared() -> tuple[Channels, dict[str, Any]]:
    """Return the recording and its truth, as `shown` does, readings to seven digits."""
    with as_file(files(__name__) / FILE) as path, np.load(path, allow_pickle=False) as kept:
        words, truth = json.loads(str(kept["words"])), json.loads(str(kept["truth"]))
        numbers = {k: kept[k].astype(float) for k in kept.files if k not in ("words", "truth")}
    return {**numbers, **words}, truth


def prepare(folder: Path) -> Path:
    """Make the recording anew and write it; needs gcc."""
    channels, truth = shown(*PREPARED)
    words = {k: v for k, v in channels.items() if isinstance(v, str)}
    kept: dict[str, Any] = {"words": json.dumps(words), "truth": json.dumps(truth)}
    for name, v in channels.items():
        if not isinstance(v, str):
            kept[name] = v if name == "time" else v.astype(np.float32)
    path = folder / FILE
    np.savez_compressed(path, **kept)
    return path
