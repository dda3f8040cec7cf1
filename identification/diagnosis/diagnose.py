"""The whole diagnosis: floor, nominal fit, screening, search, decision, repair, and once more."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from time import monotonic, perf_counter
from typing import Any

import numpy as np

from bondgraph.drawing.panels import Panels
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.checking import require_graph
from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.split import kept_back
from bondgraph.support.deadline import Deadline
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.notice import Heard, Notice
from bondgraph.support.parallel import ending
from bondgraph.support.spelled import spelled
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.conclusion import (
    QUIET,
    all_named,
    judged,
    kind_of,
    last_named,
    unexplained,
    unforetold,
)
from identification.diagnosis.evidence.disturbed import disturbed
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.judged import judged_on
from identification.diagnosis.evidence.remaining import Remaining, remaining
from identification.diagnosis.explanation import presentation
from identification.diagnosis.explanation.characterisation import Character
from identification.diagnosis.explanation.constant_load import ConstantLoad, constant_load
from identification.diagnosis.explanation.doubts import at_once, file_first, settled
from identification.diagnosis.explanation.latent_signal import Latent
from identification.diagnosis.explanation.next_experiment import Experiment, experiments_of
from identification.diagnosis.explanation.notes import notes_of, tied_in
from identification.diagnosis.localisation.blind_relations import BlindRelation
from identification.diagnosis.localisation.places_without_name import places_of
from identification.diagnosis.localisation.regions import Region, regions
from identification.diagnosis.localisation.structural_classes import (
    Isolability,
    excited_frequencies,
    structure,
)
from identification.diagnosis.screening.clipped import clipped
from identification.diagnosis.screening.mixups import NOISE, mixups
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.screening.undoing import Mixup, what_to_do
from identification.diagnosis.screening.values_back import gives_way, told_by_values
from identification.diagnosis.search.asked import Asked, Given, asked_of
from identification.diagnosis.search.base import declared_fit, thinned
from identification.diagnosis.search.candidates import Candidate, DiagnosisOptions
from identification.diagnosis.search.forward_selection import steps
from identification.diagnosis.search.hold_choice import with_best_hold
from identification.diagnosis.search.material import Material, material_of
from identification.diagnosis.search.nominal import (
    LONG,
    as_searched,
    deepest,
    held_to_residual,
    nominal_fit,
    seen_in_training,
    split_that_shows,
)
from identification.diagnosis.search.refining import WRITING, completed, finely
from identification.estimation.leaning import Leaning, leanings
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm
from identification.study.data import Data
from identification.study.study import Study
from identification.uncertainty.tied import Tied

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False, repr=False)
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
    mistakes : tuple of Mixup
        What looks wrong with the recording itself, the likeliest first; no physics was tried then.
    doubted : tuple of Mixup
        Mistakes that the fitted values make up for, to the noise.
    tied : tuple of Tied
        Parameters of the last fit that the recording tells only together, as a sum or a product.
    written : callable
        Writes a remedy for its reader: arguments of Python as they are, or a shell's options.

    Examples
    --------
    >>> (step,) = found.findings
    >>> step.answer, step.chosen.effect, step.chosen.element
    ('exact', 'coulomb_friction', 'd')
    >>> round(found.repaired.values["F_c_d"], 2)
    0.8
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
    mistakes: tuple[Mixup, ...] = ()
    doubted: tuple[Mixup, ...] = ()
    tied: tuple[Tied, ...] = ()
    written: Callable[[str], str] = str

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
        return last_named(self.steps, self.kind)

    @property
    def stopped(self) -> str:
        """The note on a search that Ctrl-C ended, or its time; empty where it has ended itself."""
        return next((n for n in (STOPPED, STOPPED_AT_ONCE) if n in self.notes), "")

    @cached_property
    def leanings(self) -> tuple[Leaning, ...]:
        """Offsets, lags, gains and clocks that the last fit makes use of, where it explains all."""
        last = self.repaired or (None if self.kind == "unknown_physics" else self.nominal)
        return () if last is None or self.mistakes else leanings(last)

    @cached_property
    def load(self) -> ConstantLoad | None:
        """What one constant effort may stand for where the last fit leans on several offsets."""
        last = self.repaired or self.nominal
        return constant_load(last, self.leanings) if last is not None and self.leanings else None

    @property
    def study(self) -> Study:
        """The same study with the repaired model (as it is, where nothing was named).

        It begins where the fit ended, with its noise, its bounds, its sub-steps and what it takes
        the commands to do between samples: `estimate`, `profiles` and `judge` go on from there. A
        memory's thresholds stay as they were chosen: `estimate` notes which values rest on them.

        Raises
        ------
        UnusableInput
            Nothing was fitted.
        """
        last = self.repaired or self.nominal
        if last is None or self.asked is None:
            raise UnusableInput(f"{self.model}: nothing was fitted ({self.kind}), nothing to study")
        return self.asked.again(last)

    def __repr__(self) -> str:
        """Verdict in words."""
        return presentation.text(self)

    def _repr_html_(self) -> str:
        return presentation.cell(self)

    def plot(self) -> Panels:
        """Draw readings and what is left of them, before and after; returns axes, (n_y, 2)."""
        return presentation.plotted(self)

    def to_pandas(self) -> Any:
        """Return one row a finding (needs pandas)."""
        return presentation.table(self)

    def report(self, folder: str | Path = ".") -> Path:
        """Write ``report.html`` and ``verdict.json`` into `folder`; returns the page's path."""
        return presentation.written(self, folder)


