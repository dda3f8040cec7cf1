"""Laws that need the linear coefficient of their own storage or resistor."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Positive


@dataclass(frozen=True, kw_only=True)
class SharedSlope(Law, ABC):
    """A law whose first parameter is the own coefficient of its storage or resistor; abstract.

    A gap or a spring that cannot pull takes away exactly what the linear part gives. `coefficient`
    names the parameter that the element has as its value: then both are one number. Without a name
    the law has a stiffness of its own.

    Parameters
    ----------
    coefficient : str
        Name of the element's parameter; "" for an own one.
    stiffness : float
        Start value where the parameter is not the element's.
    inverse : bool
        The parameter is a compliance (a capacity).
    """

    coefficient: str = ""
    stiffness: Positive = 1.0
    inverse: bool = False
    stiffness_unit: str = "N/m"
    shared: ClassVar[tuple[str, ...]] = ("coefficient", "stiffness", "stiffness_unit")

    def slope_parameter(self, element: str) -> Parameter:
        """Return the coefficient as a parameter; where it is the element's, that one counts."""
        value = 1.0 / self.stiffness if self.inverse else self.stiffness
        name = self.coefficient or f"k_own_{element}"
        return Parameter(name, value, self.stiffness_unit, scale=value)

    def own_slope(self, p: Any) -> Any:
        """Stiffness from the first parameter."""
        return 1.0 / p if self.inverse else p
