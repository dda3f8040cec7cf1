"""Which of several inputs determines chosen parameters best, for any model, memory included.

The Fisher information of a record is ``J' J`` of its exact sensitivities over the noise. The free
initial state and offsets of each record are eliminated from it, then the parameters that are
unknown but do not count (Ds-optimality). Information of separate records adds, so the best shares
of measuring time are a convex problem with a certificate, even though the model is not linear.
Everything is local: at the nominal values, or averaged over samples of a prior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bondgraph.simulation.dynamics import Dynamics, Model, dynamics_of
from bondgraph.simulation.exact_run import KernelRun, relative_change
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, require_known
from identification.experiments.design.expected import (
    ExpectedTable,
    beside_seen,
    prior_samples,
    standard_deviations,
    table,
    wanted,
)
from identification.experiments.design.multisine import multisine
from identification.experiments.design.signal import Signal
from identification.experiments.design.weights import CRITERIA, Weights, optimal_weights


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """Candidate inputs, best first.

    Parameters
    ----------
    signals : tuple of Signal
    score : tuple of float
        D: information ``det^(1/s)`` relative to the reference; A: the reference's mean relative
        variance over theirs. So many times longer the reference would have to measure.
    expected : ExpectedTable
        95 % intervals with the best input, beside the reference.
    time_shares : Weights or None
        Best shares of measuring time over the candidates, in the order of `signals`; None if no
        mixture determines the parameters.
    criterion : str
    chosen : tuple of str
    deviations : ndarray, shape (len(signals), len(chosen))
        Expected standard deviations of every candidate at the nominal values, SI.
    """

    signals: tuple[Signal, ...]
    score: tuple[float, ...]
    expected: ExpectedTable
    time_shares: Weights | None
    criterion: str
    chosen: tuple[str, ...]
    deviations: FloatArray

    @property
    def best(self) -> Signal:
        """The first of the signals."""
        return self.signals[0]

    def __str__(self) -> str:
        """One line a candidate, then what to expect of the best."""
        rows = [f"candidates for {', '.join(self.chosen)}, best first ({self.criterion}):"]
        shares = self.time_shares.shares if self.time_shares else [float("nan")] * len(self.signals)
        for s, score, share in zip(self.signals, self.score, shares, strict=True):
            told = f"{score:.3g} times the reference" if score > 0 else "does not determine them"
            rows.append(f"  {s.kind} of {s.time[-1]:.4g} s, rms {s.rms:.4g}: {told}; "
                        f"time share in the best mixture {100 * share:.3g} %")  # fmt: skip
        return "\n".join([*rows, str(self.expected)])


def record_information(
    model: Model,
    p: FloatArray,
    signal: Signal,
    noise: Mapping[str, float],
    names: Sequence[str],
    scale: FloatArray,
    *,
    others: Mapping[str, float] | None = None,
    initial: str = "free",
    offsets: bool = True,
    n_sub: int = 1,
) -> FloatArray:
    """Return the Fisher information of one record on some parameters, shape (n, n).

    Parameters
    ----------
    p : ndarray, shape (n_p,), SI
    noise : mapping of str to float
        Standard deviation of the white noise of each sensor read, SI.
    names : sequence of str
        Parameters.
    scale : ndarray, shape (n,)
        Information is per change by this much.
    others : mapping of str to float, optional
        Constant commands of the other inputs; 0 if not given.
    initial : {"free", "rest"}
        Initial state unknown (eliminated), or at rest under the first command; that a rest moves
        with the parameters is not counted.
    offsets : bool
        Whether each sensor has an unknown offset (eliminated).
    n_sub : int
        Sub-steps a sample.
    """
    require_known("initial state", "design", ("free", "rest"), initial)
    dynamics = dynamics_of(model)
    sources = dynamics.commands
    require_known("input", dynamics.name, sources, signal.name)
    require_known("input", dynamics.name, sources, *(others or {}))
    u = _inputs(dynamics, signal, others)
    if initial == "rest":
        dynamics.at_rest(p, u[0])  # or it says that there is none
    at = [dynamics.parameter_names.index(n) for n in names]
    free = initial == "free" and dynamics.n_x > 0
    run = _run(dynamics, p, u, signal, n_sub, at, free)
    blocks = []
    outputs = list(dynamics.output_names)
    for k, (name, level) in enumerate(noise.items()):
        require_known("sensor", dynamics.name, outputs, name)
        if not level > 0.0:
            raise UnusableInput(f"design: the noise of {name} must be positive")
        slope = run.dy[:, outputs.index(name)] / level
        if offsets:
            extra = np.zeros((slope.shape[0], len(noise)))
            extra[:, k] = 1.0
            slope = np.hstack([slope, extra])
        blocks.append(slope)
    stacked = np.concatenate(blocks)
    if not np.isfinite(stacked).all():
        raise UnusableInput(
            f"design: the simulation of {signal.kind} is not finite; shorten it or lower it"
        )
    wanted_part, local = stacked[:, : len(at)] * scale, stacked[:, len(at) :]
    size = np.linalg.norm(local, axis=0)
    local = local[:, size > 0.0] / size[size > 0.0]
    if local.shape[1]:
        q, _, _ = np.linalg.svd(local, full_matrices=False)
        rank = int(np.linalg.matrix_rank(local, tol=1e-10 * np.sqrt(local.shape[1])))
        wanted_part = wanted_part - q[:, :rank] @ (q[:, :rank].T @ wanted_part)
    return np.asarray(wanted_part.T @ wanted_part)


def _inputs(dynamics: Dynamics, signal: Signal, others: Mapping[str, float] | None) -> FloatArray:
    """Commands of zero for every source but the signal's and `others`, shape (N, n_u)."""
    commands = {n: np.zeros(signal.time.size) for n in dynamics.commands}
    for n, value in (others or {}).items():
        commands[n] = np.full(signal.time.size, float(value))
    return dynamics.inputs({**commands, signal.name: signal.values}, signal.time)


