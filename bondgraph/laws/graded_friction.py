"""Dry friction whose level another signal sets: the position, or the load that presses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.directed_friction import DirectedFriction
from bondgraph.laws.watching import WatchingLaw
from bondgraph.support.bounds import NonNegative, Positive, Signal
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class FrictionAlongWay(WatchingLaw, DirectedFriction):
    """``(F_c + F_1 z + F_2 z^2) sign(f)`` with ``z = (x - centre) / half``, never below 0.

    A seal on a bore that is not quite straight, a guide with tight places: Armstrong-Helouvry,
    Dupont and Canudas de Wit, Automatica 30 (1994) 1083, section 2 (position dependence).

    Parameters
    ----------
    beside : str
        Signal of the position ``x``, such as ``q_k``.
    force : float
        Start value of ``F_c``, the level in the middle.
    centre, half : float
        Middle and half range of the position, units of ``x``; fixed.

    Examples
    --------
    >>> law = FrictionAlongWay("q_k", 0.8, half=2e-3)
    >>> [p.name for p in law.parameters("d")]
    ['F_c_d', 'F_1_d', 'F_2_d', 'centre_d', 'half_d']
    """

    beside: Signal
    force: NonNegative = 1.0
    centre: float = 0.0
    half: Positive = 1.0
    unit: str = "N"
    way_unit: str = "m"
    starts: ClassVar[tuple[str, ...]] = ("beside", "force", "centre", "half", "unit", "way_unit")
    name: ClassVar[str] = "coulomb_along_way"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_c": "friction level in the middle of the way",
        "F_1": "change of the level over half of the way",
        "F_2": "rise of the level towards both ends of the way",
        "centre": "middle of the way",
        "half": "half of the way",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``F_c``, ``F_1``, ``F_2``, then the fixed middle and half range."""
        size, unit = self.force or 1.0, self.unit
        return (
            Parameter(f"F_c_{element}", self.force, unit, lower=0.0, scale=size),
            Parameter(f"F_1_{element}", 0.0, unit, positive=False, scale=size),
            Parameter(f"F_2_{element}", 0.0, unit, positive=False, scale=size),
            Parameter(
                f"centre_{element}", self.centre, self.way_unit, positive=False, fixed=True
            ),
            Parameter(f"half_{element}", self.half, self.way_unit, fixed=True),
        )  # fmt: skip

    def levels(self, ops: Ops, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, Any]:
        """Return the level at the position, for both directions."""
        z = (self.seen(memory) - p[3]) / p[4]
        level = ops.maximum(p[0] + p[1] * z + p[2] * z * z, 0.0)
        return level, level


@dataclass(frozen=True)
class FrictionUnderLoad(WatchingLaw, DirectedFriction):
    """``F_c + mu_1 |N|`` forwards and ``F_c + mu_2 |N|`` backwards, ``N`` an effort elsewhere.

    Amontons' friction of a contact that another port presses. A band or a capstan with wrap angle
    ``phi`` helps itself in one direction only: ``mu_1 = exp(mu phi) - 1`` and
    ``mu_2 = 1 - exp(-mu phi)`` of the tension that holds it (Euler 1769; Shigley's Mechanical
    Engineering Design, band-type brakes).

    Parameters
    ----------
    beside : str
        Signal of the load ``N``, such as ``e_k``.
    force : float
        Start value of ``F_c``, the level without a load.
    share : float
        Start value of ``mu_1`` and ``mu_2``.

    Examples
    --------
    >>> law = FrictionUnderLoad("e_k", 0.8, 0.1)
    >>> [p.name for p in law.parameters("d")]
    ['F_c_d', 'mu_1_d', 'mu_2_d']
    """

    beside: Signal
    force: NonNegative = 1.0
    share: Positive = 0.1
    unit: str = "N"
    share_unit: str = "1"
    starts: ClassVar[tuple[str, ...]] = ("beside", "force", "share", "unit", "share_unit")
    name: ClassVar[str] = "coulomb_under_load"
    meanings: ClassVar[Mapping[str, str]] = {
        "F_c": "friction level without load",
        "mu_1": "friction for each unit of the load, forwards",
        "mu_2": "friction for each unit of the load, backwards",
    }

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """``F_c``, ``mu_1`` and ``mu_2``."""
        mu, unit = self.share, self.share_unit
        return (
            Parameter(
                f"F_c_{element}", self.force, self.unit, lower=0.0, scale=self.force or 1.0
            ),
            Parameter(f"mu_1_{element}", mu, unit, lower=0.0, scale=mu),
            Parameter(f"mu_2_{element}", mu, unit, lower=0.0, scale=mu),
        )  # fmt: skip

    def levels(self, ops: Ops, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, Any]:
        """Return the levels under the load."""
        load = ops.absolute(self.seen(memory))
        return p[0] + p[1] * load, p[0] + p[2] * load
