"""Magnetorheological damper as a viscous one; without states."""

from __future__ import annotations

from bondgraph import BondGraph, De, R, Sf, Zero
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import at_boundary

__all__ = ["CASES", "viscous_damper"]


def viscous_damper() -> BondGraph:
    """Return ``F = -c v``: measured velocity ``v``, reading force ``F``.

    The recorded force counts against the velocity, so the half arrow of the source points out.
    """
    with BondGraph("viscous_damper") as g:
        damper = Zero("damper")
        damper >> Sf("v", unit="m/s", measured=True)
        damper >> R("c", 1e3, unit="N*s/m")
        damper >> De("F", unit="N")
    return g


_WHY = "yield force and hysteresis between force and velocity (Spencer and Bouc-Wen models)"

CASES = (
    RealCase(
        name="mr_damper",
        dataset="mr_damper",
        parts=("train/first", "test/last"),
        prepare=at_boundary(
            "mr_damper",
            "both customary parts, as recorded",
            "the customary parts: the first 2000 samples train, the rest judges",
        ),
        model=viscous_damper,
        truth=(
            Truth("presliding_friction", ("c",), _WHY),
            Truth("coulomb_friction", ("c",), _WHY),
            Truth("hysteresis", ("c",), _WHY),
        ),
        kinds=("dissipative", "memory"),
        comment=(
            "the model has no store, so a yield force that builds up over a displacement is "
            "friction with presliding here; a static law of the velocity leaves half of the error"
        ),
    ),
)
