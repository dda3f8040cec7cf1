"""Before physics is blamed: channels exchanged, other signs, units or quantities, dead sensors.

A name for such a mistake would be an invention, and parameters bend far to hide it. So where the
model fails grossly, it is fitted once more to the recording with each mistake undone; a mistake is
only told if undoing it removes nearly all of the misfit.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from joblib import Parallel, delayed

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.files.time_base import TIME
from bondgraph.signals.recording import Split
from bondgraph.signals.units import parse_unit
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.screening.carried import MOVED, SEVERAL, far_off
from identification.diagnosis.screening.forgotten_unit import Suspect, sharing_a_unit, suspects
from identification.diagnosis.screening.undoing import (
    FACTORS,
    SENSORS,
    Mixup,
    as_read,
    driven_and_read,
    exchanges_of,
    in_unit,
    moving_commands,
    scale_of,
    undone,
    with_unit,
)
from identification.diagnosis.screening.usual_units import conversions
from identification.diagnosis.search.base import declared_fit
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.estimation.threads import calm
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import evaluate, start_point

GROSS = 0.2
"""Error over the spread of a reading from which a mistake in the recording is looked for."""
NOISE = 1.5
"""Mean square over the floor that may be noise alone."""
FALL, LEAST = 0.05, 0.2
"""Undoing the mistake leaves this part of the misfit above the floor, and this part of all ..."""
RARE = 0.02
"""The first of these parts for what hardly anybody does."""
LEFT = 0.2
"""... at most, and this error over the spread of any reading."""
BESIDE_FALL, BESIDE_LEFT, BESIDE_APART = 0.1, 0.35, 0.35
"""The first and the last where physics is missing as well, and the part of the misfit of short
stretches, each with a state of its own, that has to be left then."""
BESIDE = ("sign", "exchange", "scale")
"""What is told beside physics that is missing as well."""
ALIKE = 3.0
"""Mistakes whose misfit lies within this factor of the best one's cannot be told apart."""
FEW = 1500
"""Samples on which the mistakes are tried; the best is judged on all."""
SHORT, A_FEW = 24, 8
"""Samples of a short stretch at least, and steps of the fit to many of them."""
FIRST_TRIED = 10.0
"""Misfit of short stretches over the least one's up to which a mistake is fitted before others."""
FEWER = 600
"""Samples cut into short stretches."""
ENOUGH = 10.0
"""Misfit over the floor of short stretches that a mistake undone may have in any case."""
FAR_OFF = 5.0
"""Factor from which units that are no power of ten are looked for."""
FAR = 2.0
"""Ratio of measured to declared size from which other units are tried: declared values are off."""
FIRST, TOGETHER = "check the unit", "all values are fitted"
"""How sentences on units begin."""
DEAF = 0.1
"""Correlation with the model below which a sensor shows nothing of it."""
SPREAD, CLOSE = 2.0, 1.2
"""Ratio of the largest to the smallest factor that are one, and how near it is to a conversion."""
ANGLES, LENGTHS = FACTORS[4:6], FACTORS[6:8]
"""Those of what has no length in its unit, and of what has one (g for m/s^2 among them)."""


def relative_errors(fit: Fit, part: str = "test") -> dict[str, float]:
    """Error of each reading over its spread, on one part; NaN where a reading stands still."""
    y = fit.problem.data.readings[fit.problem.data.mask(part)]
    r = fit.residuals(part)
    spread = np.sqrt(np.mean((y - y.mean(axis=0)) ** 2, axis=0))
    error = np.sqrt(np.mean(r**2, axis=0))
    ratio = np.divide(error, spread, out=np.full_like(error, np.nan), where=spread > 0)
    return dict(zip(fit.problem.data.names, map(float, ratio), strict=True))


def gross(fit: Fit) -> bool:
    """Whether the fitted model misses a reading by so much that the recording is in question."""
    errors = [e for e in relative_errors(fit).values() if np.isfinite(e)]
    return fit.chi2("test") > NOISE and max(errors, default=0.0) > GROSS


def _held(graph: BondGraph, fit: Fit) -> bool:
    """Whether a bound that was declared holds a parameter, and more than noise is left.

    A parameter that is free makes up for a unit. A reading that drifts has a spread beside which
    such an error is small.
    """
    if fit.chi2("test") <= NOISE:
        return False
    ends = {e.name for e in fit.estimates if e.at_bound} & set(graph.parameters)
    known = (graph.parameters[n] for n in ends)
    return any((p.lower, p.upper, p.spread) != (None, None, None) for p in known)


