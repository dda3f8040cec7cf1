"""CubeSpec fine steering mirror: modes with hysteretic actuators, against linear models.

All three levels are fitted together; the judges are the test realisations, in steady state. No fit
sees them, but their errors were watched while the terms and the scale of the drive level were
chosen, so they are not a blind test of the structure. Beside each error stands the one of a linear
model with the same modes that was fitted to that level alone, which a hysteretic model must beat,
and the noise between periods.

What the data ask for, all levels together: plays of the voltages; a signed square of their rate,
which takes off part of the plays' loss at high frequency; weak plays of the actuators' own motion;
and stiffness and damping, of modes and between them, that follow the drive level without the loss
that plays would bring, a slow state that settled records show only level by level. Damping and
stiffness between modes are free in sign by default, which fits the phases of the mode shapes but
need not be passive; then the bond graph refuses the values. With ``Sizes(reach=0,
dampers=10)`` only the modes' own values follow the drive level; passive values simulate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.datasets.public_set import Protocol
from tests.proof.published.mirror_fit import fitted
from tests.proof.published.mirror_layout import OMEGA, Layout
from tests.proof.published.mirror_lines import (
    MICRO,
    OUTPUTS,
    FloatArray,
    Lines,
    Spectra,
    spectra,
    total_rms,
)
from tests.proof.published.mirror_model import MirrorModel
from tests.proof.published.mirror_start import add_mode, first_modes, response
from tests.proof.published.mirror_terms import Terms
from tests.proof.published.outcome import Outcome, Reached, split_hash
from tests.proof.published.staging import Progress, channels

RATE, PERIOD, LAST = 6400.0, 8192, 3839
LINEAR = (
    "log_omega", "log_zeta", "psi", "phi", "static", "late_in", "late_out", "coupling", "dampers",
)  # fmt: skip
SETTLED = 5e-4
"""Relative decrease of the cost in a step that ends every fit that is judged."""

SPREAD = 0.7
"""Modal stiffness may first differ from the median by this logarithm: it only scales a mode."""


@dataclass(frozen=True)
class Sizes:
    """How rich the model is and how long it is fitted.

    Parameters
    ----------
    poles : int
        Pairs of poles of the first rational fit.
    added : int
        Modes added where most is left of the response. One of y2 at 1384 Hz, which every model
        needs, comes fifth.
    reach : int
        Modes up to this many places apart in frequency have mutual damping and stiffness of
        either sign.
    dampers : int
        Passive dampers between modes; a model with these and no reach is a bond graph.
    linear, few, all : int
        Iterations: of each linear fit, on one realisation a level, on all realisations.
    """

    poles: int = 14
    added: int = 6
    reach: int = 8
    dampers: int = 0
    linear: int = 40
    few: int = 10
    all: int = 24


@dataclass(frozen=True, eq=False)
class Comparison:
    """The hysteretic model beside linear ones; errors in metres, by level, shape (3,).

    Attributes
    ----------
    model : MirrorModel
    p : ndarray
        Parameters of the hysteretic model.
    hysteretic, linear, linear_all, noise, signal : dict of str to ndarray, shape (3,)
        Root mean squares on the test realisations: of the hysteretic model, of the linear one
        fitted to this level, of the linear one fitted to all levels; of the noise of the averaged
        periods and of the readings.
    """

    model: MirrorModel
    p: FloatArray
    hysteretic: Mapping[str, FloatArray]
    linear: Mapping[str, FloatArray]
    linear_all: Mapping[str, FloatArray]
    noise: Mapping[str, FloatArray]
    signal: Mapping[str, FloatArray]

    def lines(self) -> list[str]:
        """Return a table: level and channel by row, errors in nm and in per cent of the reading."""
        head = f"{'level':8s}{'':4s}{'linear, all':>18s}{'linear, level':>18s}"
        made = [f"{head}{'hysteretic':>18s}{'noise':>14s}"]
        for level in self.hysteretic:
            for o, name in enumerate(OUTPUTS):
                size = self.signal[level][o]
                row = f"{level:8s}{name:4s}"
                for errors in (self.linear_all, self.linear, self.hysteretic):
                    e = errors[level][o]
                    row += f"{1e9 * e:9.1f} nm {100 * e / size:4.2f}%"
                made.append(f"{row}{1e9 * self.noise[level][o]:8.1f} nm")
        return made


def errors_of(model: MirrorModel, p: FloatArray, data: Spectra) -> FloatArray:
    """Root mean square error of the settled response, shape (3,), m."""
    return total_rms(data.y - model.settled(p, data).y) / MICRO


def linear_modes(
    data: Sequence[Spectra], lines: Lines, sizes: Sizes, terms: Terms
) -> tuple[MirrorModel, FloatArray]:
    """Return a linear model of one level: modes with real shapes and dampers between them."""
    reference = float(np.mean([e.level for e in data]))
    layout, p = first_modes(data, lines, sizes.poles, terms.count)
    for extra in range(sizes.added + 1):
        model = MirrorModel(layout, terms, lines, reference)
        p = fitted(model, p, data, layout.places(*LINEAR), iterations=sizes.linear).p
        if extra < sizes.added:
            late = np.exp(lines.s * layout.split(p).late_in.mean())
            rest = [replace(e, y=e.y - model.settled(p, e).y) for e in data]
            weight = np.mean([e.weight for e in data], 0)
            layout, p = add_mode(layout, p, response(rest) * late[:, None, None], weight, lines)
    order, n = np.argsort(p[layout.at["log_omega"]]), layout.modes
    for name in ("log_omega", "log_zeta", "psi", "phi", "log_stiffness"):
        p[layout.at[name]] = p[layout.at[name][order]]
    size = p[layout.at["log_stiffness"]]
    middle = np.median(size)
    p[layout.at["log_stiffness"]] = np.clip(size, middle - SPREAD, middle + SPREAD)
    pairs = tuple((i, j) for i in range(n) for j in range(i + 1, min(n, i + sizes.reach + 1)))
    wider = Layout(n, pairs, terms.count, sizes.dampers)
    p = layout.moved(p, wider)
    if sizes.dampers:
        a = wider.split(p)
        own = 2.0 * a.zeta * a.stiffness * OMEGA / a.omega
        shares = np.random.default_rng(0).standard_normal((n, sizes.dampers))
        p[wider.at["dampers"]] = 0.4 * np.sqrt(own / sizes.dampers)[:, None] * shares
        p[wider.at["log_zeta"]] += np.log(0.8)
    model = MirrorModel(wider, terms, lines, reference)
    free = wider.places(*LINEAR)
    return model, fitted(model, p, data, free, iterations=sizes.linear, damping=1e-2).p


def with_memory(
    model: MirrorModel, p: FloatArray, data: Sequence[Spectra]
) -> tuple[MirrorModel, FloatArray]:
    """Return the model with thresholds that suit its motion, and small weights to start from."""
    motion = float(np.mean([total_rms(model.settled(p, e).x) for e in data]))
    terms = Terms(of_motion=tuple(motion * r for r in (0.4, 1.0, 2.0)), motion=motion)
    layout, q = model.layout, p.copy()
    n = terms.voltage_count
    q[layout.at["memory"][:, : len(terms.of_voltage)]] = 0.01
    q[layout.at["memory"][:, n:-2]] = 0.002
    q[layout.at["softening"][:, 0]] = 0.01
    return MirrorModel(layout, terms, model.lines, model.reference), q


def compare(
    train: Mapping[str, Sequence[Recording]],
    tests: Mapping[str, Recording],
    sizes: Sizes | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Fit linear and hysteretic models to the training realisations and judge them on the tests.

    Parameters
    ----------
    train : mapping of str to sequence of Recording
        Realisations by level, rising; the middle level gives the first linear model.
    tests : mapping of str to Recording
        One by level.

    Raises
    ------
    UnusableInput
        If the levels of both differ.
    """
    if list(train) != list(tests):
        raise UnusableInput(
            f"steering mirror: training levels {list(train)} are not the test levels "
            f"{list(tests)}; give both at the same levels, in the same order"
        )
    sizes = Sizes() if sizes is None else sizes
    tell: Callable[[str, float], None] = progress or (lambda text, fraction: None)
    lines = Lines(PERIOD, RATE, 1, LAST)
    data = {k: [spectra(r, lines) for r in v] for k, v in train.items()}
    everything = [e for v in data.values() for e in v]
    levels = list(data)
    middle = data[levels[len(levels) // 2]]
    tell("linear model of the middle level", 0.0)
    linear, start = linear_modes(middle, lines, sizes, Terms())
    free = linear.layout.places(*LINEAR, "log_stiffness")
    judged = {k: spectra(r, lines) for k, r in tests.items()}
    alone = {}
    for k, v in data.items():
        tell(f"linear model of {k}", 0.1)
        p = fitted(linear, start, v, free, iterations=sizes.linear, stop=SETTLED).p
        alone[k] = errors_of(linear, p, judged[k])
    tell("linear model of all levels", 0.2)
    p = fitted(linear, start, everything, free, iterations=sizes.linear, stop=SETTLED).p
    together = {k: errors_of(linear, p, e) for k, e in judged.items()}
    tell("hysteretic model, one realisation a level", 0.3)
    model, p = with_memory(linear, start, middle)
    whole = np.arange(model.layout.size)
    # the realisation with the least noise of each level
    few = [min(v, key=lambda e: float(e.noise.sum())) for v in data.values()]
    p = fitted(model, p, few, whole, iterations=sizes.few, damping=1e-2).p
    tell("hysteretic model, all realisations", 0.5)
    model = replace(model, lines=replace(lines, oversampling=4))
    p = fitted(model, p, everything, whole, iterations=sizes.all, stop=SETTLED).p
    model = replace(model, lines=replace(lines, oversampling=8))
    tell("judging", 1.0)
    return Comparison(
        model, p, {k: errors_of(model, p, e) for k, e in judged.items()}, alone, together,
        {k: np.sqrt(2.0 * e.noise.sum(1)) / MICRO for k, e in judged.items()},
        {k: total_rms(e.y) / MICRO for k, e in judged.items()},
    )  # fmt: skip


def by_level(recordings: Sequence[Recording]) -> dict[str, list[Recording]]:
    """Return recordings by the level in their remarks, in the order met."""
    found: dict[str, list[Recording]] = {}
    for r in recordings:
        found.setdefault(str(r.meta["level"]), []).append(r)
    return found


def run(parts: Protocol, share: float, progress: Progress | None) -> Outcome:
    """Run the protocol; `share` below 1: fewer iterations, and realisations of outer levels."""
    train = by_level(parts.train)
    middle = list(train)[len(train) // 2]  # three commands need three realisations there
    for k in train:
        if k != middle:
            train[k] = train[k][: max(1, round(share * len(train[k])))]
    tests = {k: v[0] for k, v in by_level(list(parts.tests.values())).items()}
    full = Sizes()
    sizes = full if share == 1.0 else replace(full, few=max(1, round(share * full.few)), all=1)
    made = compare(train, tests, sizes, progress)
    errors = tuple(
        Reached(f"{k} {n}", float(e[o]), "m", float(made.linear[k][o]))
        for k, e in made.hysteretic.items()
        for o, n in enumerate(OUTPUTS)
    )
    used = [("train", channels(r)) for v in train.values() for r in v]
    used += [("test", channels(r)) for r in tests.values()]
    return Outcome(
        "steering_mirror", parts.about.title, bool(parts.official) and share == 1.0,
        "train: all levels together; test: one settled period of another realisation at each "
        "level. Targets are the errors of a linear model of the same modes, fitted to that level",
        split_hash(*used), 0, errors, notes=tuple(made.lines()),
    )  # fmt: skip
