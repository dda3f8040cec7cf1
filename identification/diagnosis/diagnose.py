"""The whole diagnosis: floor, nominal fit, screening, search, decision, repair, and once more."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Sensor
from bondgraph.signals.recording import Recording, Split, default_split
from bondgraph.signals.split import interleaved, kept_back
from bondgraph.support.errors import BondsightError, UnusableInput, unknown_name
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.remaining import Remaining, remaining
from identification.diagnosis.explanation.characterisation import Character, characterise
from identification.diagnosis.explanation.latent_signal import Latent, latent
from identification.diagnosis.explanation.next_experiment import Experiment, next_experiments
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.regions import Region, regions
from identification.diagnosis.localisation.structural_classes import (
    Isolability,
    excited_frequencies,
    structure,
)
from identification.diagnosis.screening.mixups import Mixup, mixups, moved, stuck
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.screening.tangent_space import freedom
from identification.diagnosis.search.asked import Asked, asked_of
from identification.diagnosis.search.base import declared_fit, thinned, unthinned
from identification.diagnosis.search.candidates import Candidate, DiagnosisOptions
from identification.diagnosis.search.forward_selection import SelectionStage, steps
from identification.diagnosis.search.nominal import (
    deeper,
    held_to_residual,
    hold_margin,
    nominal_fit,
    seen_in_training,
    split_that_shows,
)
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm
from identification.study.joined import joined, split_of
from identification.study.noise_floor import measured, noise_floor
from identification.study.problem import Data, Problem, data_for, drives
from identification.study.residual import windows
from identification.study.study import Study

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
    steps : tuple of Decision
        One for each effect that was named, and the last one that stopped the search.
    trials : tuple of Candidate
        All effects at all places of the first step, best held-out score first.
    ranking : tuple of Screened
        The linear screening of the first step.
    relations : tuple of BlindRelation
        Blind to one class of ports each, where something is missing and the model allows them.
    experiments : tuple of Experiment
        What would separate the effects that are still possible, the best first.
    traits : dict of str to (Character, Latent)
        What the missing signal looks like at the likeliest ports; made by `characterised`.
    limits : Thresholds
        Limits by which it was decided.
    left : Remaining or None
        What the last fit leaves of every reading.
    regions_left : tuple of Region
        Where in the recording it leaves it.
    asked : Asked or None
        The statement that was diagnosed.
    """

    kind: str
    model: str
    recording: Recording
    graph: BondGraph
    data: Data | None = None
    declared: Fit | None = None
    nominal: Fit | None = None
    scene: FittedModel | None = None
    steps: tuple[Decision, ...] = ()
    trials: tuple[Candidate, ...] = ()
    ranking: tuple[Screened, ...] = ()
    regions: tuple[Region, ...] = ()
    structure: Isolability | None = None
    relations: tuple[BlindRelation, ...] = ()
    experiments: tuple[Experiment, ...] = ()
    traits: Mapping[str, tuple[Character, Latent]] = field(default_factory=dict)
    advice: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    seed: int = 0
    limits: Thresholds = field(default_factory=Thresholds)
    left: Remaining | None = None
    regions_left: tuple[Region, ...] = ()
    asked: Asked | None = None

    @property
    def decision(self) -> Decision | None:
        """The first decision."""
        return self.steps[0] if self.steps else None

    @property
    def findings(self) -> tuple[Decision, ...]:
        """Decisions that say something is missing, in the order they were found."""
        named = tuple(s for s in self.steps if s.kind == "missing_physics")
        if named or self.kind != "unknown_physics":
            return named
        return self.steps[:1]

    @property
    def repaired(self) -> Fit | None:
        """The fit with everything that was named, if anything was."""
        named = [s for s in self.steps if s.kind == "missing_physics" and s.chosen]
        if self.kind == "missing_physics" and named and named[-1].chosen:
            return named[-1].chosen.fit
        return None

    @property
    def study(self) -> Study:
        """The same study with the repaired model (as it is, where nothing was named).

        It begins at the fitted values: `estimate`, `profiles` and `judge` go on from there.

        Raises
        ------
        UnusableInput
            Nothing was fitted.
        """
        last = self.repaired or self.nominal
        if last is None or self.asked is None:
            raise UnusableInput(f"{self.model}: nothing was fitted ({self.kind}), nothing to study")
        return self.asked.about(last)


