"""What one real recording is tried with, fixed before any diagnosis of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from bondgraph.graph.bond_graph import BondGraph
from hardware.simulators.generator.families import FAMILY_OF
from identification.datasets import SETS, LoadedRecording, load, protocol

__all__ = ["KINDS", "Published", "RealCase", "Truth"]

KINDS: Mapping[str, str] = MappingProxyType(
    {
        "restoring": "a curve over the displacement",
        "dissipative": "a curve over the flow",
        "surface": "a surface over displacement and flow",
        "memory": "turning points of the past, whatever the speed",
        "slow": "first-order relaxations: creep, heat, lags",
        "mode": "a resonance that is missing",
        "ratio": "a ratio that changes",
        "command": "a curve, a short filter or a delay of the command",
        "sensing": "a curve, a short filter or a delay of the reading, ripple, drift",
        "time": "a coefficient that changes with time",
        "exogenous": "a force from outside",
    }
)
"""Sorts of missing physics that can be seen at a place although no law fits it."""


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
    dataset : str
        Name in `identification.datasets.SETS`.
    parts : tuple of str
        Names of its parts: train and test parts, or one record with a split of its own.
    prepare : callable
        Those parts (a record with a split: both) -> recording and split of the case.
    model : callable
        -> impoverished graph; sources and sensors bear the names of the channels.
    truth : tuple of Truth
        Documented effects that the model lacks; each is a right answer.
    kinds : tuple of str
        Of `KINDS`: what is right at a place of these effects although no law of the catalogue is.
    published : Published or None
        Best published value.
    label : "unseen", "seen before" or "simulated"
        Whether the tool was ever diagnosed with this recording while it was built; or that it is
        simulated by others, and proves nothing about real devices.
    official : bool
        The published error is that of a free run over the official tests: the repaired model is
        fitted to the official training part and run over them too.
    control : bool
        Nearly nothing is missing: to find nothing is right too.
    comment : str
        What a reader of the result must know.
    """

    name: str
    dataset: str
    parts: tuple[str, ...]
    prepare: Callable[..., LoadedRecording]
    model: Callable[[], BondGraph]
    truth: tuple[Truth, ...]
    kinds: tuple[str, ...]
    published: Published | None = None
    label: Literal["unseen", "seen before", "simulated"] = "unseen"
    official: bool = False
    control: bool = False
    comment: str = ""

    def load(self, folder: str | None = None) -> LoadedRecording:
        """Read the parts from the folder of the recordings; None: that of the environment."""
        known = [p.called for p in SETS[self.dataset].parts if p.called and p.name in self.parts]
        if known:
            return self.prepare(*load(known[0], folder))
        found = protocol(self.dataset, folder)
        return self.prepare(*(found[name] for name in self.parts))
