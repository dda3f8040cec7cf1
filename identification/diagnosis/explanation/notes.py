"""What the reader of a diagnosis should know beside its answer."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from bondgraph.graph.elements import C, I, R
from bondgraph.support.errors import BondsightError
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.remaining import growing, remaining
from identification.diagnosis.explanation.colour import colour_notes, too_narrow
from identification.diagnosis.screening.mixups import in_doubt
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.search.hold_choice import hold_margin
from identification.diagnosis.search.material import Material
from identification.estimation.cautions import rough_rates
from identification.estimation.single_record import Fit, alone
from identification.report.words import listed, spaced
from identification.study.data import Data
from identification.uncertainty.fitted import fitted
from identification.uncertainty.postflight import practical_of
from identification.uncertainty.practical import Practical
from identification.uncertainty.tied import Tied, tied


def notes_of(
    material: Material,
    nominal: Fit,
    last: Fit,
    holds: Sequence[str],
    known: Sequence[Decision],
    named: Sequence[Candidate] = (),
    together: Sequence[Tied] = (),
) -> tuple[str, ...]:
    """Return the recording's own notes, and what was chosen or is doubtful.

    Parameters
    ----------
    nominal, last : Fit
        Of the model as it is, and of the last one that was made of it.
    holds : sequence of str
        Behaviours of the commands between samples that were possible; none where there is no time
        to compare them.
    known : sequence of Decision
        Effects that were named on another division.
    named : sequence of Candidate
        All effects that were named; `last` holds them.
    together : sequence of Tied
        Parameters that are told only together: their values tell nothing of a unit.
    """
    data, declared = nominal.problem.data, nominal.problem.graph.parameters
    floor = dict(zip(data.names, map(float, data.floor), strict=True))
    loose = taken_over(last, named) | {n for t in together for n in t.names}
    return (
        *in_doubt(last, declared, loose), *colour_notes(last, material.given),
        *(too_narrow(last) if named else ()),
        *material.recording.notes, *notes_on_size(last, named),
        *_chosen(last, holds),
        *_noise_notes(
            material.read, floor, material.given, _estimated(data), material.recording.units,
            remaining(last).over_noise,
        ),
        *rough_rates(nominal.problem.graph, material.recording, material.data.starts),
        *_growing_notes(last), *_resumed_notes(known),
    )  # fmt: skip


def taken_over(last: Fit, named: Sequence[Candidate]) -> frozenset[str]:
    """Return the parameters of elements that hold a found effect: it may give what they gave."""
    graph = last.problem.graph
    held = [graph[t.element] for t in named if t.element in graph.elements]
    found = {
        str(s) for e in held if isinstance(e, C | R | I) for s in graph.coefficient(e).free_symbols
    }
    return frozenset(found | {e.name for e in held})


def notes_on_size(last: Fit, named: Sequence[Candidate]) -> tuple[str, ...]:
    """Say of every effect whose strengths may all be zero what they are tied to."""
    estimates = {e.name: e.ci95 for e in last.estimates}
    open_ones = []
    for t in named:
        ends = [estimates[n] for n in t.insertion.strengths if n in estimates]
        if ends and all(low < 0.0 < high for low, high in ends):
            open_ones.append(t)
    if not open_ones:
        return ()
    try:
        known = practical_of(fitted(*alone(last)))
    except (BondsightError, np.linalg.LinAlgError):
        return ()
    made = ((t, _tied(t.insertion.strengths, known)) for t in open_ones)
    return tuple(
        f"{sure_of(t)}, the size of {listed(t.insertion.strengths)} is not, so that their 95 % "
        f"intervals hold zero: {why}"
        for t, why in made
        if why
    )


def tied_in(last: Fit, named: Sequence[Candidate], nominal: Fit) -> tuple[Tied, ...]:
    """Return the parameters of a fit that the recording tells only together.

    The thresholds of a memory are nobody's: what the model as it is told only together stays so.
    """
    scaled = any(t.insertion.kind == "memory" for t in named)
    try:
        with np.errstate(all="ignore"):
            before = fitted(*alone(nominal)) if scaled and last is not nominal else None
            return tied(fitted(*alone(last)), before)
    except (BondsightError, np.linalg.LinAlgError):
        return ()


def sure_of(t: Candidate) -> str:
    """Return how the note on an effect begins whose strengths may all be zero."""
    return f"the effect {spaced(t.effect)} at {t.element} is sure"


def _tied(names: Collection[str], known: Practical) -> str:
    """Say what `names` may move together with, unseen; else what they are tied to most."""
    for block in known.flat:
        if not set(names) & set(block.names):
            continue
        own = [str(c) for c in block.determined if set(names) & set(c.names)]
        only = f"; only combinations such as {listed(own)} are known" if own else ""
        return (
            f"{listed(block.names)} may move together unseen{only}; fix "
            f"{listed(block.names[: block.missing])}, or add a sensor"
        )
    free, rho = known.information.sensitivities.names, np.abs(known.information.correlation)
    inside = [i for i, n in enumerate(free) if n in names]
    pairs = [(float(rho[i, j]), i, j) for i in inside for j in range(len(free)) if j != i]
    if not pairs:
        return ""
    size, i, j = max(pairs)
    return f"{free[i]} is tied to {free[j]} (correlation {size:.3f}); fix it, or add a sensor"


def _growing_notes(last: Fit) -> tuple[str, ...]:
    found = ((n, growing(last, n)) for n in last.problem.data.names)
    return tuple(
        f"{noise.of(n)}: that is no physics; small readings are weighed too little"
        for n, noise in found
        if noise is not None
    )


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


def _estimated(data: Data) -> tuple[str, ...]:
    """Return the readings whose noise is neither measured nor known."""
    return tuple(n for n, sure in zip(data.names, data.sure, strict=True) if not sure)


def _noise_notes(
    read: Mapping[str, float],
    floor: Mapping[str, float],
    given: Collection[str],
    estimated: Collection[str],
    units: Mapping[str, str | None] | None = None,
    left: Mapping[str, float] | None = None,
) -> tuple[str, ...]:
    """Say which noise was lowered, estimated, or stands against all that is seen of it.

    A noise that was given is borne out where the model leaves about as much.
    """
    notes, left = [], left or {}
    for n, level in floor.items():
        unit = f" {(units or {}).get(n) or 'SI'}"
        if n not in given and level < read[n]:
            notes.append(
                f"the noise of {n} was read at {read[n]:.3g}{unit}, but the model leaves no more "
                f"than {level:.3g}{unit}, so that is taken"
            )
        elif level != read[n] and not any(
            1 / FAR_OFF < ratio < FAR_OFF for ratio in (level / read[n], left.get(n, 0.0))
        ):
            notes.append(
                f"the noise given for {n} is {level:.3g}{unit}, the recording itself looks like "
                f"{read[n]:.3g}{unit}: check it, the answer rests on it"
            )
    if estimated:
        whose = f" of {listed(estimated)}" if len(estimated) < len(floor) else ""
        notes.append(
            f"the noise{whose} could only be estimated (nothing repeats, and no stretch rests long "
            "and quietly enough to tell it): slow noise may lie above it; state what you know with "
            "noise={SENSOR: VALUE}"
        )
    return tuple(notes)


def _chosen(last: Fit, holds: Sequence[str]) -> tuple[str, ...]:
    margin = f" ({hold_margin(last, holds)})" if holds else ""
    notes = [
        f"commands between samples: {last.problem.data.hold}{margin}",
        f"held out: {last.problem.data.split.rule}",
    ]
    if last.problem.data.starts and not last.problem.data.cuts:
        notes.append(
            "each recording starts from a state of its own; that of a held-out one is fitted to "
            "its samples, no parameter is"
        )
    return tuple(notes)