def _run(
    dynamics: Dynamics,
    p: FloatArray,
    u: FloatArray,
    signal: Signal,
    n_sub: int,
    directions: Sequence[int] = (),
    states: bool = False,
) -> KernelRun:
    """Run from rest under the first inputs, differentiated as asked."""
    ready = dynamics.prepare(p, 1.0 / signal.rate, n_sub, directions, states)
    return dynamics.run(
        ready, u, dynamics.rest(p, u[0]), dynamics.fine_inputs(u, n_sub, signal.between)
    )


def flat_like(signal: Signal) -> Signal:
    """Return a flat multisine of the same mean, power, duration, rate and occupied band.

    The band ends where 99 % of the signal's power does.
    """
    n = signal.values.size
    power = np.abs(np.fft.rfft(signal.values - signal.values.mean())[: (n - 1) // 2 + 1]) ** 2
    last = int(np.searchsorted(np.cumsum(power), 0.99 * power.sum()))
    rms = float(signal.values.std())
    if not rms > 0.0:
        raise UnusableInput(f"{signal.name}: a signal that rests has no flat counterpart")
    period, periods = (signal.period, signal.periods) if signal.period else (n, 1)
    lines = range(1, max(2, last * period // n + 1))
    return multisine(
        signal.rate, period, lines=list(lines), rms=rms, phases="low_crest", periods=periods,
        bias=float(signal.values.mean()), name=signal.name, unit=signal.unit,
    )  # fmt: skip


def rank_signals(
    model: Model,
    signals: Sequence[Signal],
    noise: Mapping[str, float],
    *,
    chosen: Sequence[str] | None = None,
    nuisances: Sequence[str] | None = None,
    reference: Signal | None = None,
    criterion: str = "D",
    values: Mapping[str, float] | None = None,
    prior: Mapping[str, float] | None = None,
    samples: int = 8,
    others: Mapping[str, float] | None = None,
    initial: str = "free",
    offsets: bool = True,
    seed: int = 0,
) -> Ranking:
    """Rank inputs by what they tell about chosen parameters.

    Parameters
    ----------
    model : BondGraph or Compiled
        Any model with a fast step, hysteretic laws included; memories start virgin.
    signals : sequence of Signal
    noise : mapping of str to float
        As in `record_information`, as are `others`, `initial` and `offsets`.
    chosen, nuisances, criterion, values, prior, samples
        As in `identification.experiments.design.optimal.optimal_multisine`.
    reference : Signal, optional
        What to compare with; a flat multisine like the best candidate (`flat_like`) if not given.

    Raises
    ------
    UnusableInput
        If no candidate determines the chosen parameters.
    """
    dynamics = dynamics_of(model)
    require_known("criterion", "design", CRITERIA, criterion)
    if not signals:
        raise UnusableInput("rank_signals: there is no candidate; give at least one signal")
    first, rest = wanted(dynamics, chosen, nuisances)
    names = (*first, *rest)
    vectors, scale = prior_samples(dynamics, names, values, prior, samples, seed)

    def of(signal: Signal) -> FloatArray:
        n_sub = _steps(dynamics, vectors[0], signal, others)
        return np.stack(
            [
                record_information(
                    dynamics, p, signal, noise, names, scale,
                    others=others, initial=initial, offsets=offsets, n_sub=n_sub,
                )
                for p in vectors
            ]
        )  # fmt: skip

    found = [of(s) for s in signals]
    merit = [_merit(m, len(first), criterion) for m in found]
    order = np.argsort(merit, kind="stable")[::-1]
    if not np.isfinite(merit[order[0]]):
        raise UnusableInput(
            f"rank_signals: no candidate determines {', '.join(first)} beside the nuisances; "
            "fix some parameters, add a sensor or another signal"
        )
    best = signals[order[0]]
    against = reference if reference is not None else flat_like(best)
    base = of(against)
    base_merit = _merit(base, len(first), criterion)
    score = [float(np.exp(merit[i] - base_merit)) if np.isfinite(base_merit) else np.inf
             for i in order]  # fmt: skip
    score = [s if np.isfinite(merit[i]) else 0.0 for s, i in zip(score, order, strict=True)]
    durations = np.array([signals[i].values.size / signals[i].rate for i in order])
    rates = np.stack([found[i] for i in order], axis=1) / durations[None, :, None, None]
    rates = beside_seen(rates, len(first))
    try:
        shares = optimal_weights(rates, len(first), criterion=criterion)
    except UnusableInput:
        shares = None
    deviations = np.stack([standard_deviations(found[i][0], len(first)) for i in order])
    return Ranking(
        tuple(signals[i] for i in order), tuple(score),
        table(dynamics, vectors[0], first, scale, found[order[0]][0], base[0],
              f"{against.kind}, rms {against.rms:.4g} {against.unit}, {against.time[-1]:.4g} s"),
        shares, criterion, first, deviations * scale[: len(first)],
    )  # fmt: skip


def _merit(information: FloatArray, chosen: int, criterion: str) -> float:
    """Mean over the samples: log det^(1/s) of the chosen part, or less log mean variance."""
    total = []
    for each in information:
        m = beside_seen(each, chosen)
        sd = standard_deviations(m, chosen)
        if not np.isfinite(sd).all():
            return -np.inf
        if criterion == "A":
            total.append(float(np.sum(sd**2)))
            continue
        rest = np.linalg.slogdet(m[chosen:, chosen:])[1] if chosen < m.shape[0] else 0.0
        total.append(float(np.linalg.slogdet(m)[1] - rest) / chosen)
    mean = float(np.mean(total))
    return -float(np.log(mean)) if criterion == "A" else mean


def _steps(
    dynamics: Dynamics, p: FloatArray, signal: Signal, others: Mapping[str, float] | None
) -> int:
    """Sub-steps that change the readings by less than a thousandth beside half as many."""
    n_sub = 2 if signal.between == "band-limited" else 1
    if dynamics.exact_step and n_sub == 1:
        return n_sub
    u = _inputs(dynamics, signal, others)
    before = _run(dynamics, p, u, signal, n_sub).y
    while n_sub < FINEST:
        n_sub *= 2
        after = _run(dynamics, p, u, signal, n_sub).y
        if relative_change(before, after) < ACCURACY:
            break
        before = after
    return n_sub


FINEST = 16
ACCURACY = 1e-3
