"""Write recordings and truths, resumably; seal the truths; read a recording as the tool may."""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hardware.simulators.generator.case import DrawnCase, canonical
from hardware.simulators.generator.making import record

Array = NDArray[np.float64]
Make = Callable[[DrawnCase], tuple[Mapping[str, Any], dict[str, Any]]]


def _write(path: Path, content: bytes) -> None:
    """Write so that a reader sees the whole file or none."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    part.write_bytes(content)
    part.replace(path)


def _made(case: DrawnCase, folder: Path, make: Make) -> dict[str, Any]:
    """Return the truth of a case, making the recording if it is not there."""
    kept, file = folder / "sealed" / f"{case.id}.json", folder / "records" / f"{case.id}.npz"
    if kept.exists() and file.exists():
        truth: dict[str, Any] = json.loads(kept.read_text())
        if truth["seed"] == case.seed and truth["plant"] == case.plant:
            return truth
    channels, truth = make(case)
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {k: np.asarray(v) for k, v in channels.items()}
    np.savez(buffer, **arrays)
    _write(file, buffer.getvalue())
    _write(kept, canonical([truth])[1:-1])
    return truth


def generate(
    cases: Iterable[DrawnCase],
    folder: str | Path,
    *,
    progress: Callable[[str], None] = lambda name: None,
    make: Make = record,
) -> list[dict[str, Any]]:
    """Make the recordings and return their truths in the order of the cases.

    What is there already is kept, so that an interrupted call goes on. Recordings are in
    ``records/``, without any trace of the truth; truths in ``sealed/``, one file a case and all in
    ``truths.json``.

    Parameters
    ----------
    cases : iterable of DrawnCase
        From `draw`.
    folder : path
        Where to write.
    progress : callable, optional
        Gets the name of each recording that is done.
    make : callable, optional
        From a case to what the tool may see and the truth.
    """
    root = Path(folder)
    truths = []
    for case in cases:
        truths.append(_made(case, root, make))
        progress(case.id)
    _write(root / "sealed" / "truths.json", canonical(truths))
    return truths


def seal(truths: Sequence[Mapping[str, Any]], salt: str) -> str:
    """Return the SHA-256 in hexadecimal digits of the salt followed by the canonical JSON."""
    return hashlib.sha256(salt.encode() + canonical(truths)).hexdigest()


def load_truths(folder: str | Path) -> list[dict[str, Any]]:
    """Return the truths of a folder; only the score may call this, after the answers are in."""
    text = (Path(folder) / "sealed" / "truths.json").read_text()
    truths: list[dict[str, Any]] = json.loads(text)
    return truths


def load_case(folder: str | Path, name: str) -> dict[str, Array | str | float]:
    """Return what the tool may see of a recording.

    Returns
    -------
    dict
        ``time`` and the channels as arrays; ``plant`` and ``hold`` as text; ``declared_delay`` in
        s as a number: a dead time of the command that the laboratory knows of;
        ``declared_resolution``: (sensors,), unit of each sensor's converter that the laboratory
        knows of, 0 for a fine one. Rounding by it is noise, not missing physics.
    """
    out: dict[str, Array | str | float] = {}
    with np.load(Path(folder) / "records" / f"{name}.npz", allow_pickle=False) as file:
        for key in file.files:
            value = file[key]
            if value.ndim:
                out[key] = value
            else:
                out[key] = str(value) if value.dtype.kind == "U" else float(value)
    return out
