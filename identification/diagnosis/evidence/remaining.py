"""What a model leaves: how much over the noise, in which reading, and whether it is noise."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from bondgraph.support.arrays import Array
from identification.estimation.single_record import Fit
from identification.statistics.growing_noise import GrowingNoise, growing_noise
from identification.study.noise_floor import COLOURED

FOLLOWS = 3.5
"""Standard errors from which a misfit that is larger where more moves is no noise."""
SHORT = 5
"""Samples among which an outlier stands alone; a misfit that lasts as long counts."""
OUT = 4.0
"""Size of an outlier over what surrounds it."""
STRETCHES = 40
"""Stretches in which motion and misfit are compared."""
LEVEL = 1.05
"""Times the noise up to which nobody asks whether it grows with the reading."""
WHITE = 3.0
"""Times a noise read off the spectrum that one without memory has at most, whatever it grows with:
on the average over the record the spectrum shows it."""
LOUDER = 2.0
"""Times that noise of no colour is louder in one part than in another, or than half of the time."""
QUARTILE = 1.4826
WIDTHS = (1, 4, 16, 64, 256)
"""Samples over which a signal is smoothed: it is known with noise, and pushes last."""


@dataclass(frozen=True)
class Remaining:
    """What is left of every reading on held-out samples.

    Attributes
    ----------
    over_noise : dict of str to float
        Root mean square over the noise, by reading; single outliers are no misfit, what lasts is.
    measured : bool
        The noise of every reading was read off itself or is known, not off the top of the spectrum.
    follows : float
        Standard errors by which the misfit is larger where more moves, of readings whose noise is
        not measured, if there are such.
    grows : mapping of str to GrowingNoise
        Readings whose noise grows with them; `over_noise` is over that.
    louder : float
        Where the noise is not measured: times that what is left is louder than on training samples,
        or than half of the time; of the reading where that is most.
    sure : frozenset of str
        Readings whose noise is measured or known, where it is not of every one.
    """

    over_noise: dict[str, float]
    measured: bool
    follows: float
    grows: Mapping[str, GrowingNoise] = field(default_factory=dict)
    louder: float = 1.0
    sure: frozenset[str] = frozenset()

    @property
    def most(self) -> float:
        """The largest of all readings."""
        return self.most_of(self.over_noise)

    def most_of(self, names: Iterable[str]) -> float:
        """Return the largest of some readings."""
        found = (self.over_noise[n] for n in names)
        return max((np.inf if np.isnan(v) else v for v in found), default=0.0)

    def known(self, name: str) -> bool:
        """Whether the noise of a reading is measured or known."""
        return self.measured or name in self.sure

    def is_noise(self, limit: float) -> bool:
        """Whether what is left may be noise: at its level, or coloured where that is not known."""
        if self.most <= limit:
            return True
        held = [n for n in self.over_noise if self.known(n)]
        if self.most_of(held) > limit:
            return False
        rest = self.most_of(n for n in self.over_noise if n not in held)
        return rest < COLOURED and self.louder < LOUDER and self.follows < FOLLOWS

    @property
    def words(self) -> str:
        """One phrase; of the worst reading of either sort, where there are two."""
        held = [n for n in self.over_noise if self.known(n)]
        rest = [n for n in self.over_noise if n not in held]
        parts = [self._said(names) for names in (held, rest) if names or not self.over_noise]
        return f"what is left of {' and of '.join(dict.fromkeys(parts))}"

    def _said(self, names: list[str]) -> str:
        name = max(names, key=lambda n: self.over_noise[n], default="")
        level = "the noise" if self.known(name) else "the noise read off its spectrum"
        level = "its noise, which grows with the reading" if name in self.grows else level
        return f"{name} is {self.most_of(names):.3g} times {level}"


def level_of(fit: Fit, part: str = "test") -> Array:
    """Return what a fit leaves of each reading, rms over the noise, shape (n_y,)."""
    r = fit.residuals(part) / fit.problem.data.floor
    return lasting(r) if r.size else np.zeros(len(fit.problem.data.names))


def remaining(fit: Fit) -> Remaining:
    """Measure what a fit leaves."""
    data, level = fit.problem.data, level_of(fit)
    r = fit.residuals("test") / data.floor
    grows, sure = {}, data.sure
    for c, n in enumerate(data.names):
        # of several recordings those that were fitted may be quieter than those held out
        if not LEVEL < level[c] < (np.inf if sure[c] or data.starts else WHITE):
            continue
        found = growing(fit, n)
        if found is not None:
            grows[n] = found
            level[c] = lasting(fit.residuals("test")[:, [c]] / _sizes(fit, grows, "test")[:, [c]])[
                0
            ]
    over = dict(zip(data.names, map(float, level), strict=True))
    louder = 1.0 if sure.all() or not r.size else _louder(fit, level, grows, ~sure)
    follows = activity(fit, sure if sure.all() else ~sure)
    known = frozenset() if sure.all() else data.floor_known
    return Remaining(over, bool(sure.all()), follows, grows, louder, known)


def _sizes(fit: Fit, grows: Mapping[str, GrowingNoise], part: str) -> Array:
    """Return the noise of every reading at the samples of a part, shape (N, n_y)."""
    data = fit.problem.data
    inside = data.mask(part)
    found = np.tile(data.floor, (int(inside.sum()), 1))
    for name, noise in grows.items():
        c = data.names.index(name)
        found[:, c] = noise.at(fit.simulated[inside, c])
    return found


def _louder(fit: Fit, level: Array, grows: Mapping[str, GrowingNoise], among: Array) -> float:
    trained, tested = (fit.residuals(p) / _sizes(fit, grows, p) for p in ("train", "test"))
    before = np.maximum(lasting(trained), 1.0) if trained.size else np.ones(level.size)
    both = _cut(np.vstack([trained, tested]))
    pushes = [loudness(both[:, c]) for c in np.flatnonzero(among & (level > LEVEL))]
    return max(float(np.max((level / before)[among])), *pushes, 1.0)


def loudness(signal: Array) -> float:
    """Mean power over that of half of the samples: 1 for noise, more for what acts seldom."""
    found = 0.0
    for width in WIDTHS:
        if signal.size < 40 * width:
            break
        smooth = np.convolve(signal, np.full(width, 1.0 / width), mode="valid")
        usual = QUARTILE * float(np.median(np.abs(smooth)))
        found = max(found, float(np.mean(smooth**2)) / max(usual**2, 1e-300))
    return found


def growing(fit: Fit, name: str) -> GrowingNoise | None:
    """Return the noise that grows with a reading, where that is all that a fit leaves of it."""
    data, c = fit.problem.data, fit.problem.data.names.index(name)
    inside = data.mask("train") | data.mask("test")
    y = fit.simulated[inside, c]
    return growing_noise(data.readings[inside, c] - y, y)


def lasting(r: Array) -> Array:
    """Root mean square of residuals (N, n_y), single outliers cut to what surrounds them."""
    return np.asarray(np.sqrt(np.mean(_cut(r) ** 2, axis=0)))


def _cut(r: Array) -> Array:
    from scipy.ndimage import median_filter

    size = np.abs(r)
    typical = np.median(size, axis=0) / 0.6745
    around = median_filter(size, size=(SHORT, 1), mode="nearest")
    limit = OUT * np.maximum(around, typical)
    return np.asarray(np.clip(r, -limit, limit))


def activity(fit: Fit, among: Array) -> float:
    """Return the standard errors by which the misfit of some readings is larger where more moves.

    Noise does not know what the model does; physics left out mostly follows it.
    """
    data = fit.problem.data
    inside = data.mask("train") | data.mask("test")
    r = ((data.readings - fit.simulated)[inside] / data.floor) ** 2
    found = []
    for c in np.flatnonzero(among):
        y = fit.simulated[inside, c]
        few = max(min(STRETCHES, y.size // 5), 1)
        stretches = np.array_split(np.arange(y.size), few)
        misfit = np.array([np.log(np.mean(r[s, c]) + 1e-300) for s in stretches])
        for signal in (y - np.mean(y), np.gradient(y)):
            found.append(_follows(signal, misfit, stretches))
    return max(found, default=0.0)


def _follows(signal: Array, misfit: Array, stretches: list[Array]) -> float:
    from scipy.stats import spearmanr

    motion = np.array([np.mean(signal[s] ** 2) for s in stretches])
    if not np.ptp(motion) > 0:
        return 0.0
    rho = float(spearmanr(motion, misfit).statistic)
    return rho * float(np.sqrt(len(stretches) - 1))
