"""The steady loop and the error of an operator on the inputs of chapter 6.

A rate-independent operator answers a sine and a triangle with the same loop; only the time spent
on its parts differs, and with it the rms error.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from actuators.stack.loop_width import loop_of
from bondgraph.hysteresis import Operator
from bondgraph.support.arrays import FloatArray

SAMPLES = 4000
"""Samples a period; the turning points of both inputs are samples."""

PERIODS = 3
"""The first two wipe out the virgin curve; what is measured is the third."""

HIGH = 100.0


@final
@dataclass(frozen=True, slots=True)
class SteadyLoop:
    """Lowest and highest displacement and thickness of a loop, m."""

    bottom: float
    top: float
    thickness: float

    @property
    def ratio(self) -> float:
        """Thickness over top, as the thesis counts."""
        return self.thickness / self.top


@final
@dataclass(frozen=True, slots=True)
class Misfit:
    """Largest and root mean square difference over the third period, m."""

    maximum: float
    rms: float


def sine() -> FloatArray:
    """Return three periods from 0 V to 100 V and back, shape (12001,), V."""
    turns = np.arange(PERIODS * SAMPLES + 1) / SAMPLES
    return np.asarray(0.5 * HIGH * (1.0 - np.cos(2.0 * np.pi * turns)))


def triangle() -> FloatArray:
    """Return three periods from 0 V to 100 V and back along straight lines, V."""
    turns = np.arange(PERIODS * SAMPLES + 1) / SAMPLES
    return np.asarray(HIGH * (1.0 - np.abs(1.0 - 2.0 * (turns % 1.0))))


def _third(y: FloatArray) -> FloatArray:
    return y[(PERIODS - 1) * SAMPLES :]


def steady_loop(operator: Operator) -> SteadyLoop:
    """Return the loop of an operator, V to m, in the third period from the virgin state.

    Examples
    --------
    >>> from bondgraph.hysteresis import AlJanaideh
    >>> round(1e9 * steady_loop(AlJanaideh.stack_2hz()).thickness)
    790
    """
    u = sine()
    x = _third(operator.run(u)[0])
    return SteadyLoop(float(x.min()), float(x.max()), loop_of(_third(u), x).thickness)


def misfit(
    operator: Operator, reference: Operator, u: FloatArray, *, offset_removed: bool = False
) -> Misfit:
    """Return the difference of two operators, V to m, over the third period of `u`.

    Parameters
    ----------
    u : array, shape (N,)
        From `sine` or `triangle`, V.
    offset_removed : bool
        Compare up to a constant: an interferometer counts from where it was reset.
    """
    difference = _third(operator.run(u)[0] - reference.run(u)[0])[1:]
    if offset_removed:
        difference = difference - difference.mean()
    return Misfit(float(np.abs(difference).max()), float(np.sqrt(np.mean(difference**2))))