STOPPED = "stopped before the search had ended: what else is missing was not looked for"
"""Note of a diagnosis that Ctrl-C ended, or its time."""
STOPPED_AT_ONCE = (
    "stopped before the first step of the search had ended: whether a law explains what the model "
    "leaves was not decided"
)
"""Note of one that ended with the model as it is."""


@spelled
def diagnose(
    graph: BondGraph | Study,
    recording: Given | Sequence[Given] | None = None,
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
    time: float | None = None,
    map: Mapping[str, str] | None = None,
) -> Diagnosis:
    """Diagnose the mismatch between `graph` and `recording`.

    Parameters
    ----------
    graph : BondGraph or Study
        Model with sensors; sources and sensors name the channels of `recording`. A study brings its
        recordings, and says what is free, fixed, known before and added by the measuring chain.
    recording : Recording, path, DataFrame or a sequence of them, optional
        Of a file or a frame channels are taken by name, or by unit where that leaves one choice.
        Several ones of the same system (other levels, other commands) are used together; the last
        third of them is held out.
    split : Split, optional
        Training and held-out samples; if not given, every third stretch (of few samples the end).
    limits : Thresholds, optional
        Limits of the decision.
    hold : {"hold", "hold-after", "linear", "band-limited"}, optional
        Behaviour of the commands between samples; chosen on the training part when not given.
    noise : mapping of str to float, optional
        Standard deviation of the noise of sensors, SI, where it is known better than the recording
        tells it; what the recording declares (`meta["noise"]`) holds for the others.
    known : sequence of Decision, optional
        Effects that were named on another division of the same recording: the search goes on
        beside them.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1; a text that is to stay is a `Notice`.
        KeyboardInterrupt, from there or from the keyboard, ends the search with the effects that
        were named before; it is passed on before the model as it is has been fitted.
    time : float, optional
        Seconds after which the search ends with what was named by then, as ``--time`` of the
        command line. (The column of the time is the one called so, or that of ``map={"t": ...}``.)
    map : mapping of str to str, optional
        Name in the model -> column, where these differ, as ``--map`` of the command line:
        `{"x": "displacement[um]"}`.

    Raises
    ------
    GraphError, UnusableInput
        The model or the channels cannot be used, or the time was over before the model as it is
        had been fitted; one line says why.

    Examples
    --------
    >>> [step.chosen.label for step in found.findings]  # found = diagnose(graph, rubbing)
    ['coulomb_friction at d']
    """
    if time is not None:
        again = partial(
            diagnose, graph, recording, split, model=model, options=options, limits=limits,
            hold=hold, noise=noise, seed=seed, known=known, map=map,
        )  # fmt: skip
        return _in_time(again, progress or _silent, time)
    begin = perf_counter()
    say = Heard(progress or _silent)
    options, limits = options or DiagnosisOptions(), limits or Thresholds()
    if not isinstance(graph, Study):
        require_graph(graph, "diagnose(graph, recording)", "a BondGraph or a Study")
    asked = asked_of(graph, recording, split, hold, noise or {}, map or {})
    if asked.hold:
        options = replace(options, holds=(asked.hold,))
    say("reading the noise floor", 0.01)
    material = material_of(asked)
    result = Diagnosis(
        "insufficient_data", model or asked.graph.name, material.recording, asked.graph,
        seed=seed, limits=limits, asked=asked,
    )  # fmt: skip
    if material.reason:
        notes = (material.reason, *material.recording.notes)
        made = replace(result, notes=notes, advice=(material.reason,))
    else:
        # tiny matrices: threads of the linear algebra only get in each other's way
        with calm(), ending():
            made = _diagnosed(result, material, options, say, tuple(known))
        made = settled(made, say.notices)
    say("done", 1.0)
    return replace(made, seconds=perf_counter() - begin)


