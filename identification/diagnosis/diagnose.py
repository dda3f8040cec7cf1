"""The whole diagnosis: floor, nominal fit, search, decision, repair; one function, one result."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bondgraph.compiled import compile_model
from bondgraph.discrete import blocks
from bondgraph.elements import C, I, R, Sensor, Source, TwoPort
from bondgraph.errors import UnusableInput
from bondgraph.graph import BondGraph
from bondgraph.signals import Recording, Split, default_split
from bondgraph.simulate import HOLDS
from identification.diagnosis.decide import Decision, Thresholds, decide
from identification.diagnosis.regions import Region, regions
from identification.diagnosis.scene import Scene, scene
from identification.diagnosis.search import Options, Trial, blocks_of, search, thinning
from identification.diagnosis.structure import (
    Structure,
    excited_frequencies,
    splitting_signals,
    structure,
)
from identification.fit import Fit, Status, best, fit
from identification.floor import noise_floor
from identification.problem import Data, Problem, data_for
from identification.residual import Point, slots, start_point, windows

Array = np.ndarray
Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything a diagnosis found; `verdict` and the report are made from it.

    Attributes
    ----------
    kind : str
        ``explained``, ``parameters_only``, ``missing_physics``, ``unknown_physics`` or
        ``insufficient_data``.
    declared : Fit or None
        The model with its declared parameters, nuisances fitted.
    nominal : Fit or None
        The model as declared in structure, parameters fitted.
    decision : Decision or None
    trials : tuple of Trial
        All effects at all places, best held-out score first.
    """

    kind: str
    model: str
    recording: Recording
    graph: BondGraph
    data: Data | None = None
    declared: Fit | None = None
    nominal: Fit | None = None
    scene: Scene | None = None
    decision: Decision | None = None
    trials: tuple[Trial, ...] = ()
    regions: tuple[Region, ...] = ()
    structure: Structure | None = None
    advice: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    seed: int = 0

    @property
    def repaired(self) -> Fit | None:
        """The fit with the named effect, if one was named."""
        if self.kind == "missing_physics" and self.decision and self.decision.chosen:
            return self.decision.chosen.fit
        return None


def diagnose(
    graph: BondGraph,
    recording: Recording,
    split: Split | None = None,
    *,
    model: str = "",
    options: Options | None = None,
    limits: Thresholds | None = None,
    hold: str | None = None,
    progress: Progress | None = None,
    seed: int = 0,
) -> Diagnosis:
    """Diagnose the mismatch between `graph` and `recording`.

    Parameters
    ----------
    graph : BondGraph
        Model with sensors; sources and sensors name the channels of `recording`.
    recording : Recording
    split : Split, optional
        Training and held-out samples; the stated default rule when not given.
    hold : {"hold", "linear", "band-limited"}, optional
        Behaviour of the commands between samples; chosen on the training part when not given.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1.

    Raises
    ------
    GraphError, UnusableInput
        The model or the channels cannot be used; one line says why.
    """
    begin = time.perf_counter()
    options = options or Options()
    say = progress or _silent
    graph.require_sound()
    compiled = compile_model(graph)
    if not compiled.n_y:
        raise UnusableInput(
            f"{graph.name} has no sensor: attach a De, Df or Dq whose name is the measured channel"
        )
    say("reading the noise floor", 0.01)
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    commands = [s.name for s in graph.of_type(Source)]
    result = Diagnosis("insufficient_data", model or graph.name, recording, graph, seed=seed)
    split = split or _split(recording, commands)
    data = data_for(graph, recording, split, dict.fromkeys(sensors, 1.0))
    if reason := _insufficient(graph, data):
        return replace(
            result, notes=(reason,), advice=(reason,), seconds=time.perf_counter() - begin
        )
    floor = noise_floor(recording, split, sensors)
    data = replace(data, floor=np.array([floor[n] for n in sensors]))
    if reason := _nothing_moves(data):
        return replace(
            result, notes=(reason,), advice=(reason,), seconds=time.perf_counter() - begin
        )
    # tiny matrices: threads of the linear algebra only get in each other's way
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore", RuntimeWarning)
        say("fitting the model as it is", 0.03)
        template, nominal = nominal_fit(graph, data, hold)
        if nominal.status is Status.BROKEN or not np.isfinite(nominal.cost):
            raise UnusableInput(
                f"{graph.name} cannot be simulated on {recording.name}: the outputs are not "
                "finite; "
                "check parameter values, signs and units"
            )
        declared = _declared_fit(template, nominal)
        seen = scene(nominal)
        say("trying the catalogue", 0.15)
        base, thin_nominal = _thinned(template, nominal, seen, options)
        # at the floor there is nothing to explain, and no search could find it
        at_floor = thin_nominal.chi2("test") < (limits or Thresholds()).mismatch
        trials = () if at_floor else tuple(search(seen, base, options, say))
        say("reading the structure", 0.96)
        frequencies = excited_frequencies(list(data.commands.values()), data.dt)
        classes = structure(seen.fitted, frequencies)
        decision = decide(
            thin_nominal.chi2("test"), blocks_of(thin_nominal), trials, limits,
            declared=declared.chi2("test"), classes=classes,
        )  # fmt: skip
        decision = _on_full_data(decision, template)
    kind = decision.kind
    if kind == "explained" and declared.chi2("test") > max(1.5 * nominal.chi2("test"), 1.3):
        kind = "parameters_only"
    result = replace(
        result, kind=kind, data=data, declared=declared, nominal=nominal, scene=seen,
        decision=decision, trials=trials, regions=regions(nominal), structure=classes,
        notes=(*recording.notes, *_notes(template)),
    )  # fmt: skip
    result = replace(result, advice=advice(result, frequencies))
    say("done", 1.0)
    return replace(result, seconds=time.perf_counter() - begin)


