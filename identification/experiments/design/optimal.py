"""The multisine that best determines chosen parameters by small motions about a rest.

N samples of a line of peak amplitude a carry, on sensors with white noise of standard deviation
``sigma_y``, the information

    (N / 2) a^2 sum_y Re(conj(dG_y/dp_i) dG_y/dp_j) / sigma_y^2

on the parameters (Goodwin and Payne, Dynamic System Identification (1977), chapter 6; Mehra, IEEE
Trans. Autom. Control 19 (1974) 753), in the steady state. It is linear in the power of each line,
so the best power spectrum is a convex problem with a certificate (`weights`). What a law adds to
its linear slope, and whatever large motions show of other models, is not seen here; `candidates`
ranks inputs by whole records.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.simulation.dynamics import Model, dynamics_of
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from identification.experiments.design.expected import ExpectedTable, prior_samples, table, wanted
from identification.experiments.design.limits import fitted
from identification.experiments.design.linear_response import response_and_sensitivity
from identification.experiments.design.multisine import multisine
from identification.experiments.design.signal import Signal
from identification.experiments.design.weights import Weights, optimal_weights

Noise = float | Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """A proposed input and what to expect of it.

    Parameters
    ----------
    signal : Signal
        The proposed input.
    flat : Signal
        The flat multisine on the same candidate lines that it is compared with.
    weights : Weights
        Shares of power of the candidate lines, with the certificate.
    frequency : ndarray, shape (K,), Hz
        Candidate lines.
    expected : ExpectedTable
        95 % intervals of both inputs.
    criterion : str
    notes : tuple of str
    """

    signal: Signal
    flat: Signal
    weights: Weights
    frequency: FloatArray
    expected: ExpectedTable
    criterion: str
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Say in words what is proposed and why."""
        used = [f"{f:.4g}" for f in self.signal.frequencies]
        shown = ", ".join(used[:12]) + (f", ... ({len(used)} lines)" if len(used) > 12 else "")
        return "\n".join(
            [
                f"{self.criterion}-optimal multisine for {self.signal.name}: {shown} Hz",
                f"  {self.weights!r}",
                *(f"  {n}" for n in self.notes),
                str(self.expected),
            ]
        )


def line_information(
    model: Model,
    p: FloatArray,
    source: str,
    noise: Mapping[str, Noise],
    frequency: FloatArray,
    parameters: Sequence[str],
    scale: FloatArray,
    bias: Mapping[str, float] | None = None,
) -> FloatArray:
    """Return the information of one sample of unit power (``a^2 / 2 = 1``), shape (K, n, n).

    Parameters
    ----------
    noise : mapping of str to float or callable
        Standard deviation of the noise of each sensor, SI, white up to the Nyquist rate; or a
        function of the frequency (Hz) that gives the white level equal to the noise there.
    scale : ndarray, shape (n,)
        Information is per change of a parameter by this much.
    bias : mapping of str to float, optional
        Constant commands, see `response_and_sensitivity`.
    """
    if not noise:
        raise UnusableInput("design: give the noise of at least one sensor, {'x': 1e-9}")
    _, slope = response_and_sensitivity(
        model, p, source, tuple(noise), frequency, tuple(parameters), bias
    )
    levels = []
    for name, level in noise.items():
        sd = level(frequency) if callable(level) else np.full(frequency.size, float(level))
        if not (np.isfinite(sd).all() and (sd > 0.0).all()):
            raise UnusableInput(f"design: the noise of {name} must be positive and finite")
        levels.append(sd)
    weighed = slope * scale / np.stack(levels, axis=1)[:, :, None]
    return np.asarray(np.einsum("fyi,fyj->fij", weighed.conj(), weighed).real)


def information_of_signal(
    model: Model,
    p: FloatArray,
    signal: Signal,
    noise: Mapping[str, Noise],
    parameters: Sequence[str],
    scale: FloatArray,
    bias: Mapping[str, float] | None = None,
) -> FloatArray:
    """Return the information of a whole periodic signal in the steady state, shape (n, n)."""
    lines = np.asarray(signal.lines)
    amplitude = np.abs(np.fft.rfft(signal.one_period)[lines]) * 2.0 / signal.period
    held = {**(bias or {}), signal.name: signal.bias}
    each = line_information(
        model, p, signal.name, noise, signal.frequencies, parameters, scale, held
    )
    return np.asarray(np.einsum("k,kij->ij", 0.5 * amplitude**2 * signal.values.size, each))


