"""What an effect of the catalogue is: where it may attach, how it enters the graph, its start."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.drives import Drive
from bondgraph.graph.elements import C, Element, R, Source
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Law
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.catalogue.places import sense
from identification.diagnosis.catalogue.site import (
    NOTHING,
    NOWHERE,
    Grid,
    Site,
    Values,
    over,
    own_parameters,
)
from identification.diagnosis.catalogue.starts import rebalanced
from identification.diagnosis.screening.port_history import FittedModel


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
    simpler, confused_with : tuple of str
        Names of effects it contains, and of those it may be taken for.
    sentence : str
        The effect in words for the user.
    within : tuple of (str, float, float)
        Parameters with the range in which the law is what its name says.
    form : bool
        A richer law of the effect, which others no longer contain.
    courses : mapping of str to ndarray, shape (N,), SI
        Where states of the law went along the record, from zero, as far as that is known.
    joined : str
        The other element of a law that acts between two.
    plain : bool
        A linear element that the model lacks.
    """

    effect: str
    family: str
    law: str
    element: str
    graph: BondGraph
    starts: tuple[Mapping[str, float], ...]
    strengths: tuple[str, ...]
    simpler: tuple[str, ...] = ()
    confused_with: tuple[str, ...] = ()
    sentence: str = ""
    kind: str = ""
    within: tuple[tuple[str, float, float], ...] = ()
    form: bool = False
    courses: Mapping[str, Array] = field(default_factory=dict, compare=False, repr=False)
    joined: str = ""
    plain: bool = False

    @property
    def label(self) -> str:
        """Text such as ``hysteresis at C_nl``."""
        return f"{self.effect} at {self.element}"

    def contains(self, other: Insertion) -> bool:
        """Whether another law at the same element is a special case of this one."""
        return other.effect in self.simpler and other.element == self.element and not other.form

    def is_itself(self, values: Mapping[str, float]) -> bool:
        """Whether the law with these values is what its name says, not another effect's limit."""
        return all(low <= values.get(name, low) <= high for name, low, high in self.within)


@dataclass(frozen=True, eq=False)
class Signature:
    """What a weak effect adds at its port: columns that a linear screening weighs.

    Attributes
    ----------
    columns : ndarray, shape (N, k)
        Addition to the output of the element's law (effort of C, R and I; the secondary effort of
        a two-port), to the command of a source, to the reading of a sensor; SI, along the record.
    flow : ndarray, shape (N, k), or None
        Two-ports only: what each column adds to the primary flow at the same time.
    shape : dict of str to float
        The shape parameters these columns were made with (a width, a time constant); given back
        to `Effect.insert` as part of the hint.
    course : str
        The course that the columns follow, or the law they stand for, where there are several: the
        best signature of each is fitted.
    beside : tuple of (str, ndarray of shape (N, k))
        What each column adds at other elements at the same time, by their names.
    seen : ndarray, shape (N, n_y, k), or None
        What each column changes in the readings, where no addition at one port says it.
    """

    columns: Array
    flow: Array | None = None
    shape: Mapping[str, float] | None = None
    course: str = ""
    beside: tuple[tuple[str, Array], ...] = ()
    seen: Array | None = None

    @classmethod
    def of(cls, columns: Sequence[Array], **shape: float) -> Signature:
        """Return a signature of some columns, shape (N,) each."""
        return cls(np.stack(columns, axis=1), shape=shape)


@dataclass(frozen=True, eq=False)
class Hint:
    """What the linear screening found for one effect at one place.

    Attributes
    ----------
    shape : dict of str to float
        Shape of the signature that explained most.
    weights : ndarray, shape (k,)
        Least-squares weights of its columns.
    """

    shape: Mapping[str, float]
    weights: Array

    def by_name(self, names: Iterable[str]) -> dict[str, float]:
        """Return the weights as start values of as many parameters."""
        return dict(zip(names, map(float, self.weights), strict=True))


