"""Where a law is tried: an element of the fitted model with the history that the law sees."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

from bondgraph.graph.elements import Element
from bondgraph.graph.parameter import Parameter
from bondgraph.laws.along import along
from bondgraph.laws.law import Law
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.starts import rubbing_units
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

Grid: TypeAlias = Callable[[PortHistory], Sequence[float]]
"""Values of one shape parameter that are tried along a history."""
Values: TypeAlias = Mapping[str, float]
"""Numbers by the name of a parameter, without the element after it: ``{"F_c": 0.3}``; those of the
element itself as `of_element` says."""
NOTHING: Values = MappingProxyType({})
NOWHERE = "*"
"""What no element can be called."""


@dataclass(frozen=True, eq=False)
class Site:
    """An element of a fitted model, and what a law there depends on along the record."""

    scene: FittedModel
    element: Element
    past: PortHistory

    @property
    def unit(self) -> str:
        """Unit of the element, "" where it says none."""
        return str(getattr(self.element, "unit", ""))

    @property
    def units(self) -> tuple[str, str, str]:
        """Units of effort, flow and displacement, see `rubbing_units`."""
        return rubbing_units(self.element)

    @property
    def residual(self) -> Array:
        """What the fitted model leaves of the readings of a sensor, shape (N,), SI."""
        return self.scene.residual[:, self.scene.data.names.index(self.element.name)]

    def added(self, law: Law, values: Values = NOTHING) -> Array:
        """Return what a law adds along the history, shape (N,), with some `values` of its own."""
        return along(law, self.past.argument, self.past.dt, numbers(law, values))


def own_parameters(law: Law) -> dict[str, Parameter]:
    """Return the parameters of a law by their names without an element.

    One that the law shares with its element is called as `of_element` says.
    """
    return {_own_name(p): p for p in law.parameters(NOWHERE)}


def numbers(law: Law, values: Values = NOTHING) -> list[float]:
    """Return the parameters of a law in order: `values`, and of the others the start values."""
    return [values.get(_own_name(p), p.value) for p in law.parameters(NOWHERE)]


def of_element(parameter: str) -> str:
    """Return the name of an element's parameter among those of a law, which may be the same."""
    return NOWHERE + parameter


def _own_name(p: Parameter) -> str:
    own = p.name.removesuffix(f"_{NOWHERE}")
    return of_element(own) if own == p.name else own


def over(**grids: Grid) -> Mapping[str, Grid]:
    """Return the shapes of an effect: by name, the values to try."""
    return MappingProxyType(grids)


def times(size: str, *shares: float) -> Grid:
    """Return the shares of a size of the history: ``half``, ``rms``, ``largest``, ``duration``."""
    return lambda past: tuple(share * getattr(past, size) for share in shares)


def within_range(*shares: float) -> Grid:
    """Return places in the range of the argument: -1 is its lower end, 1 its upper one."""
    return lambda past: tuple(past.reach(share) for share in shares)


def plain(*values: float) -> Grid:
    """Return these values along any history."""
    return lambda past: values
