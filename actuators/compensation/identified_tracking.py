"""A target for an identified stack: the voltage that makes it, and tables of what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from actuators.compensation.tracking import Tracking
from actuators.stack.identified import IdentifiedStack
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

NANO = 1e9
PRINTED_LOOP = 110e-9
"""Thickest point of the compensated loop of the thesis, less than 4 % of its range (m)."""


@dataclass(frozen=True, slots=True, eq=False)
class Compensation:
    """Voltages (V) for a target (m), both counted from rest behind `history`.

    Attributes
    ----------
    target : ndarray, shape (N,), m
    rate : float
        Hz.
    history : ndarray, V
        What the actuator has to see before, so that its memory is known.
    linear, inverse : ndarray, shape (N,), V
        By the gain of the whole stroke, and by the inverse operator.
    """

    target: FloatArray
    rate: float
    history: FloatArray
    linear: FloatArray
    inverse: FloatArray


def compensation(
    stack: IdentifiedStack, target: FloatArray, rate: float, limits: DriveLimits
) -> Compensation:
    """Return the voltages for a target, behind one whole stroke up and down.

    Raises
    ------
    UnusableInput
        If the target does not begin where the stack rests, or does not move.
    VoltageLimit
        If it leaves what the stack can reach.
    NotInvertible
        If the operator has no inverse.
    """
    stack.operator.inverse()  # refused before anything else
    history = stack.trained
    reach = stack.stroke(history)
    if abs(target[0]) > 1e-3 * reach:
        raise UnusableInput(
            f"target: begins at {1e6 * target[0]:.4g} um; begin at 0, where the stack rests"
        )
    if not np.ptp(target) > 0.0:
        raise UnusableInput(
            f"target: does not move, all {target.size} samples are {1e6 * target[0]:.4g} um; give "
            "one that goes somewhere"
        )
    inverse = stack.voltage(target, rate, history, limits)
    linear = np.clip(target * stack.high / reach, limits.low, limits.high)
    return Compensation(target, rate, history, linear, inverse)


def tracking_table(rows: Mapping[str, Tracking], span: float) -> str:
    """Return errors and loops, in nm and per cent of the target's range, beside the thesis."""
    lines = [f"{'':22s}{'rms nm':>9s}{'%':>8s}{'largest nm':>12s}{'loop nm':>9s}{'%':>8s}"]
    lines += [
        f"{name:22s}{NANO * t.rms:9.2f}{100 * t.relative:8.3f}{NANO * t.largest:12.1f}"
        f"{NANO * t.thickness:9.1f}{100 * t.thickness / span:8.3f}"
        for name, t in rows.items()
    ]
    lines.append(f"{'thesis, section 7.3':22s}{'':29s}{NANO * PRINTED_LOOP:9.1f}{'< 4':>8s}")
    return "\n".join(lines)
