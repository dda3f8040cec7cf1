"""Descend in the true output error of plays followed by dead zones; the error never rises.

Sizes: N samples, n slopes of plays, m slopes of inverse dead zones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from bondgraph.hysteresis.fitting.bank import play_blocks
from bondgraph.hysteresis.fitting.kuhnen_stages import Stages, dead_zone_columns
from bondgraph.hysteresis.fitting.reduction import Reduced, reduce_blocks
from bondgraph.hysteresis.plays.ang import Ang
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.support.descent import Damping, Trial, descend
from bondgraph.support.ops import FloatArray

_HALVINGS = 8
_WORTHWHILE = 1e-6  # relative gain in rms below which the descent stops


@final
@dataclass(frozen=True, slots=True, eq=False)
class ScoredRecord:
    """The scored record with the stages to fit to it."""

    plays: PrandtlIshlinskii
    zones: DeadZones
    x: FloatArray
    y: FloatArray
    memory: list[float]

    def reduced(self) -> Reduced:
        """Reduce the outputs of the single plays and, from the measured y, dead zones."""
        return reduce_blocks(
            np.hstack((matrix, dead_zone_columns(self.zones, self.y[part])))
            for part, matrix in play_blocks(self.plays, self.x, self.memory)
        )

    def output(self, stages: Stages, slopes: FloatArray) -> FloatArray:
        """Return the model's output, shape (N,)."""
        play_weights, zone_weights = stages.weights(slopes, self.plays.n_memory + 1)
        plays = PrandtlIshlinskii(self.plays.thresholds, tuple(play_weights.tolist()))
        zones = DeadZones(self.zones.thresholds, tuple(zone_weights.tolist())).inverse()
        return Ang(plays, zones).run(self.x, self.memory)[0]

    def rms(self, stages: Stages, slopes: FloatArray) -> float:
        """Return the root mean square of the output error."""
        return float(np.sqrt(np.mean((self.output(stages, slopes) - self.y) ** 2)))

    def linearised(self, stages: Stages, slopes: FloatArray) -> FloatArray:
        """Reduce Jacobian and output error at ``slopes``; the error is the last column.

        ``S'[z] = PI[x]`` gives dz = (d PI[x] - dS'[z]) / slope of S' at z.
        """
        z = self.output(stages, slopes)

        def blocks() -> Iterator[FloatArray]:
            for part, matrix in play_blocks(self.plays, self.x, self.memory):
                zones = dead_zone_columns(self.zones, z[part])[:, stages.zones]
                columns = np.hstack((matrix[:, stages.plays], zones))
                columns /= stages.zone_slope(slopes, z[part])[:, None]
                yield np.hstack((columns, (self.y - z)[part, None]))

        return reduce_blocks(blocks()).triangle


@final
@dataclass(frozen=True, slots=True, eq=False)
class KuhnenPoint:
    """Slopes, which of them lie on their bounds, and the rms output error there."""

    slopes: FloatArray
    on_bound: np.ndarray
    cost: float


def lower_error(
    scored: ScoredRecord, stages: Stages, start: KuhnenPoint, max_steps: int
) -> tuple[KuhnenPoint, int]:
    """Lower the output error by bounded Gauss-Newton steps, halved until it falls; count them.

    The output does not change when all slopes are scaled, so the Jacobian times the present
    slopes is 0 and the linearised problem can be written in the new slopes themselves.
    """
    weight = float(np.linalg.norm(scored.y))

    def steps_from(at: KuhnenPoint) -> Trial[KuhnenPoint]:
        triangle = scored.linearised(stages, at.slopes)
        aim, on_bound = stages.solve(triangle[:, :-1], triangle[:, -1], weight)

        def trial(damping: float, number: int) -> KuhnenPoint:
            slopes = at.slopes + 0.5**number * (aim - at.slopes)
            held = on_bound if number == 0 else at.on_bound & on_bound
            return KuhnenPoint(slopes, held, scored.rms(stages, slopes))

        return trial

    made = descend(
        start, steps_from, Damping(most=np.inf, tries=_HALVINGS), max_steps,
        lambda old, new: old.cost - new.cost < _WORTHWHILE * new.cost,
    )  # fmt: skip
    return made.at, made.steps
