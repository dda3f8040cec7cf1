"""A spring that the model does not have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np

from bondgraph.graph.elements import C, Element
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.lacking_element import LackingElement
from identification.diagnosis.catalogue.places import unsprung
from identification.diagnosis.screening.port_history import PortHistory


@final
class LinearSpring(LackingElement):
    """A linear spring on a motion that none holds in the model: force in proportion to the way."""

    name = "linear_spring"
    kind = "restoring"
    law = "parallel_spring"
    sentence = "a spring that the model lacks pulls it back in proportion to the way"
    looks = "a constant force moves it to a place, not ever further; slow motion is too small"
    confused_with = ("added_mode", "creep", "hysteresis", "nonlinear_stiffness")
    separated_by = (
        "push with constant forces of several sizes: it comes to rest, at places in proportion to "
        "them, and comes back"
    )
    source = "Karnopp, Margolis, Rosenberg, System Dynamics, chapter 3 (linear C)"
    meanings: ClassVar[Mapping[str, str]] = {"stiffness": "stiffness of the missing spring"}
    where = staticmethod(unsprung)
    word = "stiffness"
    things: ClassVar[Mapping[str, str]] = {"N": "spring", "N*m": "torsion spring"}
    whichever = "spring"
    does = "pulls it back in proportion to the {displacement}"
    over = 2

    def variable(self, past: PortHistory, element: Element) -> Array:
        """Return the displacement."""
        return past.moved if past.moved is not None else np.zeros(past.n)

    def held(self, name: str, coefficient: str, unit: str) -> C:
        """Return a spring."""
        return C(name, stiffness=coefficient, unit=unit)