def _silent(text: str, fraction: float) -> None:
    """No progress wanted."""


def _split(recording: Recording, commands: list[str]) -> Split:
    moving = [c for c in commands if c in recording.channels and np.ptp(recording[c]) > 0]
    return default_split(recording, drive=moving[0] if moving else None)


def _insufficient(graph: BondGraph, data: Data) -> str:
    n_free = sum(not p.fixed for p in graph.parameters.values())
    needed = max(30, 5 * n_free)
    train = int(data.mask("train").sum())
    if train < needed or data.mask("test").sum() < 8:
        return (
            f"{data.n} samples are too few for {n_free} parameters: record at least "
            f"{2 * needed} samples"
        )
    still = [n for c, n in enumerate(data.names) if np.ptp(data.readings[:, c]) == 0]
    if len(still) == len(data.names):
        return f"the output {', '.join(still)} is constant: excite the system and check the sensor"
    return ""


def _nothing_moves(data: Data) -> str:
    if any(np.ptp(u) > 0 for u in data.commands.values()):
        return ""
    if (data.readings.std(axis=0) > 1.5 * data.floor).any():
        return ""
    return "the commands are constant and the readings only noise: excite the system"


def integrates(graph: BondGraph) -> bool:
    """Whether a constant command makes an output run away (an eigenvalue at zero)."""
    compiled = compile_model(graph)
    parts = blocks(compiled, np.asarray(compiled.matrices(compiled.nominal()).full(), float))
    if not parts.a.size:
        return False
    size = np.sqrt(np.abs(parts.a).max()) or 1.0
    values = np.linalg.eigvals(parts.a)
    return bool((np.abs(values) < 1e-9 * max(np.abs(values).max(), size)).any())