def diagnose(
    graph: BondGraph | Study,
    recording: Recording | Sequence[Recording] | None = None,
    split: Split | None = None,
    *,
    model: str = "",
    options: DiagnosisOptions | None = None,
    limits: Thresholds | None = None,
    hold: str | None = None,
    noise: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    seed: int = 0,
    known: Sequence[Decision] = (),
) -> Diagnosis:
    """Diagnose the mismatch between `graph` and `recording`.

    Parameters
    ----------
    graph : BondGraph or Study
        Model with sensors; sources and sensors name the channels of `recording`. A study brings its
        recordings, and says what is free, fixed, known before and added by the measuring chain.
    recording : Recording or sequence of Recording, optional
        Several ones of the same system (other levels, other commands) are used together; the last
        third of them is held out.
    split : Split, optional
        Training and held-out samples; the stated default rule when not given.
    limits : Thresholds, optional
        Limits of the decision.
    hold : {"hold", "linear", "band-limited"}, optional
        Behaviour of the commands between samples; chosen on the training part when not given.
    noise : mapping of str to float, optional
        Standard deviation of the noise of sensors, SI, where it is known better than the recording
        tells it; what the recording declares (`meta["noise"]`) holds for the others.
    known : sequence of Decision, optional
        Effects that were named on another division of the same recording: the search goes on
        beside them.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1.

    Raises
    ------
    GraphError, UnusableInput
        The model or the channels cannot be used; one line says why.
    """
    begin = time.perf_counter()
    options, limits = options or DiagnosisOptions(), limits or Thresholds()
    asked = asked_of(graph, recording, split, hold, noise or {})
    graph, parts, split, hold = asked.graph, asked.recordings, asked.split, asked.hold
    if hold:
        options = replace(options, holds=(hold,))
    say = progress or _silent
    graph.require_sound()
    if not graph.of_type(Sensor):
        raise UnusableInput(
            f"{graph.name} has no sensor: attach a De, Df or Dq whose name is the measured channel"
        )
    recording, breaks = joined(parts)
    say("reading the noise floor", 0.01)
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    commands = [s.name for s in drives(graph)]
    result = Diagnosis(
        "insufficient_data",
        model or graph.name,
        recording,
        graph,
        seed=seed,
        limits=limits,
        asked=asked,
    )
    ours = split is None and not breaks
    split = split or (split_of(parts) if breaks else _split(recording, commands))
    data = data_for(graph, recording, split, dict.fromkeys(sensors, 1.0))
    coarse = recording.meta.get("resolution") or {}
    data = replace(data, breaks=breaks, resolution=coarse if isinstance(coarse, Mapping) else {})
    if reason := _insufficient(asked.n_free, data) or "; ".join(stuck(data)):
        return replace(
            result, notes=(reason,), advice=(reason,), seconds=time.perf_counter() - begin
        )
    noise = declared_noise(recording, sensors) | dict(asked.noise)
    read = noise_floor(recording, split, sensors, tuple(commands), breaks)
    floor = read | given_noise(noise, sensors, graph.name)
    open_ones = tuple(n for n in sensors if n not in noise)
    sure = not open_ones or measured(recording, split, open_ones, tuple(commands), breaks)
    data = replace(data, floor=np.array([floor[n] for n in sensors]), floor_measured=sure)
    if reason := _nothing_moves(data):
        return replace(
            result, notes=(reason,), advice=(reason,), seconds=time.perf_counter() - begin
        )
    # tiny matrices: threads of the linear algebra only get in each other's way
    with calm():
        say("fitting the model as it is", 0.03)
        base_problem = asked.problem(data)
        template, nominal = nominal_fit(graph, data, hold, base_problem)
        if nominal.status is FitStatus.BROKEN or not np.isfinite(nominal.cost):
            raise UnusableInput(
                f"{graph.name} cannot be simulated on {recording.name}: the outputs are not "
                "finite; check parameter values, signs and units"
            )
        nominal = held_to_residual(nominal, noise)
        if ours and recording.n >= LEAST_TO_INTERLEAVE:
            nominal = seen_in_training(base_problem, nominal, hold, limits.noise)
        # what is shown as gained comes from samples that no choice has seen
        whole, (seen, unseen) = nominal.problem.data.split, kept_back(nominal.problem.data.split)
        nominal = judged_on(nominal, seen)
        template, data = nominal.problem, nominal.problem.data
        floor = dict(zip(sensors, map(float, data.floor), strict=True))
        declared = declared_fit(template, nominal)
        result = replace(result, data=data, declared=declared, nominal=nominal)
        mistakes = mixups(graph, nominal, jobs=options.jobs)
        if any(m.kind != "dead" for m in mistakes):
            return replace(_mistaken(result, mistakes), seconds=time.perf_counter() - begin)
        base = thinned(template, nominal, options)
        frequencies = excited_frequencies(list(data.commands.values()), data.dt)
        classes = structure(base.fit.problem.graph.with_values(_own_values(base.fit)), frequencies)
        made = steps(base, options, limits, classes, say, noise, known)
        if made.base is not base:  # the search has shown a better fit of the model as it is
            base = made.base
            same = base.fit.problem.data.n == data.n
            nominal = base.fit if same else deeper(nominal, base.fit.values) or nominal
            result = replace(result, nominal=nominal)
        named = [d for d in made.decisions if d.kind == "missing_physics" and d.chosen]
        finer = (
            _hidden(named, recording.n, limits) if ours and len(named) < options.effects else None
        )
        if finer is not None:
            with suppress(BondsightError):
                again = diagnose(
                    asked.study or graph, None if asked.study else parts, finer, model=model,
                    options=options, limits=limits, hold=hold, noise=noise, seed=seed, known=named,
                    progress=lambda text, part: say(text, 0.9 + 0.1 * part),
                )  # fmt: skip
                if again.kind == "missing_physics" and len(again.findings) >= len(named):
                    return replace(again, seconds=time.perf_counter() - begin)
        say("fitting the repaired model on all training samples", 0.95)
        decisions = unthinned(made.decisions, template, options.holds)
        declared, nominal = judged_on(declared, unseen), judged_on(nominal, unseen)
        decisions = tuple(_shown(d, unseen, data.n) for d in decisions)
        data = nominal.problem.data
        result = replace(result, data=data, declared=declared, nominal=nominal)
        open_question = not any(d.kind == "missing_physics" for d in decisions)
        unknown = open_question and decisions[0].kind == "unknown_physics"
        experiments = _experiments(decisions[0]) if unknown else ()
    kind = _kind(made, declared, nominal)
    if mistakes and kind != "missing_physics":
        # a reading that follows nothing may still follow a law; only then it is not dead
        return replace(_mistaken(result, mistakes), seconds=time.perf_counter() - begin)
    result = replace(
        result, kind=kind, scene=made.scene,
        steps=decisions, trials=made.decisions[0].trials if made.decisions else (),
        ranking=made.ranking, regions=regions(base.fit, made.scene), structure=classes,
        relations=made.relations, experiments=experiments,
    )  # fmt: skip
    last = result.repaired or nominal
    with calm():
        notes = (
            *recording.notes, *_notes(template, options.holds, last),
            *_noise_notes(read, floor, sure, noise), *moved(nominal), *_resumed_notes(known),
        )  # fmt: skip
    last = judged_on(last, whole)  # whether it is noise is no gain: all that is held out says it
    left = remaining(last)
    same = last.problem.data.n == made.scene.data.n  # else the search worked on thinned samples
    where = regions(last, made.scene if same else None) if left.most > limits.noise else ()
    if kind in ("explained", "parameters_only") and not left.is_noise(limits.noise):
        result = replace(
            result,
            kind="unknown_physics",
            steps=(*decisions[:-1], _unexplained(decisions[-1], left)),
        )
    result = replace(result, left=left, regions_left=where, notes=notes)
    from identification.diagnosis.explanation.advice import advice

    result = replace(result, advice=advice(result, frequencies))
    say("done", 1.0)
    return replace(result, seconds=time.perf_counter() - begin)


