"""All real recordings of the proof by name; fixed before the first diagnosis of the unseen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from bondgraph.support.errors import unknown_name
from tests.proof.real import (
    ball_and_beam,
    bouc_wen,
    coupled_drives,
    dc_motor,
    f16,
    flexible_arm,
    friction_damper,
    heaters,
    hobby_servo,
    mr_damper,
    pendulum,
    piezo_beam,
    pneumatic_cylinder,
    pnzt,
    rack_and_pinion,
    seen_before,
    steering_mirror,
    wiener_hammerstein,
)
from tests.proof.real.case import RealCase

__all__ = ["REAL_CASES", "chosen_cases"]

REAL_CASES: Mapping[str, RealCase] = MappingProxyType(
    {
        c.name: c
        for module in (
            steering_mirror, pnzt, mr_damper, pendulum, rack_and_pinion, pneumatic_cylinder,
            coupled_drives, wiener_hammerstein, f16, flexible_arm, ball_and_beam, friction_damper,
            dc_motor, heaters, hobby_servo, piezo_beam, bouc_wen, seen_before,
        )
        for c in module.CASES
    }
)  # fmt: skip
"""Every case by name."""


def chosen_cases(only: Sequence[str] = ()) -> tuple[RealCase, ...]:
    """Return all cases, or those named.

    Raises
    ------
    UnknownName
        There is no such case.

    Examples
    --------
    >>> [c.label for c in chosen_cases(("mr_damper",))]
    ['unseen']
    """
    for name in only:
        if name not in REAL_CASES:
            raise unknown_name("real case", name, "bondsight real", REAL_CASES)
    return tuple(c for n, c in REAL_CASES.items() if not only or n in only)