def nominal_fit(graph: BondGraph, data: Data, hold: str | None = None) -> tuple[Problem, Fit]:
    """Fit the model as it is; returns the problem to start candidates from, and the fit.

    Integrating plants are scored on windows with their own initial state, because their free run
    only shows how far the drift has gone. Others are tried from the declared values, and through
    short windows that have no wrong minima when a resonance starts at the wrong frequency.
    """
    runs_away = integrates(graph)
    train = int(data.mask("train").sum())
    window = max(100, min(500, train // 20)) if runs_away else None
    base = Problem(graph, data, window=window, source_offsets=runs_away)
    first = _first_fit(base)
    choices = (hold,) if hold else HOLDS
    fits = {}
    for h in choices:
        problem = replace(base, data=replace(data, hold=h), n_sub=2 if h == "band-limited" else 1)
        fits[h] = fit(problem, start=first.point, max_iterations=25)
    # linear unless another behaviour halves the misfit: a missing lag imitates a held command
    chosen = min(fits, key=lambda h: fits[h].cost * (0.5 if h == "linear" else 1.0))
    result = fits[chosen]
    problem = result.problem
    if chosen == "band-limited":
        finer = fit(replace(problem, n_sub=4), start=result.point, max_iterations=25)
        if finer.cost < 0.98 * result.cost:
            problem, result = finer.problem, finer
    return problem, result


def _first_fit(base: Problem) -> Fit:
    fits = [fit(base, max_iterations=25)]
    if base.window is None and base.compiled.n_w == 0:
        dynamics = base.compiled.n_x
        length = max(24, 8 * dynamics)
        train = base.data.split.train
        span = (train.stop or base.data.n) - (train.start or 0)
        few = slice(train.start or 0, min(train.stop or base.data.n, (train.start or 0) + 3000))
        values: dict[str, float] = {}
        while length < span // 3 and length < 1000:
            short = replace(
                base, data=replace(base.data, split=replace(base.data.split, train=few)),
                window=length, starts=values,
            )  # fmt: skip
            found = fit(short, max_iterations=12)
            if found.status is Status.BROKEN:
                break
            values = {k: v for k, v in found.values.items() if k in base.graph.parameters}
            length *= 4
        if values:
            fits.append(fit(replace(base, starts=values), max_iterations=25))
    result = best(fits)
    return (
        replace(result, problem=result.problem)
        if result.problem is base
        else _rebased(base, result)
    )


def _rebased(base: Problem, result: Fit) -> Fit:
    """Express the fit from the declared start values, so that points can be shared."""
    point = result.point
    theta = point.theta.copy()
    for i, f in enumerate(base.free):
        value = result.values[f.parameter.name]
        theta[i] = np.log(value / f.start) if f.log else (value - f.start) / f.scale
    return replace(result, problem=base, point=replace(point, theta=theta))


def _thinned(template: Problem, nominal: Fit, seen: Scene, options: Options) -> tuple[Problem, Fit]:
    """Problem for the search on thinned data, and the nominal fit on the same data."""
    factor = thinning(template.data, options.samples)
    states = [str(s.symbol) for s in template.compiled.space.states]
    known = {n: nominal.point.states[:, i] for i, n in enumerate(states)}
    offsets = tuple(float(v) for v in nominal.point.theta[slots(template).offsets])
    start: dict[str, Any] = {
        "starts": dict(nominal.values),
        "known_states": known,
        "known_offsets": offsets,
    }
    if factor == 1:
        return replace(template, graph=seen.graph, **start), nominal
    window = template.window and max(template.window // factor, 16)
    thin = replace(template, data=template.data.thinned(factor), window=window)
    base = replace(thin, graph=seen.graph, **start)
    return base, fit(
        replace(thin, known_states=known),
        start=_lags_scaled(nominal, thin, factor),
        max_iterations=8,
    )


def _lags_scaled(f: Fit, problem: Problem, factor: float) -> Point:
    """Return the point of a fit on another sampling grid: lags and delays count samples."""
    at = slots(problem)
    theta = f.point.theta.copy()
    theta[at.lags] /= factor
    theta[at.delays] /= factor
    return Point(theta, f.point.states)


def _on_full_data(decision: Decision, template: Problem) -> Decision:
    """Refit the chosen effect on all samples, and with what the commands do between them.

    The behaviour between samples is chosen again here: beside a large misfit it does not show.
    """
    chosen = decision.chosen
    if chosen is None:
        return decision
    old = chosen.fit
    factor = max(1, round(template.data.n / old.problem.data.n))
    fits = [old] if factor == 1 else []
    for hold in dict.fromkeys((template.data.hold, *HOLDS)):
        if factor == 1 and hold == old.problem.data.hold:
            continue
        n_sub = max(old.problem.n_sub // factor, 4 if hold == "band-limited" else 1)
        data = replace(template.data, hold=hold)
        problem = replace(old.problem, data=data, window=template.window, n_sub=n_sub)
        point = _lags_scaled(old, problem, 1 / factor)
        if len(windows(problem)) != old.point.states.shape[0]:
            problem = replace(problem, known_states={})
            point = Point(point.theta, start_point(problem).states)
        fits.append(fit(problem, start=point, max_iterations=10))
    sound = [
        f
        for f in fits
        if f.status is not Status.BROKEN
        and np.isfinite(f.simulated[template.data.mask("test")]).all()
    ]
    if not sound:
        return decision
    first = sound[0]
    result = min(sound, key=lambda f: f.cost * (1.0 if f is first else 1.03))
    trial = replace(
        chosen,
        fit=result,
        train=result.chi2("train"),
        test=result.chi2("test"),
        blocks=blocks_of(result),
    )
    return replace(decision, chosen=trial)


def _declared_fit(template: Problem, nominal: Fit) -> Fit:
    names = [n for n in template.graph.parameters if not n.startswith("offset_")]
    return fit(replace(template, fixed=tuple(names), starts={}), max_iterations=10)


def _notes(problem: Problem) -> tuple[str, ...]:
    notes = [
        f"commands between samples: {problem.data.hold}",
        f"held out: {problem.data.split.rule}",
    ]
    if problem.window is not None:
        seconds = problem.window * problem.data.dt
        notes.append(
            f"the model integrates: it is scored on windows of {seconds:.3g} s, each from its own "
            "initial state"
        )
    return tuple(notes)


def advice(d: Diagnosis, frequencies: Array) -> tuple[str, ...]:
    """Return what to record next, computed from the structure."""
    if d.decision is None or d.decision.chosen is None or d.scene is None or d.structure is None:
        if d.kind == "unknown_physics":
            if beyond := _beyond_training(d):
                return (beyond,)
            return (
                "no effect of the catalogue fits: record a slow large sweep and a step with a "
                "rest after it",
            )
        return ()
    chosen, lines = d.decision.chosen, []
    same = list(dict.fromkeys(t.element for t in d.decision.same_place))
    for signal, junction, split in splitting_signals(
        d.scene.fitted, chosen.element, same, frequencies
    )[:1]:
        lines.append(
            f"record {_signal_name(d.scene.graph, signal, junction)} (the "
            f"{'flow' if signal.startswith('f_') else 'effort'} at {junction}): it separates "
            f"{chosen.element} from {', '.join(split)}"
        )
    for name in same:
        if isinstance(d.graph[name], Source):
            lines.append(
                f"record what {name} really puts out beside its command: it separates "
                f"{chosen.element} from {name}"
            )
    effects = sorted({t.effect for t in d.decision.rivals})
    if effects:
        lines.append(
            f"to separate {chosen.effect} from {', '.join(effects)}: record the same "
            "command at half the "
            "amplitude and at a third of the speed"
        )
    return tuple(lines)


def _beyond_training(d: Diagnosis) -> str:
    """Word when the held-out commands leave the range of the training part."""
    if d.data is None or d.nominal is None:
        return ""
    for n, u in d.data.commands.items():
        train, test = u[d.data.mask("train")], u[d.data.mask("test")]
        margin = 0.05 * float(np.ptp(train))
        if test.min() < train.min() - margin or test.max() > train.max() + margin:
            return (
                f"{n} runs from {test.min():.4g} to {test.max():.4g} in the held-out part but "
                "only from "
                f"{train.min():.4g} to {train.max():.4g} in training: record the whole range in "
                "both"
            )
    return ""


def _signal_name(graph: BondGraph, signal: str, junction: str) -> str:
    """Usual word for a junction's variable, from the unit of a source at it."""
    units = {
        s.unit
        for b in graph.bonds_of(junction)
        for s in [graph[b.tail], graph[b.head]]
        if isinstance(s, Source)
    }
    if "V" in units and signal.startswith("f_"):
        return "the current i"
    mechanical = any(
        isinstance(graph[n], I) and getattr(graph[n], "unit", "") == "kg"
        for b in graph.bonds_of(junction)
        for n in (b.tail, b.head)
    )
    if mechanical and signal.startswith("f_"):
        return "the velocity v"
    return f"the signal {signal}"


def element_kind(graph: BondGraph, name: str) -> str:
    """Kind of an element in the words of the verdict."""
    e = graph[name]
    for types, word in (
        (C, "storage"), (R, "resistor"), (I, "inertia"), (TwoPort, "transformer"),
        (Source, "source"), (Sensor, "sensor"),
    ):  # fmt: skip
        if isinstance(e, types):
            return word
    return "junction"