def _hidden(named: Sequence[Decision], n: int, limits: Thresholds) -> Split | None:
    """Return finer stretches where another effect hides in held-out ones beside what was named."""
    last = named[-1].chosen if named else None
    if last is None or last.fit.problem.data.n != n:
        return None
    return split_that_shows(last.fit, limits.noise)


def judged_on(f: Fit, split: Split) -> Fit:
    """Return a fit whose errors are counted on other held-out samples."""
    problem = replace(f.problem, data=replace(f.problem.data, split=split), built=f.problem.engine)
    return replace(f, problem=problem)


def _shown(decision: Decision, split: Split, n: int) -> Decision:
    """Return a decision whose repair is judged by `split`, if it was fitted to all samples."""
    chosen = decision.chosen
    if chosen is None or chosen.fit.problem.data.n != n:
        return decision
    return replace(decision, chosen=replace(chosen, fit=judged_on(chosen.fit, split)))


def _unexplained(decision: Decision, left: Remaining) -> Decision:
    """Return a decision that found nothing, where samples that it has not seen say otherwise."""
    reason = f"nothing showed in what choices may look at, but {left.words}: that is no noise"
    return replace(decision, kind="unknown_physics", reasons=(reason,), remaining=left)


def _mistaken(result: Diagnosis, mistakes: tuple[Mixup, ...]) -> Diagnosis:
    """Report a recording that looks mixed up; no physics is tried on it."""
    assert result.nominal is not None
    reasons = tuple(m.sentence for m in mistakes)
    step = Decision(
        "unknown_physics", None, (), (), 0.0, 0.0, reasons, nominal=result.nominal.chi2("test")
    )
    either = " or ".join(m.claim for m in mistakes)
    return replace(
        result, kind="unknown_physics", scene=scene(result.nominal), steps=(step,),
        regions=regions(result.nominal), notes=(*result.recording.notes, *reasons),
        advice=(f"{either}: correct the recording and diagnose again",),
    )  # fmt: skip


