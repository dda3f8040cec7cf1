"""What an effect of the catalogue is: where it may attach, how it enters the graph, its start."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from bondgraph.elements import C, Element, R, Sensor, Source
from bondgraph.graph import BondGraph
from identification.diagnosis.scene import Scene


@dataclass(frozen=True)
class Insertion:
    """An effect inserted at an element, ready to be fitted.

    Attributes
    ----------
    graph : BondGraph
        The rewritten graph.
    starts : tuple of dict
        Start values to try, by parameter.
    strengths : tuple of str
        Parameters that make the effect; it is absent when all are zero.
    """

    effect: str
    family: str
    law: str
    element: str
    graph: BondGraph
    starts: tuple[Mapping[str, float], ...]
    strengths: tuple[str, ...]

    @property
    def label(self) -> str:
        """Text such as ``hysteresis at C_nl``."""
        return f"{self.effect} at {self.element}"


class Effect(ABC):
    """A physical effect; abstract.

    Class attributes: `name` and `family` from the vocabulary, `law`, one `sentence` for the user,
    `confused_with`, `source` of the law. `home` is False where the effect can sit but seldom
    does: such a place counts only if it explains more than every home.
    """

    name: ClassVar[str]
    family: ClassVar[str]
    law: ClassVar[str]
    sentence: ClassVar[str]
    confused_with: ClassVar[tuple[str, ...]] = ()
    simpler: ClassVar[tuple[str, ...]] = ()
    source: ClassVar[str] = ""

    @abstractmethod
    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Elements where the effect makes sense."""

    def home(self, element: Element) -> bool:
        """Whether `element` is a usual place of this effect."""
        return True

    @abstractmethod
    def insert(self, scene: Scene, element: Element) -> Insertion:
        """Rewrite the graph of `scene` with the effect at `element`."""

    def inserted(
        self,
        element: Element,
        graph: BondGraph,
        starts: tuple[Mapping[str, float], ...],
        strengths: tuple[str, ...],
    ) -> Insertion:
        """Label a rewritten graph."""
        return Insertion(self.name, self.family, self.law, element.name, graph, starts, strengths)


def storages(graph: BondGraph) -> tuple[Element, ...]:
    """All C without a law of their own."""
    return tuple(e for e in graph.of_type(C) if e.law is None)


def mechanical_resistors(graph: BondGraph) -> tuple[Element, ...]:
    """Resistors that can rub: all whose unit is not electrical or thermal."""
    other = ("ohm", "S", "K/W", "W/K")
    return tuple(e for e in graph.of_type(R) if e.law is None and e.unit not in other)


def sources(graph: BondGraph) -> tuple[Element, ...]:
    """Return sources without a drive."""
    return tuple(e for e in graph.of_type(Source) if e.drive is None)


def sensors(graph: BondGraph) -> tuple[Element, ...]:
    """Sensors without a law, lag, delay or drift."""
    return tuple(
        e
        for e in graph.of_type(Sensor)
        if e.law is None and e.lag is None and e.delay is None and not e.drift
    )
