"""Pendulum as a linear one with a viscous pivot, in free swing: no command, free start."""

from __future__ import annotations

from bondgraph import BondGraph, C, Dq, I, One, R
from bondgraph.signals.recording import Recording
from identification.datasets import LoadedRecording
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import boundary_split, noted, thinned

__all__ = ["CASES", "linear_pendulum"]

SWING = 6000
"""Samples of the small swing that are kept: it has stopped after 6 s."""


def linear_pendulum() -> BondGraph:
    """Return ``J theta'' + d theta' + k theta = 0``; reads the angle ``theta`` from hanging.

    Nothing tells the inertia, so it is 1 and torques count per inertia; 60 N m/rad make a period
    of 0.8 s, that of an arm with its mass at 0.16 m.
    """
    with BondGraph("linear_pendulum") as g:
        pivot = One("pivot")
        pivot >> I("J", 1.0, unit="kg*m2", fixed=True)
        pivot >> R("d", 0.1, unit="N*m*s/rad")
        pivot >> C("k", stiffness=60.0, unit="N*m/rad")
        pivot >> Dq("theta", unit="rad")
    return g


def _small(swing: Recording) -> LoadedRecording:
    return _halves(
        thinned(noted(swing.slice(0, SWING), "the first 6 s, in which the pendulum moves"), 2)
    )


def _large(swing: Recording) -> LoadedRecording:
    return _halves(thinned(swing.select({"theta": "theta"}), 4))


def _halves(kept: Recording) -> LoadedRecording:
    rule = "the first half of the swing trains, the second half judges"
    return LoadedRecording(kept, boundary_split(kept, kept.n // 2, rule))


_BEARING = "straight-line envelope: exponential and Coulomb decay fits 30 times better"

CASES = (
    RealCase(
        name="pendulum_small_swing",
        dataset="pendulum",
        parts=("train/small_swing",),
        prepare=_small,
        model=linear_pendulum,
        truth=(
            Truth("coulomb_friction", ("d",), _BEARING),
            Truth("stribeck_friction", ("d",), f"{_BEARING}; contains dry friction"),
            Truth("presliding_friction", ("d", "k"), f"{_BEARING}; ball bearings roll at first"),
        ),
        kinds=("dissipative", "memory"),
        comment="released at 0.066 rad; it stops after about 5 s",
    ),
    RealCase(
        name="pendulum_large_swing",
        dataset="pendulum",
        parts=("test/large_swing",),
        prepare=_large,
        model=linear_pendulum,
        truth=(
            Truth("nonlinear_stiffness", ("k",), "the period grows with amplitude (sine)"),
            Truth("quadratic_drag", ("d",), "drag of the air that grows with amplitude"),
            Truth("coulomb_friction", ("d",), "the envelope needs a Coulomb part"),
        ),
        kinds=("restoring", "dissipative"),
        comment=(
            "released at 1.6 rad, three documented effects at once; the angle is as the authors "
            "smoothed it, their angular velocity is not used"
        ),
    ),
)