WORTH = 0.5
"""Share of the excess that rivals must explain before telling them apart means anything."""


def _experiments(decision: Decision) -> tuple[Experiment, ...]:
    """Experiments that separate the best description from its rivals."""
    rivals = [t for t in decision.rivals if t.effect != "unknown"]
    if decision.chosen is None or not rivals or decision.share < WORTH:
        return ()
    asked = [decision.chosen, rivals[0]]
    try:
        return next_experiments([t.fit for t in asked], [t.label for t in asked])
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return ()


def characterised(d: Diagnosis, ports: int = 2) -> Diagnosis:
    """Return the diagnosis with what the missing signal looks like at its likeliest ports.

    The signal is rebuilt from the residual of the nominal fit by smoothing, no law assumed.
    """
    if d.scene is None or d.nominal is None or d.kind not in ("missing_physics", "unknown_physics"):
        return d
    step = d.findings[0] if d.findings else d.decision
    if step is None:
        return d
    names = list(dict.fromkeys(t.element for t in sorted(step.trials, key=lambda t: t.test)))
    probed, found = probes(d.scene.nominal), {}
    for name in [n for n in names if probed.knows(n)][:ports]:
        try:
            signal = latent(
                partial(probed.respond, name), d.scene.residual,
                d.scene.data.floor, d.scene.data.dt, tangents=freedom(d.scene.nominal),
                windows=windows(d.scene.nominal.problem), scored=d.scene.data.mask("train"),
            )  # fmt: skip
            found[name] = (characterise(d.scene.past[name], signal.signal), signal)
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
    return replace(d, traits=found)


def _kind(made: SelectionStage, declared: Fit, nominal: Fit) -> str:
    if any(d.kind == "missing_physics" for d in made.decisions):
        return "missing_physics"
    if any(d.kind == "unknown_physics" for d in made.decisions):
        return "unknown_physics"
    better = declared.chi2("test") > max(1.5 * nominal.chi2("test"), 1.3)
    return "parameters_only" if better else "explained"


