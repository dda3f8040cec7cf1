"""Flexible robot arm as a rigid inertia that an accelerometer rides on."""

from __future__ import annotations

from bondgraph import TF, BondGraph, Da, I, One, R, Se
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import at_boundary

__all__ = ["CASES", "rigid_arm"]


def rigid_arm() -> BondGraph:
    """Return ``J w' + d w = -u``, reading ``y = w'``: command ``u`` is the reaction torque.

    Neither units nor the time of a sample are given: a sample is a second here, J about a unit.
    The torque is what the ground feels, so it turns the arm the other way.
    """
    with BondGraph("rigid_arm") as g:
        turned = g.parameter("n", -1.0, positive=False, scale=1.0, fixed=True)
        arm = One("arm")
        Se("u") >> TF("ground", ratio=turned) >> arm
        arm >> I("J", 1.0)
        arm >> R("d", 0.01)
        arm >> Da("y")
    return g


CASES = (
    RealCase(
        name="flexible_arm",
        dataset="flexible_arm",
        parts=("train/first", "test/last"),
        prepare=at_boundary(
            "flexible_arm",
            "the whole record",
            "two thirds of the periodic sweep train, the last third judges",
        ),
        model=rigid_arm,
        truth=(
            Truth(
                "added_mode", ("J", "arm", "d", "u", "y", "ground"),
                "a flexible arm has lightly damped modes, a rigid one has none; one command and "
                "one reading of an arm of one mass do not tell where they hang",
            ),
        ),
        kinds=("mode",),
        comment="one period of a sweep, 1024 samples; units and the time of a sample are unknown",
    ),
)  # fmt: skip
