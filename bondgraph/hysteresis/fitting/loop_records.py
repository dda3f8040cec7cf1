"""Several records of one actuator with its history, and which of their samples a fit may see.

Sizes: N samples of a record, M scored samples of all, n plays.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.hysteresis.errors import BadInput
from bondgraph.hysteresis.fitting.records import paired_records, require_rising
from bondgraph.hysteresis.operator import Operator
from bondgraph.hysteresis.plays.play import play_record
from bondgraph.hysteresis.turning_points import turning_points
from bondgraph.support.ops import FloatArray


@final
@dataclass(frozen=True, slots=True, eq=False)
class Plays:
    """An input and plays of it, shape (M, 1 + n), and their derivatives by their half widths.

    Attributes
    ----------
    columns : array
        Unit of the input.
    sides : array
        -1 after a rise, 1 after a fall, 0 where the play never moved; 0 for the input.
    """

    columns: FloatArray
    sides: FloatArray


@final
@dataclass(frozen=True, slots=True, eq=False)
class LoopRecords:
    """Inputs and outputs; an output is counted from the first sample of its record.

    Attributes
    ----------
    inputs, outputs : tuple of array
        Shape (N,) each.
    histories : tuple of array
        Inputs before each record, from virgin on; turning points are enough.
    scored : tuple of array of int
        Samples that are fitted, by record.
    """

    inputs: tuple[FloatArray, ...]
    outputs: tuple[FloatArray, ...]
    histories: tuple[FloatArray, ...]
    scored: tuple[NDArray[np.intp], ...]

    @classmethod
    def of(cls, pairs: Iterable[tuple[ArrayLike, ArrayLike]], *, carried: bool = False) -> Self:
        """Return records of which every sample is scored.

        Parameters
        ----------
        pairs : iterable of (array, array)
            Input and output of each record, in the order in which they were taken.
        carried : bool
            The actuator keeps what one record leaves for the next; else each one is virgin.

        Raises
        ------
        BadInput
            If there is none, or a record is constant, not finite, of two lengths or falls where
            the input rises.
        """
        checked = [paired_records(x, y) for x, y in pairs]
        if not checked:
            raise BadInput("no records to fit; give at least one")
        past, histories = np.zeros(0), []
        for x, y in checked:
            require_rising(x, y)
            histories.append(past)
            if carried:
                past = np.concatenate((past, x[turning_points(x)]))
        rows = tuple(np.arange(x.size) for x, _ in checked)
        inputs, outputs = zip(*checked, strict=True)
        return cls(inputs, outputs, tuple(histories), rows)

    @property
    def swing(self) -> float:
        """Largest peak-to-peak input."""
        return max(float(np.ptp(x)) for x in self.inputs)

    @property
    def virgin_reach(self) -> float:
        """How far the input goes from where it was virgin; 0 if no record begins there."""
        fresh = (x for x, past in zip(self.inputs, self.histories, strict=True) if not past.size)
        return max((float(np.abs(x - x[0]).max()) for x in fresh), default=0.0)

    @property
    def size(self) -> int:
        """M."""
        return sum(rows.size for rows in self.scored)

    @property
    def target(self) -> FloatArray:
        """Scored outputs, shape (M,)."""
        return np.concatenate([y[rows] for y, rows in zip(self.outputs, self.scored, strict=True)])

    def plays(self, widths: ArrayLike) -> tuple[Plays, Plays]:
        """Return the plays at every scored sample, and at the first sample of its record.

        Parameters
        ----------
        widths : array
            r > 0, shape (n,), unit of the input.
        """
        r = np.asarray(widths, float)
        now, then = [], []
        for x, history, rows in zip(self.inputs, self.histories, self.scored, strict=True):
            whole = np.concatenate((history, x))
            states = play_record(whole, r, np.clip(0.0, whole[0] - r, whole[0] + r))
            columns = np.column_stack((whole, states))
            sides = np.column_stack((np.zeros(whole.size), _sides(whole, states, r)))
            first = np.full(rows.size, history.size)
            now.append((columns[history.size + rows], sides[history.size + rows]))
            then.append((columns[first], sides[first]))
        return tuple(  # type: ignore[return-value]
            Plays(*(np.concatenate(parts) for parts in zip(*pair, strict=True)))
            for pair in (now, then)
        )

    def misfit(self, operator: Operator) -> float:
        """Return the rms of an operator over the scored samples; NaN if there are none."""
        errors = [np.zeros(0)]
        for x, y, history, rows in zip(
            self.inputs, self.outputs, self.histories, self.scored, strict=True
        ):
            if rows.size:
                found = operator.run(np.concatenate((history, x)))[0][history.size :]
                errors.append((found - found[0] - y)[rows])
        e = np.concatenate(errors)
        return float(np.sqrt(np.mean(e**2))) if e.size else float("nan")

    def split(self, share: float = 2.0 / 3.0) -> tuple[LoopRecords, LoopRecords]:
        """Return what is fitted and what is held out: the last record, or the end of the only one.

        Parameters
        ----------
        share : float
            Of a single record that is fitted.
        """
        last = len(self.inputs) - 1
        cut = int(share * self.inputs[0].size) if last == 0 else 0
        seen = [r if i < last else r[r < cut] for i, r in enumerate(self.scored)]
        rest = [r[r >= cut] if i == last else r[:0] for i, r in enumerate(self.scored)]
        return replace(self, scored=tuple(seen)), replace(self, scored=tuple(rest))

    def delayed(self, samples: float) -> LoopRecords:
        """Return the records with inputs that act later, linear between samples."""
        if samples == 0.0:
            return self
        late = [np.interp(np.arange(x.size) - samples, np.arange(x.size), x) for x in self.inputs]
        return replace(self, inputs=tuple(late))

    def thinned(self, most: int = 6000) -> LoopRecords:
        """Return about `most` scored samples, evenly spread, and what of the input plays need."""
        step = max(1, self.size // most)
        kept, inputs, scored = [], [], []
        for x, rows in zip(self.inputs, self.scored, strict=True):
            # plays see turning points only
            keep = np.unique(np.concatenate(([0], turning_points(x), rows[::step])))
            kept.append(keep)
            inputs.append(x[keep])
            scored.append(np.searchsorted(keep, rows[::step]))
        outputs = tuple(y[keep] for y, keep in zip(self.outputs, kept, strict=True))
        return replace(self, inputs=tuple(inputs), outputs=outputs, scored=tuple(scored))


def _sides(x: FloatArray, plays: FloatArray, r: FloatArray) -> FloatArray:
    """Return on which side of its input each play was dragged last, shape (N, n)."""
    away = x[:, None] - plays
    dragged = np.abs(away) >= r * (1.0 - 1e-9)
    last = np.maximum.accumulate(np.where(dragged, np.arange(x.size)[:, None], -1), axis=0)
    side = np.take_along_axis(-np.sign(away), np.maximum(last, 0), axis=0)
    return np.where(last >= 0, side, 0.0)
