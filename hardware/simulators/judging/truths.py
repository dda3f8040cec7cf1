"""What was concealed in a recording, as plain values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

SHOWS = 3.0
"""An effect shows if it moves a reading by more than this many times its noise (rms)."""


@dataclass(frozen=True, slots=True)
class ConcealedEffect:
    """One concealed effect.

    Attributes
    ----------
    names : frozenset of str
        What it may rightly be called; empty for physics outside the vocabulary.
    kinds, places : frozenset of str
        Kinds and elements that are right.
    moved : float
        The largest rms that it moves a reading by, over the reading's noise.
    """

    effect: str
    names: frozenset[str]
    family: str
    kinds: frozenset[str]
    places: frozenset[str]
    law: str
    moved: float

    @property
    def shows(self) -> bool:
        """Whether it moves a reading by more than three times its noise."""
        return self.moved > SHOWS


@dataclass(frozen=True, slots=True)
class ExamTruth:
    """What was concealed in one recording.

    Attributes
    ----------
    noise : mapping
        Rms of the noise of each reading, SI.
    moved : mapping
        Rms of what all effects together moved, over the noise, for each reading.
    active : int
        Stretches of forty in which something moved.
    """

    id: str
    cell: str
    plant: str
    effects: tuple[ConcealedEffect, ...]
    noise: Mapping[str, float]
    moved: Mapping[str, float]
    control: str = ""
    active: int = 0

    @property
    def empty(self) -> bool:
        """Nothing is missing from the model."""
        return not self.effects

    @property
    def outside(self) -> bool:
        """Nothing that is concealed has a name."""
        return bool(self.effects) and not any(e.names for e in self.effects)

    @property
    def shows(self) -> bool:
        """Whether any reading moved by more than three times its noise."""
        return max(self.moved.values(), default=0.0) > SHOWS

    @property
    def main(self) -> ConcealedEffect | None:
        """The effect that moves most."""
        return max(self.effects, key=lambda e: e.moved, default=None)

    @property
    def single(self) -> bool:
        """One effect, or one beside which the others are weak, and it has a name."""
        alone = len(self.effects) == 1 or self.cell == "weak_further"
        return alone and not self.mixed_up and self.main is not None and bool(self.main.names)

    @property
    def mixed_up(self) -> bool:
        """The recording is at fault: no physics is missing, a mistake is to be told."""
        return self.cell == "mixed_up"

    @property
    def words(self) -> str:
        """The truth in a few words."""
        said = [f"{e.law}@{min(e.places)} {e.moved:.3g}" for e in self.effects]
        return " + ".join(said) or self.control or "nothing"


def truth_of(row: Mapping[str, Any]) -> ExamTruth:
    """Read one truth as it was written with the recording."""
    effects = tuple(
        ConcealedEffect(
            str(e["effect"]),
            frozenset(map(str, e["names"])),
            str(e["family"]),
            frozenset(map(str, e["kinds"])),
            frozenset(map(str, e["places"])),
            str(e["law"]),
            max(map(float, e["moved"].values()), default=0.0),
        )
        for e in row["effects"]
    )
    return ExamTruth(
        str(row["id"]),
        str(row["cell"]),
        str(row["plant"]),
        effects,
        {k: float(v) for k, v in row["noise_std"].items()},
        {k: float(v) for k, v in row["moved"].items()},
        str(row.get("control_kind", "")),
        int(row.get("active", 0)),
    )
