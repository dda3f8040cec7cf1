"""A case of the trial: what is drawn before anything is simulated, and its form in JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Hidden:
    """One concealed effect.

    Parameters
    ----------
    effect : str
        Name by the vocabulary, or ``"unknown"`` for what is outside it.
    place : str
        Element, source, sensor, or ``"clock"``.
    law : str
        Its law in the generator.
    strength_db : float
        Wanted rms of the difference it makes, over the noise.
    draws : tuple of float
        Uniform numbers from which its details follow.
    """

    effect: str
    place: str
    law: str
    strength_db: float
    draws: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class DrawnCase:
    """One recording to be made.

    Parameters
    ----------
    id : str
        Name of the recording; says nothing about it.
    plant : str
        Name of the plant.
    sensors : tuple of str
        Sensors that are recorded.
    cell : str
        ``control``, ``single``, ``outside``, ``form``, ``lookalike`` or ``pair`` (two effects).
    effects : tuple of Hidden
        Concealed physics.
    parameters : mapping
        True values.
    noise : mapping
        ``kind`` and ``snr_db``.
    excitation : str
        Kind of command.
    level : float
        Amplitude in parts of the plant's usual one.
    samples : int
        Length of the recording.
    hold : str
        ``"zero"`` or ``"linear"``.
    seed : int
        Of the command and the noise.
    control_kind : str
        For controls, what disturbs instead of missing physics.
    pair_id : str
        For look-alikes, the pair.
    decisive : bool
        For look-alikes, whether the excitation can separate the pair.
    """

    id: str
    plant: str
    sensors: tuple[str, ...]
    cell: str
    effects: tuple[Hidden, ...]
    parameters: Mapping[str, float]
    noise: Mapping[str, Any]
    excitation: str
    level: float
    samples: int
    hold: str
    seed: int
    control_kind: str = ""
    pair_id: str = ""
    decisive: bool = True
    extra: Mapping[str, float] = field(default_factory=dict)

    def plain(self) -> dict[str, Any]:
        """Return the case as plain values."""
        return json.loads(json.dumps(asdict(self)))  # type: ignore[no-any-return]


def canonical(truths: Sequence[Mapping[str, Any]]) -> bytes:
    """Return one JSON text for one meaning: sorted keys, no spaces, no infinities."""
    text = json.dumps(truths, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return text.encode()
