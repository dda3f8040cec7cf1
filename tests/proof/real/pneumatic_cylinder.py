"""Pneumatic cylinder as an ideal piston with viscous seals; without states."""

from __future__ import annotations

import numpy as np
from scipy.signal import savgol_filter

from bondgraph import TF, BondGraph, De, One, R, Se, Sf, Zero
from bondgraph.signals.recording import Recording
from identification.datasets import LoadedRecording
from identification.datasets.public_set import changed
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import boundary_split

__all__ = ["CASES", "ideal_piston"]

PARABOLA = 11
"""Samples of the local parabola whose slope is the velocity: 0.11 s."""


def ideal_piston() -> BondGraph:
    """Return ``F = A p + c v``: measured pressure ``p`` and velocity ``v``, reading force ``F``.

    The velocity pushes the rod in, against the pressure, as the recorded position counts.
    """
    with BondGraph("ideal_piston") as g:
        area = g.parameter("A", 5e-4, "m2")
        rod, cell = One("rod"), Zero("cell")
        Se("p", unit="Pa", measured=True) >> TF("piston", ratio=1.0 / area) >> rod
        rod >> R("seal", 50.0, unit="N*s/m")
        rod >> cell
        Sf("v", unit="m/s", measured=True) >> cell
        cell >> De("F", unit="N")
    return g


def _prepared(read: Recording) -> LoadedRecording:
    velocity = savgol_filter(read["x"], PARABOLA, 2, deriv=1, delta=read.dt)
    channels = {"p": read["p"], "v": np.asarray(velocity), "F": read["F"]}
    note = f"v is the slope of a parabola through {PARABOLA} positions"
    made = changed(read, channels, {"p": "Pa", "v": "m/s", "F": "N"}, note)
    rule = "the first two thirds of the strokes train, the last third judges"
    return LoadedRecording(made, boundary_split(made, made.n - made.n // 3, rule))


_WHY = "the force of strokes out and in forms a loop with a break-away peak at each reversal"


def _case(name: str, part: str, seal: str) -> RealCase:
    return RealCase(
        name=f"pneumatic_cylinder_{name}",
        dataset="pneumatic_cylinder",
        parts=(part,),
        prepare=_prepared,
        model=ideal_piston,
        truth=tuple(
            Truth(effect, ("seal",), _WHY)
            for effect in ("coulomb_friction", "stribeck_friction", "presliding_friction")
        ),
        kinds=("dissipative", "memory", "surface"),
        comment=f"{seal}; friction also depends on position, which no term describes",
    )


CASES = (
    _case("1bar", "train/O_ring_1bar", "O-ring at 1 bar"),
    _case("3bar", "train/O_ring_3bar", "O-ring at 3 bar"),
    _case("x_ring", "test/X_ring257_3bar", "X-ring at 3 bar"),
)