def stuck(data: Data) -> tuple[str, ...]:
    """Return a sentence for every reading that is constant although others and a command move."""
    moving = [n for n, u in data.commands.items() if np.ptp(u) > 0]
    still = [c for c in range(len(data.names)) if np.ptp(data.readings[:, c]) == 0]
    if not moving or len(still) == len(data.names):
        return ()
    return tuple(
        f"the reading {data.names[c]} is constant ({data.readings[0, c]:.4g}) while {moving[0]} "
        "moves: check this sensor, or take it out of the model"
        for c in still
    )


def moved(
    last: Fit, declared: Mapping[str, Parameter], taken_over: Collection[str] = ()
) -> tuple[str, ...]:
    """Return a sentence for every declared parameter that a fit carried absurdly far.

    One for all where they are several, or where one channel makes up for all: then it is rather its
    unit that is wrong. None for those that a found law has `taken_over`.
    """
    declared = {n: p for n, p in declared.items() if n not in taken_over}
    ends = {e.name: e.ci95 for e in last.estimates}
    # an interval that holds what is declared tells nothing against it
    far = {
        n: ratio
        for n, ratio in far_off(last, declared).items()
        if not ends[n][0] <= declared[n].value <= ends[n][1]
    }
    found = [
        f"{e.name} is declared as {declared[e.name].value:.4g}{_unit(e.unit)} and fitted as "
        f"{e.value:.4g}{_unit(e.unit)}: check its value and the units of all channels"
        for e in last.estimates
        if e.name in far
    ]
    blamed = " or of ".join(map(str, _blamed(last, declared))) if len(found) > 1 else ""
    if len(found) < SEVERAL and not blamed:
        return tuple(found)
    channels = ", ".join((*last.problem.data.commands, *last.problem.data.names))
    whose = f" of {blamed}" if blamed else f"s of {channels}"
    return (
        f"{FIRST}{whose} first: {len(found)} parameters are fitted absurdly far "
        f"from what is declared, at so many times it: {times(far)}",
    )


def _unit(unit: str) -> str:
    return f" {unit}" if unit not in ("", "1") else ""


def times(ratios: Mapping[str, float]) -> str:
    """List names and ratios."""
    return ", ".join(f"{n} {r:.3g}" for n, r in ratios.items())


def _blamed(last: Fit, declared: Mapping[str, Parameter]) -> tuple[Suspect, ...]:
    """Return whose unit the values make up for; nobody's where the model fails all the same."""
    return () if gross(last) else suspects(last, declared)


def in_doubt(
    last: Fit, declared: Mapping[str, Parameter], taken_over: Collection[str] = ()
) -> tuple[str, ...]:
    """Return sentences on units and on values that are not what was declared, none twice."""
    declared = {n: p for n, p in declared.items() if n not in taken_over}
    far = moved(last, declared)
    return far if far[:1] and far[0].startswith(FIRST) else (*far, *moved_together(last, declared))


def of_units(sentences: tuple[str, ...]) -> tuple[str, ...]:
    """Return those of `in_doubt` that tell of a unit rather than of values."""
    return tuple(s for s in sentences if s.startswith((f"{FIRST} of ", TOGETHER)))


