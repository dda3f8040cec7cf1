"""What a model predicts of held-out samples one step ahead, where its rates move at random.

A free run wanders off under process noise, and its residual is no noise of the readings. The
innovations of a Kalman filter are, with the intensities that make the readings likeliest; so models
are compared by the density they give to samples that no parameter was fitted to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.estimate import estimate
from identification.statistics.whiteness import whiteness
from identification.study.study import Study

STRETCHES = 40
"""Stretches of the held-out samples whose losses are compared."""
FORESEEN = 0.05
"""Part of the innovations' power that their own past may foretell: that of noise foretells none."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """One-step predictions of one model.

    Attributes
    ----------
    losses : ndarray, shape (stretches,)
        Minus the log density of the held-out readings, SI, summed over each stretch.
    foreseen : float
        The largest part of a reading's innovations, in power, that their own past foretells.
    over_noise : dict of str to float
        Root mean square of the held-out innovations over their standard deviation, by reading.
    levels : str
        Intensities of the process noise, in words.
    """

    losses: Array
    foreseen: float
    over_noise: dict[str, float]
    levels: str

    @property
    def loss(self) -> float:
        """Sum over all stretches."""
        return float(self.losses.sum())

    def behind(self, better: Predicted) -> float:
        """Return the standard errors by which stretches agree that `better` predicts more."""
        lead = self.losses - better.losses
        spread = float(np.std(lead, ddof=1)) if lead.size > 1 else 0.0
        return float(np.mean(lead)) / spread * float(np.sqrt(lead.size)) if spread > 0 else 0.0

    @property
    def is_noise(self) -> bool:
        """Whether what the predictions miss has no memory that is worth a word."""
        return self.foreseen < FORESEEN


def predicted(study: Study) -> Predicted:
    """Fit a study by the likelihood of its one-step predictions, and judge the held-out ones.

    Raises
    ------
    UnusableInput
        The model has what no filter can carry, such as dead times.
    """
    e = estimate(study, method="prediction_error")
    assert e.filtered is not None
    losses: list[float] = []
    squares: dict[str, list[Array]] = {}
    foreseen = [0.0]
    for r, (own, deviation) in enumerate(
        zip(e.filtered.innovation, e.filtered.deviation, strict=True)
    ):
        data = e.problem(r).data
        test = data.mask("test")
        with np.errstate(invalid="ignore", divide="ignore"):
            loss = np.nansum(np.log(deviation) + 0.5 * own**2, axis=1)[test]
        losses += [float(part.sum()) for part in np.array_split(loss, STRETCHES) if part.size]
        for c, name in enumerate(data.names):
            seen = own[test, c][np.isfinite(own[test, c])]
            squares.setdefault(name, []).append(seen**2)
            if seen.size > STRETCHES:
                foreseen.append(whiteness(seen, data.dt).predictable)
    over = {n: float(np.sqrt(np.mean(np.concatenate(s)))) for n, s in squares.items()}
    levels = ", ".join(
        f"{n.name.removeprefix('sigma ')} ({n.value:.3g} {n.unit})"
        for n in e.noises
        if n.name.startswith("sigma ")
    )
    return Predicted(np.array(losses), max(foreseen), over, levels)
