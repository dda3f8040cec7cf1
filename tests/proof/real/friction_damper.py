"""Band-brake friction damper as a spring and a dashpot in series (Maxwell)."""

from __future__ import annotations

from collections.abc import Callable

from bondgraph import BondGraph, C, De, R, Sf, Zero
from bondgraph.signals.recording import Recording
from identification.datasets import LoadedRecording
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import boundary_split

__all__ = ["CASES", "maxwell_damper"]

EDGE = 16
"""Samples at both ends that are edges of the filter of the converted copy."""


def maxwell_damper() -> BondGraph:
    """Return ``v = F' / k + F / c``: measured velocity ``v`` (m/s), reading force ``F`` (N).

    Start values: 10 kN at the largest velocity of 0.08 m/s, and the stiffness of the band.
    """
    with BondGraph("maxwell_damper") as g:
        device = Zero("device")
        Sf("v", unit="m/s", measured=True) >> device
        device >> C("k", stiffness=5e6, unit="N/m")
        device >> R("c", 1.2e5, unit="N*s/m")
        device >> De("F", unit="N")
    return g


def _prepared(
    stop: int | None, boundary: int | None, rule: str
) -> Callable[[Recording], LoadedRecording]:
    def prepared(read: Recording) -> LoadedRecording:
        kept = read.slice(EDGE, read.n - EDGE).slice(0, stop).select({"v": "v", "F": "F"})
        at = kept.n - kept.n // 3 if boundary is None else boundary
        return LoadedRecording(kept, boundary_split(kept, at, rule))

    return prepared


_BAND = "a band brake: a dry slider behind the elastic band fits 2 to 3 times better than linear"
_REST = "the force follows the way since the last reversal, not the velocity"
_PLAY = "the drum turns freely after each reversal: a gap of 1.9 to 2.2 mm to each side"
_SIDES = "the band multiplies its tension differently in the two directions"
_TRUTH = (
    Truth("coulomb_friction", ("c",), _BAND),
    Truth("stribeck_friction", ("c",), f"{_BAND}; stick-slip is documented"),
    Truth("presliding_friction", ("c",), _REST),
    Truth("asymmetric_damping", ("c",), _SIDES),
    Truth("hysteresis", ("k", "v", "F"), _REST),
    Truth("backlash", ("k",), _PLAY),
)


def _case(
    name: str, part: str, prepare: Callable[[Recording], LoadedRecording], comment: str
) -> RealCase:
    return RealCase(
        name=f"friction_damper_{name}",
        dataset="friction_damper",
        parts=(part,),
        prepare=prepare,
        model=maxwell_damper,
        truth=_TRUTH,
        kinds=("dissipative", "memory", "restoring"),
        comment=comment,
    )


_CYCLES = _prepared(None, None, "the first two thirds of the cycles train, the last third judges")
_FRAME = "three effects at once; the ringing after each break-away is the test frame"

CASES = (
    _case("70lb", "train/harmonic_0p5Hz_1in_70lb", _CYCLES, f"0.5 Hz, 25 mm, 70 lb; {_FRAME}"),
    _case("36lb", "train/harmonic_0p25Hz_1p5in_36lb", _CYCLES, f"0.25 Hz, 38 mm, 36 lb; {_FRAME}"),
    _case(
        "earthquake",
        "test/earthquake_imperial_valley_DBE",
        _prepared(3072, 1536, "of the first 12 s, 6 s with the strong shock train, 6 s judge"),
        "Imperial Valley, design level; the published errors (a LuGre law trained on harmonic "
        "records) rest on a displacement that is probably half too large: not comparable",
    ),
)