def moved_together(last: Fit, declared: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Return a sentence where all values are fitted as one wrong unit would have it.

    That of an only reading shows in no misfit: every parameter makes up for it alike.
    """
    if (many := _alike(last, declared)) is not None:
        most = max(many, 1 / many)
        names = ", ".join((*last.problem.data.commands, *last.problem.data.names))
        return (
            f"{TOGETHER} about {most:.3g} times {'larger' if many > 1 else 'smaller'} than "
            f"declared, as if a unit were forgotten: check those of {names}",
        )
    found = _blamed(last, declared)
    blamed = [str(s) for s in found if s.moves >= SEVERAL and s.miss <= np.log(SPREAD)]
    if not blamed:
        return ()
    return (f"{TOGETHER} as if a unit were forgotten: check that of {' or of '.join(blamed)}",)


def _alike(last: Fit, declared: Mapping[str, Parameter]) -> float | None:
    """Return the conversion by which all values have moved, None where there is none."""
    ratios = [
        e.value / declared[e.name].value
        for e in last.estimates
        if e.name in declared and declared[e.name].value
    ]
    if len(ratios) < 2 or min(ratios) <= 0 or max(ratios) > SPREAD * min(ratios):
        return None
    many = float(np.exp(np.mean(np.log(ratios))))
    return many if _is_one(many, _conversions(many)[:1]) else None


def forgotten(sensor: str, factor: float) -> Mixup | None:
    """Return the mistake that a factor of a reading looks like: a sign, a unit; None for others."""
    if 1 / CLOSE < -factor < CLOSE:
        return Mixup("sign", (sensor,))
    near = _conversions(factor)[:1] if factor > 0 else []
    if _is_one(factor, near):
        return Mixup("scale", (sensor,), near[0])
    return None


def mixups(graph: BondGraph, nominal: Fit, jobs: int = 1) -> tuple[Mixup, ...]:
    """Return the mistakes in the recording that explain the misfit of `nominal`, the best first.

    Several are returned where these data cannot tell them apart (the sign of the only sensor, or
    of the only command). Where the misfit is not `gross` and no parameter is held by a bound that
    was declared, only like readings are tried the other way round.

    Parameters
    ----------
    graph : BondGraph
        The model as declared.
    nominal : Fit
        Its fit to the recording.
    jobs : int
        Processes that share the fits.
    """
    if not (gross(nominal) or _held(graph, nominal)):
        return _like_exchanged(graph, nominal)
    data = nominal.problem.data
    short, share = brief(data), Parallel(n_jobs=jobs)
    sizes = list(_sizes(graph, nominal))
    possible = list(_candidates(graph, nominal, sizes))
    apart, *each = share(
        [
            delayed(in_windows)(graph, short),
            *(delayed(in_windows)(as_read(graph, m), undone(short, m)) for m in possible),
        ]
    )
    # what fits short stretches worse, each with a state of its own, is no mistake undone
    most = ALIKE * max(apart, ENOUGH)
    costs = {m: cost for m, cost in zip(possible, each, strict=True) if not cost > most}
    rare = list(_rare_candidates(graph, data, sizes)) if gross(nominal) else []
    each = share([delayed(in_windows)(graph, undone(short, m)) for m in rare])
    # of what hardly anybody does a fair part of the misfit of the stretches must be gone as well
    most = max(ENOUGH, LEAST * apart)
    costs |= {m: cost for m, cost in zip(rare, each, strict=True) if cost <= most}
    before = _cost(graph, short)
    for likely in _in_turn(costs):
        each = share([delayed(_cost)(graph, short, m) for m in likely])
        beside = {m for m in likely if m.kind in BESIDE and costs[m] <= BESIDE_APART * apart}
        tried = dict(zip(likely, each, strict=True))
        if found := _sure(graph, nominal, before, tried, beside):
            return tuple(with_unit(data, m) for m in found)
    return ()


def _like_exchanged(graph: BondGraph, nominal: Fit) -> tuple[Mixup, ...]:
    """Return like readings that are exchanged: they differ by little, so that nothing is gross.

    Undone, nearly all of the misfit is gone, and no value lies farther from what is declared.
    """
    data, before = nominal.problem.data, nominal.chi2("test")
    if LEAST * before < 1.0:  # undone it cannot be gone but for noise
        return ()
    least, found = max(away(nominal, graph.parameters).values(), default=0.0), []
    for group in sharing_a_unit(data):
        for pair in combinations(group, 2):
            m = Mixup("exchange", pair)
            try:
                fit = fit_undone(graph, data, m)
            except (BondsightError, np.linalg.LinAlgError, ValueError):
                continue
            after, far = fit.chi2("test"), away(fit, graph.parameters)
            nearer = max(far.values(), default=0.0) <= least
            if _explains(before, after, beside=True) and nearer and not gross(fit):
                found.append(replace(m, before=before, after=after))
    return tuple(sorted(found, key=lambda m: m.after)[:1])


def away(fit: Fit, declared: Mapping[str, Parameter]) -> dict[str, float]:
    """Return how far fitted values are from those declared, logarithmic; infinite beyond zero."""
    found = {}
    for e in fit.estimates:
        if e.name in declared and (start := declared[e.name].value):
            ratio = e.value / start
            found[e.name] = abs(float(np.log(ratio))) if ratio > 0 else np.inf
    return found


def _in_turn(costs: Mapping[Mixup, float]) -> Iterator[list[Mixup]]:
    """Yield those that fit short stretches best, then the others, which take long."""
    alive = [c for m, c in costs.items() if m.kind != "dead" and np.isfinite(c)]
    best = FIRST_TRIED * max(1.0, min(alive, default=0.0))
    first = [m for m, c in costs.items() if c <= best]
    others = [m for m in costs if m not in first]
    yield from (group for group in (first, others) if group)


def _sure(
    graph: BondGraph,
    nominal: Fit,
    before: float,
    tried: Mapping[Mixup, float],
    beside: Collection[Mixup],
) -> tuple[Mixup, ...]:
    """Return those that explain all samples as well, the best first.

    Those of `beside` need not explain all: physics may be missing as well.
    """
    best = min(tried.values(), default=np.inf)
    if not any(_explains(before, cost, m in beside) for m, cost in tried.items()):
        return ()
    found = []
    for m, cost in sorted(tried.items(), key=lambda t: t[1]):
        if cost < ALIKE * best and (sure := _judged(graph, nominal, m, m in beside)) is not None:
            found.append(sure)
    if not found:
        return ()
    least = min(m.after for m in found)
    alike = sorted(
        (m for m in found if m.after <= ALIKE * least),
        key=lambda m: (m.after > CLOSE * least, m.beside, m.after),
    )
    known = {m.channels for m in alike if m.kind == "scale" and m.is_conversion}
    kept = [m for m in alike if m.kind != "scale" or m.is_conversion or m.channels not in known]
    # exchanged with or without their units: it is one mistake
    first: dict[str, Mixup] = {}
    for m in kept:
        first.setdefault(m.claim, m)
    return tuple(first.values())


@calm()
def in_windows(graph: BondGraph, data: Data) -> float:
    """Misfit of short stretches, each with a state of its own; NaN where it cannot be told."""
    first = slice(0, min(FEWER, data.n))
    split = Split(first, slice(first.stop, first.stop), "the very first samples")
    try:
        base = Problem(graph, replace(data, split=split), lags=False, offsets=False)
        length = max(SHORT, 8 * base.dynamics.n_x)
        return float(fit(replace(base, window=length), max_iterations=A_FEW).cost)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return float("nan")


def _explains(before: float, after: float, beside: bool = False) -> bool:
    fall = BESIDE_FALL if beside else FALL
    return after < LEAST * before and after < 1.0 + fall * before


def _candidates(graph: BondGraph, nominal: Fit, sizes: Sequence[Array]) -> Iterator[Mixup]:
    data = nominal.problem.data
    commands = moving_commands(graph, data)
    for group in (commands, list(data.names)):
        yield from (Mixup("sign", (n,)) for n in group)
        # of other quantities too: it is the columns that are exchanged, or their names
        for pair in combinations(group, 2):
            yield from exchanges_of(data, pair)
    yield from _scales(graph, data, commands, sizes)
    for name in data.names:
        if (kind := graph[name].kind) in SENSORS:
            yield from (Mixup("quantity", (name,), sensor=k) for k in SENSORS if k != kind)
    if len(data.names) > 1:
        errors = relative_errors(nominal)
        yield from (Mixup("dead", (n,)) for n in data.names if errors[n] > 1 - DEAF)


def _rare_candidates(graph: BondGraph, data: Data, sizes: Sequence[Array]) -> Iterator[Mixup]:
    """Yield commands in columns of readings, other units of the time and of like readings."""
    for pair in driven_and_read(data, moving_commands(graph, data)):
        yield from exchanges_of(data, pair)
    yield from (in_unit(data, (TIME,), f) for f in conversions(data.read_in.get(TIME, "")))
    found: dict[Mixup, None] = {}
    for ratio in sizes:
        size = dict(zip(data.names, ratio, strict=True))
        for group in sharing_a_unit(data):
            own = [float(size[n]) for n in group]
            if max(own) < ALIKE * min(own):
                many = float(np.exp(np.mean(np.log(own))))
                found |= dict.fromkeys(_usual(data, group, many))
    yield from found


def _usual(data: Data, channels: tuple[str, ...], size: float) -> Iterator[Mixup]:
    """Yield usual units that numbers so many times too large may be in."""
    for factor in conversions(data.read_in.get(channels[0], "")):
        if abs(np.log(factor)) > np.log(FAR_OFF) and abs(np.log(size / factor)) < np.log(FAR):
            yield in_unit(data, channels, factor)


def _scales(
    graph: BondGraph, data: Data, commands: list[str], every: Sequence[Array]
) -> Iterator[Mixup]:
    """Forgotten conversions, from the sizes of the readings against the declared model's."""
    found: dict[tuple[str, float], Mixup] = {}
    for ratio in every:
        together = float(np.exp(np.mean(np.log(ratio))))
        sizes = {n: float(r) for n, r in zip(data.names, ratio, strict=True)}
        for n, size in (sizes | dict.fromkeys(commands, 1.0 / together)).items():
            near = _conversions(size, graph[n])
            if n in sizes and not 1 / MOVED < size < MOVED:
                near.append(size)  # counts of an encoder are no conversion
            found |= {
                (n, f): Mixup("scale", (n,), f, beside=abs(float(np.log(size / f)))) for f in near
            }
            found |= {
                (n, m.factor): replace(m, beside=abs(float(np.log(size / m.factor))))
                for m in _usual(data, (n,), size)
                if (n, m.factor) not in found
            }
    yield from found.values()


def _sizes(graph: BondGraph, nominal: Fit) -> Iterator[Array]:
    """Yield readings over those of the declared model, from rest and from the state that suits.

    A state that is fitted to readings of another unit is as far off as they are.
    """
    problem = replace(
        nominal.problem, graph=graph, built=None, starts={}, known_states={}, known_offsets=()
    )
    with calm():
        at_rest = evaluate(problem, start_point(problem), derivatives=False).y
    for simulated in (at_rest, declared_fit(problem, nominal).simulated):
        ratio = problem.data.readings.std(axis=0) / np.maximum(simulated.std(axis=0), 1e-300)
        if np.isfinite(ratio).all() and (ratio > 0).all():
            yield ratio


def _is_one(ratio: float, near: list[float]) -> bool:
    return any(1 / CLOSE < ratio / f < CLOSE for f in near)


def _conversions(ratio: float, channel: Element | None = None) -> list[float]:
    """Return conversions that a ratio of sizes may come from; none for an ordinary ratio."""
    if 1 / FAR < ratio < FAR:
        return []
    unit = getattr(channel, "unit", "")
    long = bool(unit and parse_unit(unit).dims[0])
    others = () if not unit else ANGLES if long else LENGTHS
    known = [f**s for f in FACTORS if f not in others for s in (1, -1)]
    near = sorted(known, key=lambda f: abs(np.log(ratio / f)))[:2]
    return [f for f in near if abs(np.log(ratio / f)) < np.log(6.0)]


def brief(data: Data) -> Data:
    """Return the moving part of the first recording, at most `FEW` samples, all of them scored."""
    begin = data.split.rest.stop if data.split.rest is not None else 0
    ends = [e for e in (*data.breaks, data.n) if e > begin]
    stop = min(begin + FEW, ends[0])
    part = slice(begin, stop)
    return replace(
        data,
        time=data.time[part],
        commands={k: v[part] for k, v in data.commands.items()},
        readings=data.readings[part],
        split=Split(slice(0, stop - begin), slice(0, stop - begin), "the first samples"),
        breaks=(),
        finer=() if begin else data.finer[:1],
        begin=0,
    )


def fit_undone(graph: BondGraph, data: Data, mixup: Mixup | None = None) -> Fit:
    """Fit the model with a mistake undone; how another command moves between samples is open."""
    if mixup is None:
        return nominal_fit(graph, data, data.hold)[1]
    made = undone(data, mixup)
    hold = None if mixup.drives_otherwise(data) else made.hold
    return nominal_fit(as_read(graph, mixup), made, hold)[1]


@calm()
def _cost(graph: BondGraph, data: Data, mixup: Mixup | None = None) -> float:
    """Misfit after a fit; infinite where it cannot be made, or a dead sensor does follow."""
    try:
        found = fit_undone(graph, data, mixup)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return np.inf
    if found.status is FitStatus.BROKEN or not np.isfinite(found.simulated).all():
        return np.inf
    if mixup is not None and mixup.kind == "dead" and _follows(found, mixup.channels[0]):
        return np.inf
    return found.chi2("train")


def _follows(fit: Fit, sensor: str) -> bool:
    c = fit.problem.data.names.index(sensor)
    y, x = fit.problem.data.readings[:, c], fit.simulated[:, c]
    return bool(np.ptp(x) == 0 or abs(np.corrcoef(x, y)[0, 1]) > DEAF)


def _judged(graph: BondGraph, nominal: Fit, mixup: Mixup, beside: bool) -> Mixup | None:
    """Fit all training samples with the mistake undone; None if that explains nothing after all."""
    most = BESIDE_LEFT if beside else LEFT
    data = nominal.problem.data
    try:
        found = fit_undone(graph, data, mixup)
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return None
    before, after = nominal.chi2("test"), found.chi2("test")
    errors = [
        e
        for n, e in relative_errors(found).items()
        if not (mixup.kind == "dead" and n == mixup.channels[0])
    ]
    explains = _explains(before, after, beside) and max(errors) <= most
    if found.status is FitStatus.BROKEN or not explains:
        return None
    # what hardly anybody does must explain nearly all, with values that no bound holds
    if mixup.is_rare(data) and (after > max(ALIKE, RARE * before) or _held(graph, found)):
        return None
    factor = mixup.factor * found.values.get(scale_of(mixup.channels[0]), 1.0)
    return replace(mixup, factor=factor, before=before, after=after)
