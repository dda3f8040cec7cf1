"""Delays of all readings that agree: one lag of what drives them would give as well."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from identification.estimation.leaning import Leaning
from identification.report.numbers import quantity
from identification.report.words import listed

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis

DELAY = "delay "
"""How the names of such nuisances begin."""
LEAST = 2
"""Readings that are late alike by chance no more."""
WORTH = 1.0
"""Times its noise that a delay moves some reading, from which a sentence is worth its place."""
ALIKE = 0.05
"""Part by which delays may differ beyond their intervals: none is a lag of first order exactly."""


@dataclass(frozen=True, slots=True)
class CommonLag:
    """One lag before all readings, in the place of a delay behind each.

    Attributes
    ----------
    delays, commands : tuple of str
    seconds : float
        The mean of the delays; negative where the readings come early.
    dt : float
        Time between samples, s.
    """

    delays: tuple[str, ...]
    commands: tuple[str, ...]
    seconds: float
    dt: float

    @property
    def claim(self) -> str:
        """For the answer."""
        size, of = quantity(abs(self.seconds), "s"), listed(self.commands)
        if self.seconds < 0:
            return (
                f"all readings come {size} before the model's, which is what a clock or another "
                f"course of {of} between samples would do"
            )
        return (
            f"all readings are late by the same {size}, which is what a dead time or a quick low "
            f"pass of {of} would do"
        )

    @property
    def advice(self) -> str:
        """What tells them apart."""
        return (
            f"{self.claim}: a dead time, a low pass and a clock look the same where "
            f"{quantity(self.dt, 's')} lie between samples; record several times as fast, with "
            f"steps of {listed(self.commands)}"
        )


def lag_of_all(d: Diagnosis) -> CommonLag | None:
    """Return the one lag that the last fit's delays stand for, if they do."""
    last = d.repaired or d.nominal
    if last is None:
        return None
    data = last.problem.data
    return common_lag(d.leanings, data.names, tuple(data.commands), data.dt)


def common_lag(
    leaning: Sequence[Leaning], readings: Collection[str], commands: Sequence[str], dt: float
) -> CommonLag | None:
    """Return the one lag that stands for the delays that a fit leans on, if one does.

    None where a reading is not late, fewer than two are, or they are not late alike.
    """
    found = [n for n in leaning if n.estimate.name.startswith(DELAY)]
    late = {n.estimate.name.removeprefix(DELAY) for n in found}
    if len(found) < LEAST or late != set(readings) or not commands:
        return None
    if max(n.over_noise for n in found) < WORTH:
        return None
    values = [n.estimate.value for n in found]
    middle = sum(values) / len(values)
    for n in found:
        low, high = n.estimate.ci95
        if abs(n.estimate.value - middle) > 0.5 * (high - low) + ALIKE * abs(middle):
            return None
    return CommonLag(tuple(n.estimate.name for n in found), tuple(commands), middle, dt)
