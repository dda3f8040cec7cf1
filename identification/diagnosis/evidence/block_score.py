"""How well a hypothesis predicts stretches it has not seen, with the noise that it needs itself.

Two hypotheses are compared by what their predictions differ in. Let ``r`` be the residual of the
better one over its own noise and ``d`` the difference of the predictions, all on stretches left
out. The lead in log likelihood is ``sum(d^2 / 2 + r d)``; its first part is no accident, because
the predictions are known; the second varies by the noise (what the better one leaves of samples it
was fitted to), and its variance is taken from the stretches (Diebold and Mariano, J. Bus. Econ.
Stat. 13 (1995) 253), at least that of white noise. Both are whitened before by the pole that the
residual of the better one has: slow noise looks like anything slow.
So an effect that shows in two stretches of forty may still be certain.

Where both leave a misfit of their own, that is no noise, and what whitening takes out is physics:
the loss of whole stretches is compared as well, and the surer of the two counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.evidence.leave_out import (
    Index,
    LeftOut,
    Rows,
    left_out,
    stretch_sums,
)
from identification.estimation.single_record import Fit
from identification.statistics.autoregression import Autoregression, autoregression
from identification.statistics.correlation import autocorrelation

SLOWEST = 0.98
"""Largest pole of a noise: slower ones are drifts, which are no noise."""
WHITE = 0.1
"""Pole below which noise counts as white."""
LEAST = 1e-3
"""Smallest standard deviation over the floor: no model predicts rounding."""
BARELY = 1.0
"""Lead in log likelihood below which nothing is told apart: not worth more than a bare mention
(Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773)."""


@dataclass(frozen=True, eq=False)
class BlockScore:
    """What a hypothesis predicts of stretches that it has not seen.

    Attributes
    ----------
    out : LeftOut
        Its residuals over the floor.
    """

    out: LeftOut

    @cached_property
    def noise(self) -> Array:
        """Standard deviation of each reading's prediction error, over the floor, shape (n_y,)."""
        out, n_y = self.out, self.channels
        square = stretch_sums(out.rows, np.clip(out.residual, -1e150, 1e150) ** 2, n_y).sum(axis=0)
        count = stretch_sums(out.rows, np.ones(out.residual.size), n_y).sum(axis=0)
        return np.asarray(np.sqrt(np.maximum(square / np.maximum(count, 1), LEAST**2)))

    @property
    def square(self) -> float:
        """Mean square of the prediction errors over the floor."""
        return float(np.mean(self.noise**2))

    @property
    def channels(self) -> int:
        """Number of readings."""
        return int(self.out.rows.channel.max(initial=0)) + 1

    @cached_property
    def poles(self) -> Array:
        """Pole of each reading's noise, shape (n_y,)."""
        return _poles(self.out.fitted, self.out.rows, self.channels)

    @cached_property
    def white(self) -> Array:
        """Residual of the fit over the noise, whitened and of unit power, shape (M,)."""
        return self.whitened(self.out.fitted / self.noise[self.out.rows.channel])

    def whitened(self, values: Array) -> Array:
        """Take the pole of this hypothesis' noise out of values (M,)."""
        out, rows = values.copy(), self.out.rows
        for c, pole in enumerate(self.poles):
            if pole > WHITE:
                before, after = _neighbours(rows, c)
                out[after] = (out[after] - pole * values[before]) / np.sqrt(1.0 - pole**2)
        return out

    @cached_property
    def loss(self) -> float:
        """Minus the log predictive density a sample and reading, up to a constant."""
        count = np.bincount(self.out.rows.channel, minlength=self.channels)
        if not self.sound:
            return np.inf
        return float(count @ np.log(self.noise) / max(count.sum(), 1))

    @cached_property
    def sound(self) -> bool:
        """Whether every prediction is a number."""
        return bool(np.isfinite(self.out.residual).all())

    def behind(self, better: BlockScore) -> float:
        """Return the standard errors by which this lags behind `better`; negative if it leads."""
        if not self.sound or not better.sound:
            return 0.0 if self.sound == better.sound else np.inf if better.sound else -np.inf
        if self.loss < better.loss:
            return -better.behind(self)
        # however well stretches agree on it: what differs by nothing is one hypothesis
        if (self.loss - better.loss) * self.out.residual.size < BARELY:
            return 0.0
        return max(self.apart(better), self.paired(better), key=abs)

    def apart(self, better: BlockScore) -> float:
        """Return the standard errors by what the two predictions differ in, beside noise."""
        rows = better.out.rows
        scale = better.noise[rows.channel]
        with np.errstate(over="ignore", invalid="ignore"):
            apart = np.clip((self.out.residual - better.out.residual) / scale, -1e100, 1e100)
        apart = better.whitened(apart)
        r, fitted = better.whitened(better.out.residual / scale), better.white
        power = float(apart @ apart)
        lead = 0.5 * power + float(r @ apart)
        if not power > 0:
            return 0.0
        by_stretch = np.bincount(rows.block, fitted * apart, rows.blocks)
        return lead / float(np.sqrt(max(float(by_stretch @ by_stretch), power)))

    def paired(self, better: BlockScore) -> float:
        """Return the standard errors by which stretches agree that `better` predicts more.

        Whatever the misfits are that both leave; with few stretches in which they differ it stays
        small, however sure the matter is.
        """
        rows = better.out.rows
        size = np.clip(np.stack([self.out.residual, better.out.residual]), -1e100, 1e100)
        worse, best = (size / better.noise[rows.channel]) ** 2
        lead = np.bincount(rows.block, worse - best, rows.blocks)
        spread = float(np.std(lead, ddof=1)) if lead.size > 1 else 0.0
        return float(np.mean(lead)) / spread * float(np.sqrt(lead.size)) if spread > 0 else 0.0

    def beside_colour(self, better: BlockScore) -> float:
        """Return the standard errors of the lag if noise has all the memory that `better` leaves.

        One pole does not whiten noise that is slow at any scale, such as 1/f, and forms with a
        memory follow a part of it; what they leave is as slow. Zero where `better` does not lead.
        """
        if not self.sound or not better.sound:
            return self.behind(better)
        rows = self.out.rows
        worse, best = (better._uncoloured(s.out.residual) for s in (self, better))
        square = np.bincount(rows.channel, best**2, self.channels)
        count = np.bincount(rows.channel, worse != 0.0, self.channels)
        scale = np.sqrt(np.maximum(square / np.maximum(count, 1), LEAST**2))[rows.channel]
        worse, best = worse / scale, best / scale
        lead = np.bincount(rows.block, 0.5 * (worse**2 - best**2), rows.blocks)
        by_stretch = np.bincount(rows.block, best * (worse - best), rows.blocks)
        power = max(float(np.sum((worse - best) ** 2)), float(by_stretch @ by_stretch))
        spread = float(np.var(lead, ddof=1)) * lead.size if lead.size > 1 else 0.0
        variance = min((v for v in (power, spread) if v > 0), default=np.inf)
        return max(float(lead.sum()), 0.0) / float(np.sqrt(variance))

    def _uncoloured(self, values: Array) -> Array:
        """Take the memory of this hypothesis' noise out of values (M,); run-ins become zero."""
        values, out = np.clip(values, -1e150, 1e150), np.zeros(values.size)
        for runs, memory in self._colours:
            whiten = memory.polynomial
            for run in (r for r in runs if r.size >= whiten.size):
                out[run[whiten.size - 1 :]] = np.convolve(values[run], whiten, mode="valid")
        return out

    @property
    def foretold(self) -> float:
        """Largest share of what is left of a reading that its own past foretells."""
        return max((1.0 - memory.innovation for _, memory in self._colours), default=0.0)

    @cached_property
    def _colours(self) -> list[tuple[list[Index], Autoregression]]:
        """Rows of each reading in runs of samples that follow each other, and its memory."""
        rows, found = self.out.rows, []
        for c in range(self.channels):
            at = np.flatnonzero(rows.channel == c)
            runs = np.split(at, np.flatnonzero(np.diff(rows.sample[at]) != 1) + 1)
            lags = round(10 * np.log10(max(at.size, 2)))
            left = [np.clip(self.out.residual[r], -1e150, 1e150) for r in runs]
            # by Akaike: noise that is slow at any scale takes many coefficients
            found.append((runs, autoregression(autocorrelation(left, lags), at.size)))
        return found

    def excess(self, best: BlockScore) -> float:
        """Mean square beyond that of the best hypothesis, in units of its noise."""
        return float(np.mean((self.noise / best.noise) ** 2)) - 1.0


def _poles(residual: Array, rows: Rows, channels: int) -> Array:
    """Lag-one correlation of each reading's residual, 0 .. `SLOWEST`, shape (channels,)."""
    found = np.zeros(channels)
    for c in range(channels):
        before, after = _neighbours(rows, c)
        power = float(residual[before] @ residual[before])
        if before.size > 1 and power > 0:
            found[c] = np.clip(float(residual[after] @ residual[before]) / power, 0.0, SLOWEST)
    return found


def _neighbours(rows: Rows, channel: int) -> tuple[Index, Index]:
    """Rows of a reading whose samples follow each other: held-out samples may lie between two."""
    at = np.flatnonzero(rows.channel == channel)
    near = np.diff(rows.sample[at]) == 1
    return at[:-1][near], at[1:][near]


def score(fit: Fit) -> BlockScore:
    """Score a fit."""
    return BlockScore(left_out(fit))
