"""Rack and pinion drive as a mass with viscous friction."""

from __future__ import annotations

from bondgraph import BondGraph, Df, I, One, R, Se
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import at_boundary

__all__ = ["CASES", "mass_on_rack"]


def mass_on_rack() -> BondGraph:
    """Return ``m v' + c v = F``: force ``F`` of a load cell, reading velocity ``v``.

    The textbook model of the set, ``F = m a + c v``, in integral causality.
    """
    with BondGraph("mass_on_rack") as g:
        rack = One("rack")
        Se("F", unit="N", measured=True) >> rack
        rack >> I("m", 20.0, unit="kg")
        rack >> R("c", 60.0, unit="N*s/m")
        rack >> Df("v", unit="m/s")
    return g


_WHY = "dry, viscous and Stribeck friction fitted by the owner of the data"

CASES = (
    RealCase(
        name="rack_and_pinion",
        dataset="rack_and_pinion",
        parts=("train/first", "test/last"),
        prepare=at_boundary(
            "rack_and_pinion",
            "the whole stroke",
            "the first two thirds of the stroke train, the last third judges",
        ),
        model=mass_on_rack,
        truth=(
            Truth("coulomb_friction", ("c",), _WHY),
            Truth("stribeck_friction", ("c",), _WHY),
            Truth("presliding_friction", ("c",), f"{_WHY}; starts from standstill"),
            Truth("position_periodic_force", ("c", "F", "m"), "a ripple with the teeth is seen"),
        ),
        kinds=("dissipative", "memory", "surface", "restoring"),
        comment=(
            "one stroke in one direction: dry friction cannot be told from a constant offset of "
            "the force, so to name nothing is honest here; the held-out part is the braking"
        ),
    ),
)
