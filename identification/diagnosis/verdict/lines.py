"""Lines of the terminal's verdict below its answer: errors, laws with their numbers, reasons."""

from __future__ import annotations

import numpy as np

from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.words import briefly, spoken
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.colour import COLOURED
from identification.diagnosis.explanation.law_formula import (
    in_numbers,
    in_symbols,
    meaning_of,
    own_value,
)
from identification.diagnosis.explanation.undetermined import (
    is_undetermined,
    remark_of,
    weakness,
)
from identification.diagnosis.verdict.document import (
    ERROR,
    as_repaired,
    effect_parameters,
    law_constants,
    normalised_error,
    parts_of,
    size_words,
)
from identification.estimation.estimates import Estimate
from identification.estimation.leaning import leaning_words
from identification.report.numbers import ends, quantity, telling_apart, times_noise, told
from identification.report.tables import aligned
from identification.report.words import listed, ordinal, shortened
from identification.uncertainty.tied import remark_on


def error_lines(d: Diagnosis) -> list[str]:
    """Errors before and after by reading, and what is left of it over the noise."""
    if d.nominal is None or d.data is None:
        return []
    before = normalised_error(d.nominal)
    after = normalised_error(d.repaired) if d.repaired else {}
    found = "the found effect" if len(d.findings) < 2 else f"the {len(d.findings)} found effects"
    lines = []
    for c, n in enumerate(d.data.names):
        text = f"held-out error of {n}: {100 * before[n]:.3g} %"
        if after:
            text += f" before, {100 * after[n]:.3g} % with {found}"
        unit = d.recording.units.get(n) or "SI"
        level = d.left.over_noise.get(n) if d.left is not None else None
        noise = f"noise {d.data.floor[c]:.3g} {unit}"
        left = noise if level is None else f"what is left is {level:.3g} times the {noise}"
        if d.left is not None and n in d.left.grows:
            left = f"what is left is {level:.3g} times its noise, which grows with the reading"
        lines.append(f"{text}; {left}")
    return [*lines, f"  (in percent: {ERROR})"]


def recording_lines(d: Diagnosis) -> list[str]:
    """How far the model misses each of several recordings where no name is given, worst first."""
    parts = parts_of(d.recording)
    if d.kind != "unknown_physics" or d.nominal is None or len(parts) < 2:
        return []
    data = d.nominal.problem.data
    stops = np.cumsum([p["samples"] for p in parts])
    if stops[-1] != data.readings.shape[0]:
        return []
    scored = data.mask("train") | data.mask("held-out")
    left = np.where(scored[:, None], (data.readings - d.nominal.simulated) / data.floor, np.nan)
    found = []
    for part, rows in zip(parts, np.split(left, stops[:-1]), strict=True):
        if not np.isfinite(rows).all(axis=1).any():
            continue
        times = np.sqrt(np.nanmean(rows**2, axis=0))
        each = [f"{n} by {v:.3g} times its noise" for v, n in zip(times, data.names, strict=True)]
        said = f"recording {shortened(part['name'])}: the model misses {listed(each)}"
        found.append((float(times.max()), said))
    return [said for _, said in sorted(found, reverse=True)[:MOST_RECORDINGS]]


MOST_RECORDINGS = 6
"""Recordings of which the terminal says how far the model misses them."""


def parameter_lines(d: Diagnosis) -> list[str]:
    """Law and parameters of every named effect, under its name where there are several."""
    if d.repaired is None:
        return []
    lines = []
    for step in d.findings:
        if step.chosen is None:
            continue
        if len(d.findings) > 1:
            lines.append(f"{step.chosen.label}:")
        trial = as_repaired(step.chosen, d)
        if law := in_symbols(trial):
            lines.append(f"  law: {law}")
        if numbers := in_numbers(trial):
            lines.append(f"  in numbers: {numbers}")
        for e in effect_parameters(step.chosen, d):
            unit, said = f" {e.unit}" if e.unit != "1" else "", meaning_of(e.name, trial)
            low, high = e.ci95
            digits = max(4, telling_apart(low, high))
            ends = remark_on(e.name, d.tied) or f"{low:.{digits}g}, {high:.{digits}g}"
            value = f"{e.name} = {e.value:.{digits}g}{unit}  [{ends}]"
            value = f"{e.name} {remark_of(e, d)}" if is_undetermined(e, d) else value
            lines.append(f"  {value}" + (f"  {said}" if said else ""))
        for p in law_constants(step.chosen, d):
            unit, said = f" {p.unit}" if p.unit != "1" else "", meaning_of(p.name, trial)
            what = f"{said}; of the law, not fitted" if said else "of the law, not fitted"
            lines.append(f"  {p.name} = {p.value:.4g}{unit}  ({what})")
        lines += [f"  ({said})"] if (said := own_value(trial)) else []
    return lines


def alike_lines(d: Diagnosis) -> list[str]:
    """Laws that the data do not tell apart, each with its size and the values beside it."""
    lines = []
    for t in (
        t for s in d.findings if s.answer in ALIKE and len(s.possible) > 1 for t in s.possible
    ):
        sized = f" with {said}" if (said := size_words(t)) else ""
        left = f"{times_noise(t.test):.4g} times the noise, all readings together"
        lines.append(f"either: {spoken(t.label)}{sized} leaves {left}")
        if t.insertion.sentence not in USUAL:
            lines.append(f"  ({t.insertion.sentence})")
        own = [e for e in t.fit.estimates if e.name in d.graph.parameters][:MOST_BESIDE]
        if own:
            values = (f"{e.name} = {told(e.value, *e.ci95, e.unit)}" for e in own)
            lines.append(f"  then {', '.join(values)}")
    return lines


