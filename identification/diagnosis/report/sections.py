"""Sections of the report that show what was found: answer, fit, law, graph, equations."""

from __future__ import annotations

from bondgraph.draw import svg
from bondgraph.errors import BondsightError
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report import changed, html
from identification.diagnosis.report.fit_figures import (
    outputs_figure,
    recording_figure,
    residuals_figure,
)
from identification.diagnosis.report.law_figures import law_figure
from identification.diagnosis.report.numbers import percent, quantity
from identification.diagnosis.report.style import BADGES
from identification.diagnosis.report.views import unit_of
from identification.diagnosis.search import Trial
from identification.diagnosis.verdict import normalised_error, sentence, unresolved_place
from identification.fit import Fit

MANY = 8


def chosen_of(d: Diagnosis) -> Trial | None:
    """Return the named effect, or the closest one when nothing may be named."""
    if d.kind not in ("missing_physics", "unknown_physics") or d.decision is None:
        return None
    return d.decision.chosen


def answer(d: Diagnosis) -> str:
    """Badge, sentence, and what was diagnosed."""
    word, colour = BADGES.get(d.kind, (d.kind, "#52606d"))
    r = d.recording
    rate = quantity(1 / r.dt, "Hz", 3) if r.n > 1 else ""
    confidence = d.decision.confidence if d.decision and d.kind == "missing_physics" else None
    pairs = [
        ("model", d.model),
        ("recording", r.name),
        ("samples", f"{r.n} at {rate}" if rate else str(r.n)),
        ("SHA-256", r.sha256[:12] or "not from a file"),
        ("confidence", "" if confidence is None else percent(round(confidence, 3))),
        ("diagnosed in", f"{d.seconds:.1f} s"),
        ("seed", str(d.seed)),
    ]
    return (
        '<header><p class="kicker">Diagnosis report</p>'
        f'<span class="badge" style="background:{colour}">{html.escape(word)}</span>'
        f"<h1>{html.escape(sentence(d))}</h1>{html.facts(pairs)}</header>"
    )


def raw(d: Diagnosis) -> str:
    """Show the recording as it is, when nothing was fitted."""
    if d.nominal is not None:
        return ""
    return html.section(
        "What was recorded",
        html.figure(recording_figure(d), "All channels over time."),
        html.bullets(n for n in d.notes if n not in d.advice),
    )


def before_after(d: Diagnosis) -> str:
    """Show outputs on held-out samples and the errors in numbers."""
    if d.nominal is None or d.data is None:
        return ""
    caption = (
        "A piece of the held-out samples, where the first model is furthest off; "
        "these samples took no part in any fit."
    )
    return html.section(
        "Before and after, on held-out samples",
        html.figure(outputs_figure(d), caption),
        _errors(d),
    )


def _errors(d: Diagnosis) -> str:
    assert d.data is not None
    fits: list[tuple[str, Fit | None]] = [
        ("declared values", d.declared), ("nominal structure, fitted", d.nominal)
    ]  # fmt: skip
    chosen = chosen_of(d)
    if chosen is not None:
        word = "repaired" if d.kind == "missing_physics" else "closest, not named"
        fits.append((word, chosen.fit))
    rows, kinds = [], []
    for c, name in enumerate(d.data.names):
        unit = unit_of(d, name)
        for word, f in fits:
            if f is None:
                continue
            rows.append(
                [
                    name, word,
                    quantity(f.rmse("train")[name], unit), quantity(f.rmse("test")[name], unit),
                    percent(normalised_error(f, "train")[name]), percent(normalised_error(f)[name]),
                ]
            )  # fmt: skip
            kinds.append("named" if chosen is not None and f is chosen.fit else "")
        rows.append([name, "noise floor", *[quantity(float(d.data.floor[c]), unit)] * 2, "", ""])
        kinds.append("quiet")
    heads = ("reading", "model", "RMSE, train", "RMSE, held out", "error, train", "error, held out")
    note = "The error is the norm of the residual over the norm of the centred reading."
    return html.table(heads, rows, (2, 3, 4, 5), kinds) + html.paragraph(note)


