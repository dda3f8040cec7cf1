"""What the reader of a diagnosis should know beside its answer."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.remaining import growing
from identification.diagnosis.screening.mixups import in_doubt
from identification.diagnosis.search.material import Material
from identification.diagnosis.search.nominal import hold_margin
from identification.estimation.cautions import rough_rates
from identification.estimation.single_record import Fit


def notes_of(
    material: Material, nominal: Fit, last: Fit, holds: Sequence[str], known: Sequence[Decision]
) -> tuple[str, ...]:
    """Return the recording's own notes, and what was chosen or is doubtful.

    Parameters
    ----------
    nominal, last : Fit
        Of the model as it is, and of the last one that was made of it.
    holds : sequence of str
        Behaviours of the commands between samples that were possible.
    known : sequence of Decision
        Effects that were named on another division.
    """
    data, declared = nominal.problem.data, nominal.problem.graph.parameters
    floor = dict(zip(data.names, map(float, data.floor), strict=True))
    return (
        *in_doubt(last, declared), *material.recording.notes,
        *_chosen(last, holds),
        *_noise_notes(material.read, floor, material.sure, material.given),
        *rough_rates(nominal.problem.graph, material.recording, material.data.breaks),
        *_growing_notes(last), *_resumed_notes(known),
    )  # fmt: skip


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


def _chosen(last: Fit, holds: Sequence[str]) -> tuple[str, ...]:
    notes = [
        f"commands between samples: {last.problem.data.hold} ({hold_margin(last, holds)})",
        f"held out: {last.problem.data.split.rule}",
    ]
    if last.problem.data.breaks:
        notes.append(
            "each recording starts from a state of its own; that of a held-out one is fitted to "
            "its samples, no parameter is"
        )
    return tuple(notes)
