"""Which sensors of a plant a model gets."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.support.errors import UnusableInput, require_known

SPREAD = 3.0
"""A drawing or a data sheet knows a value within this factor."""


def wanted(plant: str, known: tuple[str, ...], sensors: Sequence[str] | None) -> tuple[str, ...]:
    """Return the sensors asked for, all `known` ones if none are named.

    Raises
    ------
    UnknownName, UnusableInput
        A sensor that the plant does not have, or none at all.
    """
    if sensors is None:
        return known
    require_known("sensor", plant, known, *sensors)
    if not sensors:
        raise UnusableInput(f"{plant}: name at least one sensor of {', '.join(known)}")
    return tuple(n for n in known if n in sensors)
