"""Ball and beam as two integrators with viscous rolling."""

from __future__ import annotations

from bondgraph import TF, BondGraph, Dq, I, One, R, Se
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import at_boundary

__all__ = ["CASES", "rolling_ball"]


def rolling_ball() -> BondGraph:
    """Return ``(7/5) m x'' + c x' = W angle``: command ``angle`` (rad), reading ``x`` (m).

    A ball of 1 kg (a gauge) that rolls; its weight W times the angle drives it.
    """
    with BondGraph("rolling_ball") as g:
        weight = g.parameter("W", 9.81, "N", positive=False, scale=5.0)
        ball = One("ball")
        Se("angle", unit="rad") >> TF("slope", ratio=1.0 / weight) >> ball
        ball >> I("m", 1.4, unit="kg", fixed=True)
        ball >> R("c", 0.1, unit="N*s/m")
        ball >> Dq("x", unit="m")
    return g


_ROLLING = "rolling friction of the ball, a standard textbook finding"

CASES = (
    RealCase(
        name="ball_and_beam",
        dataset="ball_and_beam",
        parts=("train/first", "test/last"),
        prepare=at_boundary(
            "ball_and_beam",
            "the whole record",
            "the customary parts: the first 500 samples train, the last 500 judge",
        ),
        model=rolling_ball,
        truth=(
            Truth("coulomb_friction", ("c",), _ROLLING),
            Truth("stribeck_friction", ("c",), _ROLLING),
            Truth("presliding_friction", ("c",), _ROLLING),
            Truth("end_stop", ("c", "m", "x"), "the beam has ends"),
        ),
        kinds=("dissipative", "memory", "restoring"),
        comment="1000 samples at 10 Hz in closed loop around an integrating plant: little to see",
    ),
)
