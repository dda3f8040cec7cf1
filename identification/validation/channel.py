"""One reading of one record under every test, on the samples that each test is made for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.statistics.criteria import ResidualLevel
from identification.statistics.whiteness import Whiteness, whiteness
from identification.validation.cross_correlation import CrossCorrelation, cross_correlation
from identification.validation.held_out import Error, error
from identification.validation.timing import SimulationTiming, timing
from identification.validation.validation_data import ValidationData, ValidationRecord


@dataclass(frozen=True, eq=False)
class ChannelJudgement:
    """Tests of one reading.

    Attributes
    ----------
    train, test : Error
    white : Whiteness or None
        Of the training residual, of the held-out one where nothing was trained on (of its
        innovations where the noise has a model); None where too few samples are scored.
    inputs : tuple of CrossCorrelation
        Of the held-out residual (of the training residual where nothing is held out) with each
        input that moves.
    timing : SimulationTiming or None
        Of the same samples.
    part : str
        Where `inputs` and `timing` look: ``test`` or ``train``.
    power : float
        Mean square over the floor of what `white` looks at: the training residual, or its
        innovations where the noise has a model.
    order : int
        Of that noise model; 0 for white noise.
    """

    record: str
    channel: str
    unit: str
    train: Error
    test: Error
    white: Whiteness | None
    inputs: tuple[CrossCorrelation, ...]
    timing: SimulationTiming | None
    part: str
    power: float
    order: int

    @property
    def judged(self) -> Error:
        """Held-out error, or the training error where nothing is held out."""
        return self.test if self.test.n else self.train

    @property
    def level(self) -> ResidualLevel | None:
        """Training residual in units of the floor, for criteria."""
        if not self.train.n or self.white is None:
            return None
        return ResidualLevel(self.power, self.white.n, self.white.memory)


def judge_channel(record: ValidationRecord, column: int, tests: int = 1) -> ChannelJudgement:
    """Put one reading under every test that its samples allow.

    Parameters
    ----------
    tests : int
        Readings judged together: the chance of one false alarm among all is kept at 5 % for
        whiteness, and for following an input.
    """
    name = record.names[column]
    train, test = error(record, column, "train"), error(record, column, "test")
    part = "test" if test.n >= 64 else "train"
    use = record.part(part)
    r, heard = record.residual[:, column], record.innovations(column)
    fitted = record.part("train" if train.n else "test")
    listened = heard[fitted & np.isfinite(heard)]
    power = float(np.mean((listened / record.floor[column]) ** 2)) if listened.size else 0.0
    try:
        white: Whiteness | None = whiteness(
            heard, record.dt, fitted,
            predictor_parameters=record.order(column), level=0.05 / tests,
        )  # fmt: skip
    except UnusableInput:
        white = None
    crossed = []
    level = 0.05 / (2 * tests * max(len(record.inputs), 1))
    for drive, u in record.inputs.items():
        try:
            crossed.append(
                cross_correlation(r, u, record.dt, use, channel=name, name=drive, level=level)
            )
        except UnusableInput:
            continue
    try:
        timed: SimulationTiming | None = timing(
            r, record.simulated[:, column], record.dt, use, channel=name, unit=record.units[column]
        )
    except UnusableInput:
        timed = None
    return ChannelJudgement(
        record.name, name, record.units[column], train, test, white, tuple(crossed), timed, part,
        power, record.order(column),
    )  # fmt: skip


def level_on(record: ValidationRecord, column: int, rows: Array) -> ResidualLevel | None:
    """Return the level of one reading on some samples; None where they are too few.

    Parameters
    ----------
    rows : ndarray of bool, shape (N,)
    """
    heard, order = record.innovations(column), record.order(column)
    try:
        white = whiteness(heard, record.dt, rows, predictor_parameters=order)
    except UnusableInput:
        return None
    power = float(np.mean((heard[rows] / record.floor[column]) ** 2))
    return ResidualLevel(power, white.n, white.memory)


def judge_channels(material: ValidationData) -> tuple[ChannelJudgement, ...]:
    """Every reading of every record."""
    tests = sum(len(r.names) for r in material.records)
    return tuple(judge_channel(r, c, tests) for r in material.records for c in range(len(r.names)))
