"""Hobby servo as a linear position loop: a spring to the commanded angle."""

from __future__ import annotations

from bondgraph import TF, BondGraph, C, Dq, I, One, R, Se
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import apart

__all__ = ["CASES", "linear_servo"]


def linear_servo() -> BondGraph:
    """Return ``J q'' + k_v q' + k_p q = k_p u``: command angle ``u``, reading angle ``q`` (rad).

    Nothing tells a torque, so the inertia, 0.28 kg at about 0.15 m, is a gauge; start values put
    the loop at 20 rad/s with a damping of 0.75.
    """
    with BondGraph("linear_servo") as g:
        gain = g.parameter("K_p", 2.4, "N*m/rad")
        arm = One("arm")
        Se("u", unit="rad") >> TF("loop", ratio=1.0 / gain) >> arm
        arm >> I("J", 6e-3, unit="kg*m2", fixed=True)
        arm >> R("k_v", 0.18, unit="N*m*s/rad")
        arm >> C("k_p", stiffness=gain, unit="N*m/rad")
        arm >> Dq("q", unit="rad")
    return g


_LATE = "the command is sent, then the angle is read in the same step; timed by software"
_RUBS = "dry friction of the gear, fitted by the owner of the data and seen in the drops"
_FRICTION = tuple(
    Truth(effect, ("k_v",), _RUBS)
    for effect in ("coulomb_friction", "stribeck_friction", "presliding_friction")
)
_DELAY = (
    Truth("delay", ("u", "q"), _LATE),
    Truth("low_pass", ("u",), "the owner of the data fits a filter of the command"),
)
_COMMENT = "rollouts of 2 to 3 s from rest, 50 Hz; every third judges"


def _parts(numbers: range) -> tuple[tuple[str, ...], int]:
    """Names of rollouts, those that judge last, and how many judge."""
    train = tuple(f"train/rollout_{i:02d}" for i in numbers if i % 3)
    test = tuple(f"test/rollout_{i:02d}" for i in numbers if i % 3 == 0)
    return (*train, *test), len(test)


def _case(
    name: str, numbers: range, truth: tuple[Truth, ...], kinds: tuple[str, ...], comment: str
) -> RealCase:
    parts, held = _parts(numbers)
    return RealCase(
        name=f"hobby_servo_{name}",
        dataset="hobby_servo",
        parts=parts,
        prepare=apart(
            f"hobby_servo_{name}", held, f"every third rollout judges: {held} of {len(parts)}"
        ),
        model=linear_servo,
        truth=(*truth, *_FRICTION, *_DELAY),
        kinds=kinds,
        comment=f"{comment}; {_COMMENT}",
    )


_DEAD_BAND = "0.02 rad to each side are lost: a dead band of the controller, play, or dry friction"

CASES = (
    _case(
        "large",
        range(40, 52),
        (
            Truth("slew_limit", ("u",), "4.1 rad/s upwards and 5.7 rad/s downwards, whatever the "
                  "step"),
            Truth("saturation", ("u",), "a limit of 2.7 N m, fitted by the owner of the data"),
            Truth("nonlinear_stiffness", ("k_p",), "the weight of the arm pulls with cos(q)"),
        ),
        ("command", "restoring", "dissipative", "memory", "sensing"),
        "binary commands of +-1.9 and +-1.7 rad: speed limit and gravity dominate",
    ),
    _case(
        "small",
        range(31, 40),
        (
            Truth("dead_zone", ("u",), _DEAD_BAND),
            Truth("backlash", ("k_p",), _DEAD_BAND),
        ),
        ("command", "restoring", "dissipative", "memory", "sensing"),
        "binary commands of +-0.05 to +-0.16 rad: dead band, play and dry friction are look-alikes "
        "here, so a set of them is honest",
    ),
)  # fmt: skip