MOST_BESIDE = 6
"""Values of the model that are told beside each of them."""
USUAL = frozenset(e.sentence for e in CATALOGUE)
"""Sentences that say nothing of the place."""
ALIKE = ("look_alikes", "family")
"""Answers that are several laws."""


def value_lines(d: Diagnosis) -> list[str]:
    """Fitted values of the model's own parameters beside the declared ones.

    Where something is missing that has no name, they bend for it: that is said first.
    """
    last = d.repaired or (None if d.kind == "insufficient_data" else d.nominal)
    if last is None or d.mistakes:
        return []
    own = {e.name for s in d.findings if s.chosen for e in effect_parameters(s.chosen, d)}
    rows = [_value_row(e, d) for e in last.estimates if e.name not in own]
    if not rows:
        return []
    more = f"{len(rows) - MOST_VALUES} more in verdict.json"
    shown = aligned(HEADS, rows[:MOST_VALUES])
    return [*bent(d), *shown, *([more] if len(rows) > MOST_VALUES else [])]


def bent(d: Diagnosis) -> tuple[str, ...]:
    """Say what values are worth that were fitted without what is missing."""
    if d.kind != "unknown_physics" or d.left is None:
        return ()
    return (
        f"values of the model as it is, which leaves {d.left.most:.3g} times the noise: they bend "
        "for what is missing, and their intervals do not say by how much",
    )


HEADS = ("fitted", "value", "95 % interval", "declared")
MOST_VALUES = 12
"""Values of parameters that the terminal shows."""


def _value_row(e: Estimate, d: Diagnosis) -> list[str]:
    declared = d.graph.parameters.get(e.name.partition(" @")[0])
    before = "–" if declared is None else quantity(declared.value, e.unit)
    if remark := remark_of(e, d):
        return [e.name, quantity(e.value, e.unit), remark, before]
    weak = f", {said}" if (said := weakness(e)) else ""
    return [e.name, told(e.value, *e.ci95, e.unit), ends(*e.ci95, e.unit, e.value) + weak, before]


def certainty_lines(d: Diagnosis) -> list[str]:
    """How probable the answers are, and what that is a share of; one line for each number."""
    rest = rest_of(d)
    said = {sure_words(s.answer, s.confidence, rest): s for s in d.findings if s.confidence > 0}
    one = len(d.findings) == 1
    return [
        words if one or s.chosen is None else f"{s.chosen.label}: {words}"
        for words, s in said.items()
    ]


def rest_of(d: Diagnosis) -> float:
    """Return the times of the noise that are left where that is more than noise, else 0."""
    return 0.0 if d.left is None or d.left.is_noise(d.limits.noise) else d.left.most


def sure_words(answer: str, chance: float, rest: float = 0.0) -> str:
    """Say a probability with what it is of.

    It is a share of answers of a sort and does not fall with what is left: that is said with it.

    Parameters
    ----------
    rest : float
        Times the noise that the repaired model leaves, where that is more than noise.

    Examples
    --------
    >>> sure_words("kind", 0.8).partition(":")[0]
    'probability 80 % that kind and place are right'
    """
    of = OF.get(answer, "that it is right")
    share = f"probability {100 * chance:.3g} %"
    said = f"{share} {of}: so many such answers were in tests with a hidden truth"
    if not rest:
        return said
    of_names = f"; {OF_NAMES}, and" if answer in NAMES else ", beside which"
    return f"{said}{of_names} {rest:.3g} times the noise is left: {MORE}"


OF_NAMES = "that is of the name among those of the catalogue"
MORE = "more is missing, or the law is not quite this one"
"""What a probability does not tell where a repair leaves more than noise."""


NAMES = ("exact", "approximate", "family")
"""Answers that tell names."""


OF = {
    "exact": "that effect and place are right",
    "approximate": "that effect and place are right",
    "family": "that it is one of these",
    "kind": "that kind and place are right",
}
"""What the probability of an answer is of."""


def together_lines(d: Diagnosis) -> list[str]:
    """Parameters that are told only together: a value of one of them alone means nothing."""
    return [f"the recording tells {t.words}" for t in d.tied]


def nuisance_lines(d: Diagnosis) -> list[str]:
    """Offsets, lags, gains and clocks of the measuring chain that the last fit makes use of."""
    return [leaning_words(str(n)) for n in d.leanings]


def reason_lines(d: Diagnosis) -> list[str]:
    """Why each step ended as it did; after the first they say which one they belong to."""
    lines = []
    noise = d.left is not None and d.left.is_noise(d.limits.noise)
    for number, step in enumerate(d.steps, start=1):
        word = "because" if number == 1 else f"{ordinal(number)} step"
        lines += [f"{word}: {briefly(r)}" for r in step.reasons if r not in d.notes]
        if number > 1 and step.kind == "unknown_physics" and not noise:
            lines.append(f"{word}: something more is missing, and these data do not tell its name")
    return lines


def colour(d: Diagnosis) -> list[str]:
    """Return the note on the colour of what is left: it stands beside the answer.

    Without a repair it is of the model as it is, whatever rivals leave.
    """
    found = [n for n in d.notes if n.startswith(COLOURED)]
    if d.repaired is not None or d.kind != "unknown_physics":
        return found
    return [f"what the model as it is leaves{n.removeprefix('what is left')}" for n in found]
