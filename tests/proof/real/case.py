"""What one real recording is tried with, fixed before any diagnosis of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from bondgraph.graph.bond_graph import BondGraph
from identification.datasets import LoadedRecording
from tests.proof.trial.vocabulary import FAMILY_OF

__all__ = ["Folder", "Published", "RealCase", "Truth"]

Folder = str | None
"""Folder of the recordings; None: that of the environment."""


@dataclass(frozen=True, slots=True)
class Truth:
    """One effect that the owners of the data document, and where it may be placed.

    Parameters
    ----------
    effect : str
        Of the vocabulary.
    places : tuple of str
        Elements of the impoverished model at which the effect is right: the true port, and those
        that the recorded signals cannot tell from it.
    evidence : str
        How it is known.
    """

    effect: str
    places: tuple[str, ...]
    evidence: str

    @property
    def family(self) -> str:
        """Family of the effect."""
        return FAMILY_OF[self.effect]


@dataclass(frozen=True, slots=True)
class Published:
    """Best published held-out error.

    Parameters
    ----------
    value : float
        In `unit`.
    unit : str
        As published.
    source : str
        Method and work.
    comparable : str
        Whether it can be set beside our held-out error, in words.
    """

    value: float
    unit: str
    source: str
    comparable: str

    def __str__(self) -> str:
        """Return value and source."""
        return f"{self.value:g} {self.unit} ({self.source}; {self.comparable})"


@dataclass(frozen=True, slots=True)
class RealCase:
    """A recording, an impoverished model, and what an honest answer is.

    Parameters
    ----------
    name : str
        Key; also the folder of the results.
    label : "unseen" or "seen before"
        Whether the tool was ever diagnosed with this recording while it was built.
    dataset : str
        Name in `identification.datasets.SETS`.
    load : callable
        Folder of the recordings (None: of the environment) -> recording and split.
    model : callable
        -> impoverished graph; sources and sensors bear the names of the channels.
    truth : tuple of Truth
        Documented effects that the model lacks; each is a right answer.
    published : Published or None
        Best published value.
    control : bool
        Nearly nothing is missing: to find nothing is right too.
    comment : str
        What a reader of the result must know.
    """

    name: str
    label: Literal["unseen", "seen before"]
    dataset: str
    load: Callable[[Folder], LoadedRecording]
    model: Callable[[], BondGraph]
    truth: tuple[Truth, ...]
    published: Published | None = None
    control: bool = False
    comment: str = ""