def _own_values(f: Fit) -> dict[str, float]:
    return {n: v for n, v in f.values.items() if n in f.problem.graph.parameters}


def _silent(text: str, fraction: float) -> None:
    """No progress wanted."""


def _split(recording: Recording, commands: list[str]) -> Split:
    """Leading rest aside, every third of thirty stretches is held out.

    Levels, bands and slow changes then show in both parts, whatever the excitation.
    """
    moving = [c for c in commands if c in recording.channels and np.ptp(recording[c]) > 0]
    plain = default_split(recording, drive=moving[0] if moving else None)
    begin = plain.rest.stop if plain.rest is not None else 0
    if recording.n - begin < LEAST_TO_INTERLEAVE:
        return plain
    return replace(interleaved(begin, recording.n), rest=plain.rest)


LEAST_TO_INTERLEAVE = 600
"""Samples from which stretches of a thirtieth say something."""


def _insufficient(n_free: int, data: Data) -> str:
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


def declared_noise(recording: Recording, sensors: Collection[str]) -> dict[str, float]:
    """Return the noise that the recording itself declares for readings of the model."""
    known = recording.meta.get("noise")
    found = known if isinstance(known, Mapping) else {}
    try:
        return {n: float(found[n]) for n in sensors if n in found}
    except (TypeError, ValueError):
        raise UnusableInput(
            f"{recording.name}: what it says of its noise is no number; give --noise SENSOR=VALUE"
        ) from None


def given_noise(noise: Mapping[str, float], sensors: Sequence[str], model: str) -> dict[str, float]:
    """Return the noise that a user gives, checked.

    Raises
    ------
    UnusableInput
        A name is no sensor of the model, or a value is no positive number.
    """
    for name, value in noise.items():
        if name not in sensors:
            raise UnusableInput(str(unknown_name("sensor", name, model, sensors)))
        if not (np.isfinite(value) and value > 0):
            raise UnusableInput(
                f"noise of {name}: {value:g} is no standard deviation; give a positive number in "
                "the unit of the sensor (SI)"
            )
    return {n: float(v) for n, v in noise.items()}


def _resumed_notes(known: Sequence[Decision]) -> tuple[str, ...]:
    if not known:
        return ()
    names = ", ".join(d.chosen.label for d in known if d.chosen is not None)
    return (
        f"{names}: named on coarser stretches, whose training samples are among those that say "
        "what is gained",
    )


FAR_OFF = 3.0
"""Ratio of a given noise to the one read from the recording that is worth a word."""


def _noise_notes(
    read: Mapping[str, float], floor: Mapping[str, float], sure: bool, given: Collection[str] = ()
) -> tuple[str, ...]:
    notes = []
    for n, level in floor.items():
        if n not in given and level < read[n]:
            notes.append(
                f"the noise of {n} was read at {read[n]:.3g} (SI), but the model leaves no more "
                f"than {level:.3g}, so that is taken"
            )
        elif level != read[n] and not 1 / FAR_OFF < level / read[n] < FAR_OFF:
            notes.append(
                f"the noise given for {n} is {level:.3g}, the recording itself looks like "
                f"{read[n]:.3g} (SI): check it, the answer rests on it"
            )
    if not sure:
        notes.append(
            "the noise could only be estimated (no repetition and no rest in the recording): slow "
            "noise may lie above it; state what you know with --noise SENSOR=VALUE"
        )
    return tuple(notes)


def _notes(problem: Problem, holds: Sequence[str], last: Fit) -> tuple[str, ...]:
    notes = [
        f"commands between samples: {last.problem.data.hold} ({hold_margin(last, holds)})",
        f"held out: {last.problem.data.split.rule}",
    ]
    if problem.data.breaks:
        notes.append(
            "each recording starts from a state of its own; that of a held-out one is fitted to "
            "its samples, no parameter is"
        )
    return tuple(notes)
