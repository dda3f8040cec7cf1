"""What a law of the C code is: its kind, its numbers from a strength, its fastest rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from hardware.simulators.generator.scale import PlaceScale

Numbers = Mapping[str, float]
Build = Callable[[float, PlaceScale, Sequence[float]], Numbers]


@dataclass(frozen=True, slots=True)
class CodedLaw:
    """A law of the C code.

    Parameters
    ----------
    kind : int
        Number in the C code.
    build : callable
        ``(strength, scale, draws)`` to named numbers in the order of the C code.
    states : int
        Own states.
    fastest : callable, optional
        ``(numbers, scale)`` to the fastest rate in 1/s that the law brings.
    """

    kind: int
    build: Build
    states: int = 0
    fastest: Callable[[Numbers, PlaceScale], float] = lambda numbers, scale: 0.0


def between(low: float, high: float, draw: float) -> float:
    """Return a number between two, geometrically."""
    return float(low * (high / low) ** draw)


def sign(draw: float) -> float:
    """Return either sign."""
    return 1.0 if draw < 0.5 else -1.0


def bristle(numbers: Numbers, z: PlaceScale) -> float:
    """Return the fastest rate (1/s) of bristles that bend with a stiffness and a damping."""
    return z.f * numbers["stiffness"] / numbers["level"] + numbers["damping"] / z.mass
