"""Sections of the page that show what was found: answer, fit, law, graph, equations."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from bondgraph.drawing.svg import svg
from bondgraph.graph.parameter import Parameter
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.conclusion import QUIET
from identification.diagnosis.explanation.doubts import file_first
from identification.diagnosis.explanation.law_formula import (
    LONGEST,
    in_numbers,
    in_symbols,
    meaning_of,
    own_value,
)
from identification.diagnosis.explanation.notes import sure_of
from identification.diagnosis.explanation.undetermined import is_undetermined, remark_of
from identification.diagnosis.report import changed
from identification.diagnosis.report.found import after_of, found_of, places_of, warmth_of
from identification.diagnosis.report.law_figures import law_figure
from identification.diagnosis.report.recording_figure import recording_figure
from identification.diagnosis.report.views import AS_IT_IS, DECLARED, unit_of
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.verdict import answered, effect_parameters, normalised_error
from identification.diagnosis.verdict.document import ERROR, law_constants, parts_of
from identification.diagnosis.verdict.lines import (
    certainty_lines,
    colour,
    nuisance_lines,
    rest_of,
    together_lines,
)
from identification.diagnosis.verdict.text import what_remains
from identification.estimation.estimates import Estimate
from identification.estimation.single_record import Fit
from identification.report import html
from identification.report.numbers import interval, percent, quantity
from identification.report.style import BAD, GOOD, SOFT
from identification.report.words import gathered, spaced, stopped
from identification.study.data import Data
from identification.uncertainty.tied import remark_on

BADGES = {
    "explained": ("nothing missing shows", GOOD),
    "parameters_only": ("only parameter values", "#0f766e"),
    "missing_physics": ("missing physics", BAD),
    "unknown_physics": ("unknown physics", "#6d28d9"),
    "insufficient_data": ("insufficient data", SOFT),
}
DOUBTED = {
    "exchange": "columns look exchanged", "sign": "a sign looks wrong",
    "scale": "a unit looks wrong", "quantity": "another quantity was read",
    "dead": "a sensor looks dead", "clipped": "a reading is clipped",
}  # fmt: skip
"""What stands instead where the file is mixed up: of the physics nothing is known."""
MANY = 8
LEGIBLE = 0.6


def answer(d: Diagnosis) -> str:
    """Badge, sentence, and what was diagnosed."""
    badge = _doubted(d) or BADGES.get(d.kind, (d.kind, SOFT))
    named = d.findings if d.kind == "missing_physics" else ()
    r = d.recording
    rate = quantity(1 / r.dt, "Hz", 3) if r.n > 1 else ""
    hashes = dict.fromkeys([p["sha256"] for p in parts_of(r)] or [r.sha256])
    chance = "probability of the name" if rest_of(d) else "probability"
    pairs = [
        (chance, ", ".join(percent(round(s.confidence, 3)) for s in named)),
        ("of the misfit explained", ", ".join(percent(s.share) for s in named)),
        ("model", d.model),
        ("recording", r.name),
        ("samples", f"{r.n} at {rate}" if rate else str(r.n)),
        ("SHA-256", " + ".join(h[:12] or "not from a file" for h in hashes)),
        ("diagnosed in", f"{d.seconds:.1f} s, without reading and this page"),
        ("seed", str(d.seed)),
    ]
    first, *more = answered(d)
    return html.head("Diagnosis report", badge, first, pairs, more)


def _doubted(d: Diagnosis) -> tuple[str, str] | None:
    """Return the badge of a file that looks mixed up."""
    kinds = {m.kind for m in d.mistakes or (d.doubted if d.kind in QUIET else ())}
    if not kinds:
        return None
    return (DOUBTED[kinds.pop()] if len(kinds) == 1 else "the file looks mixed up", "#b45309")


def beside(d: Diagnosis) -> str:
    """Say what is left where it is more than noise, or has a memory: it qualifies the answer."""
    said = (what_remains(d), *map(stopped, (*colour(d), *nuisance_lines(d), *together_lines(d))))
    mend = not d.mistakes and file_first(d)
    first = (
        "The values on this page are those of the file as it was read: mend it first.",
    ) * bool(mend)
    return html.box(html.bullets(s for s in (*first, *said) if s))


def sure(d: Diagnosis) -> str:
    """Say how sure the answer is, and what that is a share of."""
    return html.paragraph(" ".join(map(stopped, certainty_lines(d))))


def raw(d: Diagnosis) -> str:
    """Show the recording as it is, when nothing was fitted."""
    if d.nominal is not None:
        return ""
    return html.section(
        "What was recorded",
        html.figure(recording_figure(d), "All channels over time."),
        html.bullets(gathered(n for n in d.notes if n not in d.advice)),
    )


def before_after(d: Diagnosis) -> str:
    """Give the errors in numbers; the studio draws the readings."""
    if d.nominal is None or d.data is None:
        return ""
    return html.section("Before and after, on held-out samples", _errors(d))


def _apart(data: Data) -> str:
    """Say what was fitted to the held-out samples."""
    if not data.breaks:
        return "They took no part in any fit."
    part = "window" if data.cuts else "recording"
    return (
        f"They took no part in any fit, except for the initial state of each held-out {part}, "
        "which is fitted to them."
    )


def _errors(d: Diagnosis) -> str:
    assert d.data is not None
    fits: list[tuple[str, Fit | None]] = [
        (DECLARED, d.declared), (AS_IT_IS, d.nominal)
    ]  # fmt: skip
    after = after_of(d)
    if after is not None:
        word = "repaired" if d.kind == "missing_physics" else "closest, not named"
        fits.append((word, after))
    rows, kinds = [], []
    for c, name in enumerate(d.data.names):
        unit = unit_of(d, name)
        for word, f in fits:
            if f is None:
                continue
            rows.append(
                [
                    f"{name}, {word}",
                    quantity(f.rmse("train")[name], unit), quantity(f.rmse("test")[name], unit),
                    percent(normalised_error(f, "train")[name]), percent(normalised_error(f)[name]),
                ]
            )  # fmt: skip
            kinds.append("named" if f is after else "")
        rows.append([f"{name}, noise floor", *[quantity(float(d.data.floor[c]), unit)] * 2, "", ""])
        kinds.append("quiet")
    heads = ("reading, model", "RMSE, train", "RMSE, held out", "error, train", "error, held out")
    note = (
        f"The error in percent is the {ERROR}. Held out are here those samples that no choice "
        f"has seen; what is left over the noise counts all that are held out. Held-out samples are "
        f"shaded above. {_apart(d.data)}"
    )
    return html.table(heads, rows, (1, 2, 3, 4), kinds) + html.paragraph(note)


def law(d: Diagnosis) -> str:
    """Tell every effect that was found, with its parameters; draw those over time."""
    title = (
        "The law that was found" if d.kind == "missing_physics" else "The closest law, not named"
    )
    parts = []
    for k, trial in enumerate(found_of(d)):
        # as the last repair has it, whose numbers are given below
        fitted = replace(trial, fit=after_of(d) or trial.fit)
        svg_text, caption = law_figure(d, fitted)
        # the same figure is drawn once for every finding: ids must differ
        svg_text = svg_text.replace("law-", f"law{k}-") if k else svg_text
        own = effect_parameters(trial, d)
        more = f"and {len(own) - MANY} more (see the parameters)"
        listed = [*(_told(e, fitted, d) for e in own[:MANY]), *([more] if len(own) > MANY else [])]
        parts += [
            html.heading(f"{spaced(trial.effect)} at {trial.element}"),
            html.figure(svg_text, caption, "tiles") if svg_text else html.paragraph(caption),
            html.paragraph(f"Law: {said}." if (said := in_symbols(fitted)) else ""),
            html.paragraph(f"In numbers: {said}." if (said := in_numbers(fitted)) else ""),
            html.bullets(listed),
            html.paragraph(_given(law_constants(trial, d))),
            html.paragraph(stopped(own_value(fitted))),
            *(html.paragraph(stopped(n)) for n in d.notes if n.startswith(sure_of(trial))),
            html.paragraph(_about(trial)),
        ]
    return html.section(title, *parts)


def _told(e: Estimate, trial: Candidate, d: Diagnosis) -> str:
    """Say a fitted number with its interval and what it is."""
    said = meaning_of(e.name, trial)
    known = remark_on(e.name, d.tied) or f"95 %: {interval(*e.ci95, e.unit, e.value)}"
    value = f"{e.name} = {quantity(e.value, e.unit)}, {known}"
    value = f"{e.name}: {remark_of(e, d)}" if is_undetermined(e, d) else value
    return f"{value}; {said}" if said else value


def _given(constants: Sequence[Parameter]) -> str:
    """Say the numbers of a law that were not fitted."""
    said = ", ".join(f"{p.name} = {quantity(p.value, p.unit)}" for p in constants[:MANY])
    more = f" and {len(constants) - MANY} more (see the parameters)" * (len(constants) > MANY)
    return f"Of the law, not fitted: {said}{more}." if said else ""


def _about(trial: Candidate) -> str:
    """Say what the catalogue knows of an effect: its look, what it is confused with, its source.

    A richer law is told as the one that was fitted.
    """
    try:
        e = by_name(trial.effect)
    except (KeyError, BondsightError):
        return ""
    alike = ", ".join(spaced(n) for n in e.confused_with)
    apart = f": {e.separated_by}" if e.separated_by else ""
    said = (
        f"It looks like this: {e.looks}." if e.looks else "",
        f"What it is easily confused with is {alike}{apart}." if alike else "",
        f"Law: {spaced(trial.insertion.law)}"
        + (f" ({e.source})." if e.source and not trial.insertion.form else "."),
    )
    return " ".join(s for s in said if s)


def graph(d: Diagnosis) -> str:
    """Draw the model as a bond graph, its elements shaded by the plausibility of the place.

    Empty if it cannot be drawn.
    """
    marked, also = places_of(d)
    words = "The model as declared, as a bond graph."
    if marked:
        words = "Solid ring: where it was found" + (
            "; dashed: places these sensors cannot tell from it. " if also else ". "
        )
        words += (
            "The orange deepens with the plausibility of the place on held-out data: how easily "
            "its best effect could lie that far behind the best of all by accident. Places that "
            "the data cannot tell apart have the same colour. It ranks places; how often such "
            "answers are right is the probability above."
        )
    try:
        # beside a name one number says how sure it is: that of the answer
        numbers = d.kind != "missing_physics"
        made = svg(d.graph, marked=marked, also=also, shades=warmth_of(d), numbers=numbers)
    except BondsightError:
        return ""
    width = re.search(r' width="([\d.]+)"', made)
    least = LEGIBLE * float(width.group(1)) if width else 0.0
    return html.figure(html.legible(made, least), words, "graph")


def equations(d: Diagnosis) -> str:
    """Equations that differ between the nominal and the repaired model."""
    found, after = found_of(d), after_of(d)
    if not found or after is None or d.nominal is None:
        return ""
    steps, closed = changed.changes(d.nominal.problem.graph, after.problem.graph)
    listed = _change_rows(steps, "s")
    parts = [html.folded("all changed assignments", listed) if len(steps) > MANY else listed]
    for k, trial in enumerate(found):
        formula, meaning = changed.definition(trial)
        whole = changed.math_svg(changed.whole_law(trial), f"law-whole{k}")
        if formula:
            drawn = changed.math_svg(formula, f"law-formula{k}")
            parts += [
                html.heading("with" if steps else "what changed"),
                html.figure(whole),
                html.figure(drawn) if drawn else html.paragraph(formula, "mono"),
                html.paragraph(f"Here {meaning}."),
            ]
    short = tuple(c for c in closed if max(len(c.before), len(c.after)) <= LONGEST)
    if short:
        parts += [html.heading("in closed form"), _change_rows(short, "c")]
    return html.section("The equation that changed", *parts)


def _change_rows(found: tuple[changed.Change, ...], prefix: str) -> str:
    rows = []
    for k, c in enumerate(found):
        for word, tex in (("before", c.before), ("after", c.after)):
            if tex:
                drawn = changed.math_svg(tex, f"eq-{prefix}{k}{word[0]}")
                shown = html.trusted(drawn) if drawn else html.code(changed.words(tex))
                rows.append((word, shown, c.why if word == "after" or not c.after else ""))
    return html.equations(rows)