def _in_time(made: Callable[..., Diagnosis], say: Progress, seconds: float) -> Diagnosis:
    """Diagnose, and end the search after so many seconds."""
    if not 0.0 < seconds < float("inf"):
        raise UnusableInput(f"time = {seconds!r}: give the seconds after which the search ends")
    deadline = Deadline(say, monotonic() + seconds)
    try:
        with deadline:
            return made(progress=deadline)
    except KeyboardInterrupt:
        if not deadline.over:
            raise
        raise UnusableInput(
            f"the {seconds:g} s were over before the model as it is had been fitted; give more time"
        ) from None


def _diagnosed(
    result: Diagnosis,
    material: Material,
    options: DiagnosisOptions,
    say: Progress,
    known: tuple[Decision, ...],
) -> Diagnosis:
    """Fit the model as it is, search what is missing, and say what was found."""
    asked = result.asked
    assert asked is not None
    say("fitting the model as it is", 0.03)
    nominal, whole = _nominal(result, material, options.holds)
    # what is shown as gained comes from samples that no choice has seen
    seen, unseen = kept_back(whole)
    nominal = judged_on(nominal, seen)
    template, data = nominal.problem, nominal.problem.data
    declared = declared_fit(template, nominal)
    result = replace(result, data=data, declared=declared, nominal=nominal)
    try:
        say("looking for channels that are mixed up", 0.06)
        back = () if known else told_by_values(result.graph, nominal)
        if back and min(m.after for m in back) <= NOISE < nominal.chi2("test"):
            return _mistaken(result, back)
        mistakes = clipped(nominal) or (() if back else mixups(result.graph, nominal, options.jobs))
        if any(m.kind != "dead" for m in mistakes):
            return _mistaken(result, mistakes)
        result = replace(result, doubted=back)
        # what is evident now need not wait for the search; one on finer stretches says it again
        for sentence in () if known else at_once(result.graph, nominal, mistakes, back):
            say(Notice(sentence), 0.07)
        base = thinned(template, nominal, options)
        frequencies = excited_frequencies(list(data.commands.values()), data.dt)
        own = {n: v for n, v in base.fit.values.items() if n in base.fit.problem.graph.parameters}
        classes = structure(base.fit.problem.graph.with_values(own), frequencies)
    except KeyboardInterrupt:
        return _undecided(result, material, whole, unseen, say)
    made = steps(base, options, result.limits, classes, say, tuple(material.given), known)
    result = replace(
        result, scene=made.scene, ranking=made.ranking, relations=made.relations, structure=classes
    )
    if not made.decisions:
        return _undecided(result, material, whole, unseen, say)
    if made.base is not base:  # the search has shown a better fit, or less noise
        nominal = as_searched(nominal, made.base.fit)
        declared = declared_fit(nominal.problem, nominal)
    stopped = made.stopped
    if not stopped:
        finer, stopped = on_finer_stretches(result, material, options, say, made.decisions)
        if finer is not None:
            told = replace(finer, doubted=back)
            to_record = (a for a in finer.advice if a not in file_first(finer))
            told = replace(told, advice=(*file_first(told), *to_record))
            return _mistaken(told, back) if gives_way(finer.kind, back) else told
    decisions, stopped = completed(made.decisions, template, options, result.limits, say, stopped)
    kind = kind_of(made.decisions, judged_on(declared, unseen), judged_on(nominal, unseen))
    coarse = ""
    if not (stopped or asked.disturbed):  # a filter has sub-steps of its own
        decisions, nominal, coarse = finely(decisions, kind, nominal)
    declared, nominal = judged_on(declared, unseen), judged_on(nominal, unseen)
    decisions = tuple(judged(d, unseen, data.n) for d in decisions)
    last = last_named(decisions, kind) or nominal
    together = tied_in(last, all_named(decisions, kind), nominal)
    result = replace(result, data=nominal.problem.data, declared=declared, nominal=nominal)
    if (mistakes and kind != "missing_physics") or gives_way(kind, back):
        # a reading that follows nothing may still follow a law; only then it is not dead
        return _mistaken(result, back or mistakes)
    result = replace(
        result, kind=kind, steps=decisions, trials=decisions[0].trials,
        experiments=experiments_of(decisions), tied=together,
        notes=asked.notes_of(last) + (STOPPED,) * stopped + (coarse,) * bool(coarse) + notes_of(
            material, nominal, last, () if stopped else options.holds, known,
            all_named(decisions, kind), together,
        ),
    )  # fmt: skip
    result = _with_rest(result, whole)
    if asked.disturbed:
        say("judging by one-step predictions", 0.97)
        result = _predicted(result, options, unseen)
    elif result.kind in QUIET and (said := unforetold(nominal)):
        result = replace(result, kind="insufficient_data", notes=(*said, *result.notes))
    result = replace(result, regions=_where(result, whole))
    from identification.diagnosis.explanation.advice import advice

    return replace(result, advice=advice(result, frequencies))