class Effect:
    """A physical effect: where it may sit, its law there, and the words for it; to be subclassed.

    Class attributes of words: `name` and `family` from the vocabulary, the `kind` of physics (one
    of `screening.flexible_forms.KINDS`), `law`, one `sentence` for the user,
    `looks` (what its trace looks like), `confused_with`, `separated_by` (the experiment that tells
    it from those), `from_one` (by the name of one of them, that which tells it from that one),
    `simpler` (effects it contains as special cases), `source` of the law. `home` is False where the
    effect can sit but seldom does: such a place counts only if it explains more than every home.

    What it does follows from `made` and the attributes after it: the law, run along the history of
    a port with unit strength, is the signature, and the same law is what is inserted. An effect
    that is no law at an element has `signatures` and `insert` of its own.

    Examples
    --------
    >>> from identification.diagnosis.catalogue import CATALOGUE
    >>> (friction,) = [e for e in CATALOGUE if e.name == "coulomb_friction"]
    >>> friction.kind, [e.name for e in friction.places(graph)]
    ('dissipative', ['d'])
    """

    name: ClassVar[str]
    family: ClassVar[str]
    kind: ClassVar[str] = ""
    sort: ClassVar[str] = ""
    """What it is in words, where those of its kind would mislead."""
    law: ClassVar[str]
    sentence: ClassVar[str]
    looks: ClassVar[str] = ""
    confused_with: ClassVar[tuple[str, ...]] = ()
    separated_by: ClassVar[str] = ""
    from_one: ClassVar[Mapping[str, str]] = MappingProxyType({})
    simpler: ClassVar[tuple[str, ...]] = ()
    source: ClassVar[str] = ""
    richer: ClassVar[tuple[str, ...]] = ()
    """Laws that `forms` and `refinements` may give."""
    laws: ClassVar[tuple[type[Law], ...]] = ()
    """Classes of what `made` gives, the usual one first: their words and formulas are shown."""
    meanings: ClassVar[Mapping[str, str]] = {}
    """What the parameters are that belong to no law, as in `Law.meanings`."""
    costly: ClassVar[bool] = False
    """Leaves the exact dynamics: fitted only where the screening puts it among the first."""

    plain: ClassVar[bool] = False
    """A linear element: fitted also where the screening ranks it late, if the model is far off."""

    joins: ClassVar[bool] = False
    """Acts at two places at once: what is known of laws at one place says nothing of it."""

    where: Callable[[BondGraph], tuple[Element, ...]]
    """Finds its places, one of `places.py`; effects with a rule of their own override `places`."""

    made: Callable[..., Law]
    """Makes the law at a `Site`, ``made(at, **shape)``, with what is typical there as its start
    values; called without a shape where none is known."""
    shapes: ClassVar[Mapping[str, Grid]] = over()
    """What `made` takes as a shape (a knee, a time constant), and the values tried, in units of the
    history; where one depends on another, or on the residual, override `grid`."""
    weights: ClassVar[tuple[str, ...]] = ()
    """Parameters in which the law is linear, named without the element: one column each."""
    strengths: ClassVar[tuple[str, ...]] = ()
    """Parameters that make the effect, where these are others than `weights`."""
    at_shape: ClassVar[bool] = True
    """The inserted law is made at the hint's shape; otherwise as without one, and `tried` puts the
    shape into the start values."""
    rebalances: ClassVar[bool] = True
    """A spring or a resistor itself has taken over what of the law resembles it, see
    `starts.rebalanced`; False where the law resembles it in nothing."""

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Elements where the effect makes sense."""
        return self.where(graph)

    def places_in(self, scene: FittedModel) -> tuple[Element, ...]:
        """Return `places` of a fitted model's graph, and those that its statement adds."""
        return self.places(scene.graph)

    def home(self, element: Element) -> bool:
        """Whether `element` is a usual place of this effect."""
        return True

    def site(self, scene: FittedModel, element: Element) -> Site:
        """Return `element` with the history that the law depends on."""
        return Site(scene, element, scene.of(element))

    def grid(self, at: Site) -> Sequence[Values]:
        """Return the shapes to try: every combination of `shapes`, the last changing fastest."""
        tried = product(*(values(at.past) for values in self.shapes.values()))
        return [dict(zip(self.shapes, values, strict=True)) for values in tried]

    def parts(self, law: Law) -> Sequence[Values]:
        """Return the values of the parameters that make each column of a signature."""
        own = self._weights(law)
        return [{n: float(n == m) for n in own} for m in own] or [NOTHING]

    def added(self, at: Site, law: Law, values: Values) -> Array:
        """Return what the law adds along the history with these values, shape (N,)."""
        return at.added(law, values)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Return what a weak effect of this kind adds at `element`, for several shapes.

        An empty tuple exempts the effect from the screening: it is always fitted.
        """
        if not hasattr(self, "made"):
            return ()
        at, found = self.site(scene, element), []
        way = sense(scene.graph, element)
        for shape in self.grid(at):
            law = self.made(at, **shape)
            columns = [way * self.added(at, law, values) for values in self.parts(law)]
            found.append(Signature.of(columns, **shape))
        # an empty tuple would exempt it: where no shape is worth trying, nothing is added
        return tuple(found) or (Signature.of((np.zeros(at.past.n),)),)

    def forms(
        self, scene: FittedModel, element: Element, ended: Mapping[str, Mapping[str, float]]
    ) -> tuple[Insertion, ...]:
        """Return richer laws, tried where this effect explains much at `element`, but not all.

        Each is inserted in the place of the plain law, as a form of this effect or of one that
        contains it. `ended` holds the fitted values of the laws tried there, by effect.
        """
        return ()

    def without_zeros(
        self, scene: FittedModel, made: Insertion, values: Mapping[str, float]
    ) -> Insertion | None:
        """Return a form without those of its many numbers that a fit put to zero, if it has any."""
        return None

    def refinements(
        self, scene: FittedModel, element: Element, ended: Mapping[str, float]
    ) -> tuple[Insertion, ...]:
        """Return richer laws, tried only once this effect is named at `element`.

        They refine the repaired model and are no evidence: kind, name and place are decided.

        Parameters
        ----------
        scene : FittedModel
            The repaired model: `element` holds the law that was fitted.
        ended : mapping of str to float
            Its fitted values.
        """
        return ()

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return the start values to try: those of the law, its weights from the hint.

        One that may not be negative is at least a tenth of what is typical: its weight may have a
        wrong sign.
        """
        own = {n: p for n, p in own_parameters(law).items() if n in self._weights(law)}
        if hint is None:
            return ({n: p.value for n, p in own.items() if p.value},)
        known = zip(own.items(), hint.weights, strict=True)
        return ({n: _possible(p, float(w)) for (n, p), w in known},)

    def holds(self, at: Site) -> Mapping[str, tuple[float, float]]:
        """Return the range of parameters in which the law is what its name says."""
        return {}

    def shape_of(self, hint: Hint) -> Values:
        """Return the shape at which the law is made."""
        return hint.shape

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Rewrite the graph of `scene` with the effect at `element`; start values from `hint`.

        Raises
        ------
        UnusableInput
            If the effect has no law.
        """
        if not hasattr(self, "made"):
            raise UnusableInput(
                f"effect {self.name} has no law: give it made(at, **shape), or an insert of its own"
            )
        at = self.site(scene, element)
        law = self.made(at, **(self.shape_of(hint) if hint and self.at_shape else {}))
        graph, names = self.with_law(scene, element, law)
        free = [n for n, p in own_parameters(law).items() if not p.fixed]
        called = dict(zip(free, names, strict=True))
        starts = []
        for values in self.tried(at, law, hint):
            start = {called.get(n, n.removeprefix(NOWHERE)): float(v) for n, v in values.items()}
            if self.rebalances and values and isinstance(element, C | R):
                share = rebalanced(element, at.past, self.added(at, law, values))
                starts.append({**start, **share})
            starts.append(start)
        strengths = tuple(called[n] for n in self.strengths or self._weights(law))
        within = tuple((called[n], *ends) for n, ends in self.holds(at).items())
        return self.inserted(element, graph, tuple(starts), strengths, within)

    def _weights(self, law: Law) -> list[str]:
        own = own_parameters(law)
        return [n for n in self.weights if n in own]

    def with_law(
        self, scene: FittedModel, element: Element, law: Law
    ) -> tuple[BondGraph, tuple[str, ...]]:
        """Return the graph with a law at an element, and the parameters of the law a fit may move.

        At a source it becomes the law of its drive.
        """
        names = tuple(p.name for p in law.parameters(element.name) if not p.fixed)
        if isinstance(element, Source):
            return scene.graph.with_element(element.name, drive=Drive(law=law)), names
        return scene.graph.with_element(element.name, law=law), names

    def inserted(
        self,
        element: Element,
        graph: BondGraph,
        starts: tuple[Mapping[str, float], ...],
        strengths: tuple[str, ...],
        within: tuple[tuple[str, float, float], ...] = (),
    ) -> Insertion:
        """Label a rewritten graph."""
        return Insertion(
            self.name, self.family, self.law, element.name, graph, starts, strengths,
            self.simpler, self.confused_with, self.sentence, kind_at(self.kind, element), within,
            plain=self.plain,
        )  # fmt: skip


def _possible(parameter: Parameter, weight: float) -> float:
    low, high = parameter.lower, parameter.upper
    if parameter.positive:
        low = max(low or 0.0, 0.1 * parameter.value)
    return float(np.clip(weight, low, high)) if (low, high) != (None, None) else weight


def kind_at(kind: str, element: Element) -> str:
    """Return the kind that an effect's kind means at an element: all that is measured is sensed."""
    if isinstance(element, Sensor) or (isinstance(element, Source) and element.measured):
        return "sensing"
    return "command" if isinstance(element, Source) and kind != "sensing" else kind