def residuals(d: Diagnosis) -> str:
    """Residuals against the noise floor."""
    if d.nominal is None or d.data is None:
        return ""
    caption = (
        "Left: measured less simulated over the scored samples, with the noise of the sensor as a "
        "band of ±2σ. Right: amplitude density of the held-out residual; noise alone would lie on "
        "the dashed line."
    )
    return html.section(
        "The residual and the noise floor", html.figure(residuals_figure(d), caption)
    )


def law(d: Diagnosis) -> str:
    """Show the loop or curve that was found, with its parameters."""
    chosen = chosen_of(d)
    if chosen is None:
        return ""
    svg_text, caption = law_figure(d, chosen)
    known = set(d.nominal.problem.compiled.parameter_names) if d.nominal else set()
    own = [e for e in chosen.fit.estimates if e.name not in known]
    title = (
        "The law that was found" if d.kind == "missing_physics" else "The closest law, not named"
    )
    listed = ", ".join(f"{e.name} = {quantity(e.value, e.unit)}" for e in own)
    return html.section(
        title,
        html.figure(svg_text, caption),
        html.paragraph(f"Fitted: {listed}." if listed else ""),
    )


def graph(d: Diagnosis) -> str:
    """Draw the model as a bond graph, the place of the effect marked."""
    chosen = chosen_of(d)
    marked: dict[str, str] = {}
    also: list[str] = []
    words = "The model as declared."
    if chosen is not None and d.decision is not None and d.kind == "missing_physics":
        marked = {chosen.element: chosen.effect.replace("_", " ")}
        also = sorted({t.element for t in d.decision.same_place} - {chosen.element})
        words = "Ring: where the effect sits. "
        words += "Dashed: places these sensors cannot tell from it." if also else ""
    elif d.kind == "unknown_physics":
        place = unresolved_place(d)
        if place["element"]:
            marked = {place["element"]: "?"}
            also = list(place["indistinguishable_from"])
            words = "Ring: where the best description sits. Dashed: places as good as it."
    marked = {n: c for n, c in marked.items() if n in d.graph.elements}
    drawn = _drawn(d, marked, [n for n in also if n in d.graph.elements])
    return html.section(
        "Where in the model" if marked else "The model", html.figure(drawn, words, "graph")
    )


def _drawn(d: Diagnosis, marked: dict[str, str], also: list[str]) -> str:
    try:
        return svg(d.graph, marked=marked, also=also)
    except BondsightError:
        return ""


def equations(d: Diagnosis) -> str:
    """Equations that differ between the nominal and the repaired model."""
    chosen = chosen_of(d)
    if chosen is None or d.nominal is None:
        return ""
    steps, closed = changed.changes(d.nominal.problem.graph, chosen.fit.problem.graph)
    formula, meaning = changed.definition(chosen)
    listed = _change_rows(steps, "s")
    parts = [_folded(listed) if len(steps) > MANY else listed]
    whole = changed.math_svg(changed.whole_law(chosen), "law-whole")
    if formula:
        drawn = changed.math_svg(formula, "law-formula")
        parts += [
            html.heading("with" if steps else "what changed"),
            html.figure(whole),
            html.figure(drawn) if drawn else html.paragraph(formula, "mono"),
            html.paragraph(f"Here {meaning}."),
        ]
    short = tuple(c for c in closed if max(len(c.before), len(c.after)) <= changed.LONGEST)
    if short:
        parts += [html.heading("in closed form"), _change_rows(short, "c")]
    return html.section("The equation that changed", *parts)


def _folded(rows: str) -> str:
    return f"<details><summary>all changed assignments</summary>{rows}</details>"


def _change_rows(found: tuple[changed.Change, ...], prefix: str) -> str:
    rows = []
    for k, c in enumerate(found):
        for word, tex in (("before", c.before), ("after", c.after)):
            if tex:
                drawn = changed.math_svg(tex, f"eq-{prefix}{k}{word[0]}")
                shown = drawn or f"<code>{html.escape(changed.words(tex))}</code>"
                why = c.why if word == "after" or not c.after else ""
                rows.append(
                    f'<tr><td class="{word}">{word if tex else ""}</td><td>{shown}</td>'
                    f'<td class="why">{html.escape(why)}</td></tr>'
                )
    if not rows:
        return ""
    return (
        f'<div class="scroll"><table class="equations"><tbody>{"".join(rows)}</tbody></table></div>'
    )