def _undecided(
    result: Diagnosis, material: Material, whole: Split, unseen: Split, say: Progress
) -> Diagnosis:
    """Report what the model as it is leaves, where a search was stopped in its first step.

    Noise is no proof that nothing is missing: nothing was looked for.
    """
    say("writing up what was found", WRITING)
    assert result.declared is not None
    assert result.nominal is not None
    assert result.asked is not None
    declared, nominal = judged_on(result.declared, unseen), judged_on(result.nominal, unseen)
    left = remaining(judged_on(nominal, whole))
    noise = left.is_noise(result.limits.noise)
    step = Decision(
        "explained" if noise else "unknown_physics", None, (), (), 0.0, 0.0,
        (f"{left.words}: {'that may be noise' if noise else 'that is no noise'}",),
        remaining=left, nominal=nominal.chi2("test"),
    )  # fmt: skip
    said = notes_of(material, nominal, nominal, (), ())
    return replace(
        result, kind="insufficient_data" if noise else step.kind, data=nominal.problem.data,
        declared=declared, nominal=nominal, steps=(step,), left=left,
        scene=result.scene or scene(nominal), regions=regions(nominal),
        notes=(STOPPED_AT_ONCE, *result.asked.notes_of(nominal), *said),
        advice=("let the search end: give it more time, or look for one effect (--effects 1)",),
    )  # fmt: skip


def _nominal(result: Diagnosis, material: Material, holds: Sequence[str]) -> tuple[Fit, Split]:
    """Fit the model as it is; returns the samples too that the fit leaves out."""
    assert result.asked is not None
    asked = result.asked
    problem = asked.problem(material.data)
    nominal = nominal_fit(asked.graph, material.data, asked.hold, problem)[1]
    if nominal.status is FitStatus.BROKEN or not np.isfinite(nominal.cost):
        raise UnusableInput(
            f"{asked.graph.name} cannot be simulated on {material.recording.name}: the outputs are "
            "not finite; check parameter values, signs and units"
        )
    read = nominal.problem.data.floor
    nominal = deepest(nominal, held_to_residual(nominal, material.given), asked.problem, asked.hold)
    nominal = held_to_residual(nominal, material.given)
    if (nominal.problem.data.floor < read).any():  # beside less noise another hold may be right
        nominal = with_best_hold(nominal, LONG, holds)
    if material.usual:
        nominal = seen_in_training(problem, nominal, asked.hold, result.limits.noise)
    return nominal, nominal.problem.data.split


