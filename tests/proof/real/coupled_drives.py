"""Coupled electric drives as two inertias on a belt, the speed read with its sign."""

from __future__ import annotations

from bondgraph import TF, BondGraph, C, Df, I, One, R, Se, Zero
from tests.proof.real.case import Published, RealCase, Truth
from tests.proof.real.preparing import at_boundary

__all__ = ["CASES", "linear_belt_drives"]


def linear_belt_drives() -> BondGraph:
    """Return motors, an elastic belt and a pulley: command ``u`` (V), reading the speed ``y``.

    Third order, as in T. Wigren, M. Schoukens, Coupled Electric Drives Data Set and Reference
    Models, Uppsala 2017; speeds are in units of the reading, the motors' inertia is the gauge.
    """
    with BondGraph("linear_belt_drives") as g:
        motors, pulley = One("motors"), One("pulley")
        belt, stretch = Zero("belt"), One("stretch")
        Se("u", unit="V") >> TF("K", ratio=0.05) >> motors
        motors >> I("J_m", 1.0, fixed=True)
        motors >> R("b_m", 7.0)
        motors >> belt >> pulley
        belt >> stretch >> C("k_b", stiffness=60.0)
        stretch >> R("d_b", 0.01)
        pulley >> I("J_p", 0.16)
        pulley >> R("b_p", 0.6)
        pulley >> Df("y", unit="1")
    return g


def _case(level: str, name: str) -> RealCase:
    return RealCase(
        name=f"coupled_drives_{name}",
        dataset="coupled_drives",
        parts=(f"train/{level}", f"test/{level}"),
        prepare=at_boundary(
            f"coupled_drives_{level}",
            "the whole record",
            "the first 400 samples train, the last 100 judge, as in the official split",
        ),
        model=linear_belt_drives,
        truth=(
            Truth(
                "sensor_rectification", ("y",),
                "the report states that pulses are counted without a sign",
            ),
            Truth("sensor_nonlinearity", ("y",), "the same as a general curve of the reading"),
        ),
        kinds=("sensing",),
        published=Published(
            0.074, "ticks/s", "CT-SUBNET, as tabulated for the nonlinear benchmarks",
            "other records: uniform commands, which are not here",
        ),
        comment=f"binary command of +-{level}; 500 samples",
    )  # fmt: skip


CASES = (_case("1V", "1v"), _case("1.5V", "1v5"), _case("0.5V", "0v5"))