def optimal_multisine(
    model: Model,
    source: str,
    noise: Mapping[str, Noise],
    *,
    rate: float,
    period: int,
    band: tuple[float, float] | None = None,
    kind: str = "full",
    chosen: Sequence[str] | None = None,
    nuisances: Sequence[str] | None = None,
    criterion: str = "D",
    rms: float = 1.0,
    envelope: DriveLimits | None = None,
    corner: float | None = None,
    values: Mapping[str, float] | None = None,
    prior: Mapping[str, float] | None = None,
    samples: int = 16,
    flat_share: float = 0.0,
    periods: int = 1,
    seed: int = 0,
    unit: str | None = None,
    bias: Mapping[str, float] | None = None,
) -> Proposal:
    """Return the multisine whose power spectrum determines parameters best.

    Parameters
    ----------
    model : BondGraph, Compiled or Dynamics
        Any that has slopes at its rest.
    source : str
        The input designed; other inputs rest.
    noise : mapping of str to float or callable
        Sensors that are read, and their noise; see `line_information`.
    rate, period, band, kind, periods, seed
        Candidate lines, as in `multisine`.
    chosen, nuisances : sequence of str, optional
        Parameters to determine, and those that are unknown as well but do not count; all that are
        not fixed, and all other ones that are not fixed. Everything else is known.
    criterion : {"D", "A"}
        Volume of the confidence ellipsoid, or sum of the relative variances.
    rms : float
        Root mean square of the flat multisine, whose power or cost the proposed one has as well.
    envelope : DriveLimits, optional
        Both are then scaled down until they fit, with phases of a low crest factor.
    corner : float, optional
        Hz. The lines share ``sum P_k (1 + (f_k / corner)^2)`` in place of the power: below the
        corner the amplitude is dear, above it the current of a capacitive load.
    values : mapping, optional
        Nominal values that differ from the declared ones.
    prior : mapping of str to float, optional
        Relative standard deviations of what is not known yet; the criterion is averaged over
        `samples` of it, so that the design does not hang on a resonance being where it should.
    flat_share : float
        Part of the power, 0 .. 1, spread evenly over all candidates: few lines determine the
        declared parameters and say nothing about physics that is missing.
    unit : str, optional
        Of the source, SI; as declared in the graph if not given.
    bias : mapping of str to float, optional
        Mean of the input and constant commands of the others, SI; 0 where not given.

    Raises
    ------
    UnusableInput
        If the candidates do not determine the parameters.

    Examples
    --------
    >>> proposal = optimal_multisine(
    ...     graph, "F", {"x": 2e-6}, rate=200.0, period=400, band=(0.5, 40.0), chosen=("m", "d"),
    ...     nuisances=(), rms=2.0, unit="N",
    ... )
    >>> proposal.signal.kind
    'D-optimal multisine'
    """
    if corner is not None and not corner > 0.0:
        raise UnusableInput(f"design: the corner of {corner} Hz must be positive")
    if not 0.0 <= flat_share < 1.0:
        raise UnusableInput(f"design: flat_share = {flat_share} must lie within 0 .. 1")
    dynamics = dynamics_of(model)
    first, rest = wanted(dynamics, chosen, nuisances)
    names = (*first, *rest)
    if unit is None:
        unit = getattr(model[source], "unit", "") if isinstance(model, BondGraph) else ""
    unit = unit or "1"
    vectors, scale = prior_samples(dynamics, names, values, prior, samples, seed)
    designed = partial(
        multisine, rate, period, rms=rms, periods=periods, seed=seed, name=source, unit=unit,
        bias=(bias or {}).get(source, 0.0),
    )  # fmt: skip
    even = designed(band=band, kind=kind, phases="schroeder")
    f = even.frequencies
    each = np.stack(
        [line_information(dynamics, p, source, noise, f, names, scale, bias) for p in vectors]
    )
    _must_show(each, names)
    cost = np.ones(f.size) if corner is None else 1.0 + (f / corner) ** 2
    found = optimal_weights(each, len(first), criterion=criterion, cost=cost)
    shares = found.shares / found.shares.sum()
    shares = (1.0 - flat_share) * shares + flat_share / f.size
    kept = shares > 1e-4 * shares.max()
    lines = np.asarray(even.lines)[kept].tolist()
    made = designed(lines=lines, shape=np.sqrt(shares[kept]), phases="low_crest")
    flat = designed(band=band, kind=kind, phases="low_crest")
    made = replace(made, kind=f"{criterion}-optimal multisine", detection=flat.detection)
    spent = float(shares[kept] @ cost[kept] / shares[kept].sum())
    made = made.scaled(float(np.sqrt(cost.mean() / spent)))
    notes = [f"crest factor {_crest(made)}, of the flat one {_crest(flat)}"]
    words = f"a flat multisine of {f.size} lines, equal {'power' if corner is None else 'cost'}"
    if envelope is not None:
        both = [fitted(s, envelope) for s in (made, flat)]
        made, flat = (b.signal for b in both)
        notes += [f"to fit the envelope: {both[0]}; flat: amplitude times {both[1].amplitude:.4g}"]
        words = f"a flat multisine of {f.size} lines as large as the envelope allows"
    information = [
        information_of_signal(dynamics, vectors[0], s, noise, names, scale, bias)
        for s in (made, flat)
    ]
    return Proposal(
        made, flat, found, f,
        table(dynamics, vectors[0], first, scale, information[0], information[1], words),
        criterion, tuple(notes),
    )  # fmt: skip


def _crest(signal: Signal) -> str:
    return signal.notes[0].split(",")[0].removeprefix("crest factor ")


def _must_show(each: FloatArray, names: Sequence[str]) -> None:
    size = np.einsum("skii->i", each)
    for n, s in zip(names, size, strict=True):
        if not s > 1e-20 * size.max():
            raise UnusableInput(
                f"design: {n} does not show in the small motions of the model at these lines and "
                "sensors; fix it, widen the band, or use rank_signals, which sees large motions"
            )