def on_finer_stretches(
    result: Diagnosis,
    material: Material,
    options: DiagnosisOptions,
    say: Progress,
    decisions: Sequence[Decision],
) -> tuple[Diagnosis | None, bool]:
    """Diagnose again where another effect hides in held-out stretches beside what was named.

    Returns what was found, if more was, and whether that search was stopped without it.
    """
    named = [d for d in decisions if d.kind == "missing_physics" and d.chosen]
    last = named[-1].chosen if named else None
    if not material.usual or last is None or len(named) >= options.effects:
        return None, False
    if last.fit.problem.data.n != material.recording.n:
        return None, False
    finer, asked = split_that_shows(last.fit, result.limits.noise), result.asked
    if finer is None or asked is None:
        return None, False
    try:
        again = diagnose(
            asked.study, None, finer,
            model=result.model, options=options, limits=result.limits, hold=asked.hold,
            noise=material.given, seed=result.seed, known=named,
            progress=lambda text, part: say(text, 0.8 + 0.099 * part),
        )  # fmt: skip
    except KeyboardInterrupt:
        return None, True
    except BondsightError:
        return None, False
    if again.kind == "missing_physics" and len(again.findings) >= len(named):
        return again, False
    return None, bool(again.stopped)


def _with_rest(result: Diagnosis, whole: Split) -> Diagnosis:
    """Say what is left, and unsay that nothing is missing if that is no noise.

    Whether it is noise is no gain: all that is held out says it.
    """
    last = result.repaired or result.nominal
    assert last is not None
    assert result.scene is not None
    last = judged_on(last, whole)
    left = remaining(last)
    same = last.problem.data.n == result.scene.data.n  # else the search worked on thinned samples
    loud = left.most > result.limits.noise
    where = regions(last, result.scene if same else None) if loud else ()
    if result.kind in QUIET and not left.is_noise(result.limits.noise):
        steps = (*result.steps[:-1], unexplained(result.steps[-1], left))
        result = replace(result, kind="unknown_physics", steps=steps)
    steps = (*result.steps[:-1], result.steps[-1].with_rest(left))
    return replace(result, left=left, regions_left=where, steps=steps)


def _where(result: Diagnosis, whole: Split) -> tuple[Region, ...]:
    """Return where the model as it is fails, in the variables of what was found first.

    On all samples, whatever the search has worked on: terminal and page say the same.
    """
    assert result.nominal is not None
    shown, seen = judged_on(result.nominal, whole), result.scene
    if seen is None or seen.data.n != shown.problem.data.n:
        seen = scene(shown)
    named = [s.chosen.element for s in result.findings if s.chosen is not None]
    if result.kind == "unknown_physics":
        named = list(places_of(result.steps[0], result.structure)[:1])
    return regions(shown, seen, named)


def _predicted(result: Diagnosis, options: DiagnosisOptions, unseen: Split) -> Diagnosis:
    """Judge by one-step predictions what free runs have found beside process noise."""
    assert result.asked is not None
    assert result.nominal is not None
    assert result.declared is not None
    made = disturbed(result.asked.about, result.nominal, result.steps, result.limits, options.jobs)
    decisions = tuple(judged(d, unseen, result.nominal.problem.data.n) for d in made.decisions)
    left = Remaining(dict(made.last.over_noise), True, 0.0)
    note = (
        "free runs wander off under process noise: what is missing was judged by one-step "
        f"predictions, with process noise at {made.last.levels}"
    )
    return replace(
        result, kind=kind_of(decisions, result.declared, result.nominal), steps=decisions,
        experiments=experiments_of(decisions), left=left, regions_left=(),
        notes=(*result.notes, note),
    )  # fmt: skip


def _mistaken(result: Diagnosis, mistakes: tuple[Mixup, ...]) -> Diagnosis:
    """Report a recording that looks mixed up; no physics is tried on it."""
    assert result.nominal is not None
    reasons = tuple(m.sentence for m in mistakes)
    step = Decision(
        "unknown_physics", None, (), (), 0.0, 0.0, reasons, nominal=result.nominal.chi2("test")
    )
    return replace(
        result, kind="unknown_physics", scene=scene(result.nominal), steps=(step,),
        mistakes=mistakes, regions=regions(result.nominal),
        notes=(*result.recording.notes, *reasons), advice=(what_to_do(mistakes),),
    )  # fmt: skip


def _silent(text: str, fraction: float) -> None:
    """No progress wanted."""
