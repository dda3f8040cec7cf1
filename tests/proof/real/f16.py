"""F-16, payload joint at the lowest level, as two masses on springs: a control."""

from __future__ import annotations

from bondgraph import BondGraph, C, Da, I, One, R, Se, Zero
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import at_boundary

__all__ = ["CASES", "wing_with_payload"]

PERIOD = 8192


def wing_with_payload() -> BondGraph:
    """Return wing and payload joined by a spring: measured ``F`` (N), readings ``a2``, ``a3``.

    Two modes: the wing on the aircraft, the payload on the wing. Start values put them at 7
    and 12 Hz.
    """
    with BondGraph("wing_with_payload") as g:
        wing, payload, mount, joint = One("wing"), One("payload"), Zero("mount"), One("joint")
        Se("F", unit="N", measured=True) >> wing
        wing >> I("wing_mass", 100.0, unit="kg")
        wing >> C("k_w", stiffness=2e5, unit="N/m")
        wing >> R("d_w", 100.0, unit="N*s/m")
        wing >> mount >> payload
        mount >> joint
        joint >> C("k_j", stiffness=3e5, unit="N/m")
        joint >> R("d_j", 50.0, unit="N*s/m")
        payload >> I("payload_mass", 50.0, unit="kg")
        wing >> Da("a2", unit="m/s2")
        payload >> Da("a3", unit="m/s2")
    return g


_JOINT = ("k_j", "d_j")
_WHY = "friction and clearance in the mounting of the payload, weak at this level"

CASES = (
    RealCase(
        name="f16_level1",
        dataset="f16",
        parts=("train/periods_2_to_5", "test/periods_6_to_9"),
        prepare=at_boundary(
            "f16",
            "the fifth and the sixth of nine periods",
            "the fifth period trains, the sixth judges: the same excitation, other noise",
            before=PERIOD,
            after=PERIOD,
            channels=("F", "a2", "a3"),
        ),
        model=wing_with_payload,
        truth=(
            Truth(
                "added_mode",
                ("k_w", "d_w", "k_j", "d_j", "wing_mass", "payload_mass", "F", "a2", "a3"),
                "the aircraft has more modes between 2 and 15 Hz than the model",
            ),
            *(
                Truth(effect, _JOINT, _WHY)
                for effect in ("coulomb_friction", "presliding_friction", "backlash")
            ),
        ),
        kinds=("mode", "dissipative", "memory", "restoring"),
        control=True,
        comment=(
            "nearly linear, but two modes are fewer than the aircraft has: unknown physics or an "
            "added mode is right, and so is nothing; a named nonlinearity away from the joint is "
            "not. The held-out period repeats the excitation"
        ),
    ),
)
