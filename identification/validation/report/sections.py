"""Sections of the report; each returns HTML, or nothing where there is nothing to say."""

from __future__ import annotations

from collections.abc import Sequence

from identification.report import html
from identification.report.numbers import ends, percent, quantity, short, times_noise
from identification.report.style import BAD, GOOD
from identification.report.words import ended
from identification.validation.compare import Comparison
from identification.validation.compare_tables import html_parts
from identification.validation.figures import (
    Picture,
    comparison_figure,
    correlation_figure,
    distortion_figure,
    parameter_figure,
    residual_figure,
    trace_figure,
    waterfall_figure,
)
from identification.validation.held_out import Error
from identification.validation.judge import Judgement
from identification.validation.remark import Weight
from identification.validation.tables import (
    ERROR_HEADS,
    LEGEND,
    NUMBER_HEADS,
    criteria_text,
    error_rows,
    groups,
    in_a_word,
    number_rows,
)


def _drawn(p: Picture) -> str:
    return html.figure(p.svg, p.caption)


def answer(j: Judgement) -> str:
    """Headline, badge and the most important numbers."""
    m = j.material
    records = len(m.records)
    over = f"{records} recordings" if records > 1 else m.records[0].name
    held = [c.test for c in j.channels if c.test.n]
    trained = [c.train for c in j.channels if c.train.n]
    pairs = [
        ("model", m.model),
        ("status", m.status),
        ("fitted numbers", str(m.n_free)),
        ("scored samples, training", str(sum(e.n for e in trained))),
        ("scored samples, held out", str(sum(e.n for e in held))),
        ("training error / noise", _over_noise(trained)),
        ("held-out error / noise", _over_noise(held)),
    ]
    badge = (in_a_word(j), GOOD if j.acceptable else BAD)
    return html.head(f"Fit of {m.model} to {over}", badge, headline(j), pairs)


def _over_noise(errors: Sequence[Error]) -> str:
    total = sum(e.n for e in errors)
    if not total:
        return ""
    return short(times_noise(sum(e.n * e.chi2 for e in errors) / total), 3)


def headline(j: Judgement) -> str:
    """One sentence that sums up the fit."""
    held = [c for c in j.channels if c.judged.n]
    worst = max(held, key=lambda c: c.judged.chi2)
    e = worst.judged
    part = "held-out" if worst.test.n else "training"
    where = j.material.label(e.channel, e.record)
    if j.acceptable:
        return (
            f"The model describes every reading down to its noise: the largest {part} error is "
            f"{quantity(e.rmse, e.unit, 3)} rms in {where}, beside a floor of "
            f"{quantity(e.floor, e.unit, 3)}."
        )
    if e.at_floor:
        return f"The errors are at the noise floor, but {j.faults[0].text}."
    return (
        f"The largest {part} error is {quantity(e.rmse, e.unit, 3)} rms in {where}, "
        f"{short(times_noise(e.chi2), 3)} times the noise floor ({e.fit:.4g} % fit)."
    )


def words(j: Judgement) -> str:
    """Remarks in three groups, faults with what to try."""
    parts = []
    for title, found in groups(j):
        said = [
            (ended(r.text), r.advice and ended(r.advice), _KINDS.get(r.weight, "")) for r in found
        ]
        fine = title == "What is fine"
        listed = html.bullets(t for t, _, _ in said) if fine else html.remarks(said)
        parts += [html.heading(title), listed]
    return html.section("In words", *parts)


_KINDS = {Weight.NOTE: "note"}


def before(findings: Sequence[object]) -> str:
    """Return what was found in the data before the fit."""
    return html.section("What the data said before the fit", html.bullets(map(str, findings)))


def parameters(j: Judgement) -> str:
    """Values with intervals beside the declared ones; nuisances below."""
    m = j.material
    if not m.numbers:
        return ""
    kinds = ["maybe" if n.at_bound else "" for n in m.numbers] + [""] * len(m.tied)
    nuisances = [
        [n.name, quantity(n.value, n.unit), ends(*n.ci95, n.unit, n.value),
         "at its bound" if n.at_bound else ""]
        for n in m.nuisances
    ]  # fmt: skip
    heads = ("nuisance", "value", "95 % interval", "remark")
    return html.section(
        "Parameters",
        html.table(NUMBER_HEADS, number_rows(m), (1, 2, 3), kinds),
        _drawn(parameter_figure(j)),
        html.heading("Nuisances of the measuring chain") if nuisances else "",
        html.table(heads, nuisances, (1, 2)),
    )


def errors(j: Judgement) -> str:
    """Errors of every reading on both parts, and the traces."""
    kinds = ["" if r[2] == "held out" else "quiet" for r in error_rows(j)]
    return html.section(
        "Fit and held-out fit",
        html.paragraph(
            f"Simulated as {j.material.run}. The intervals are block bootstraps; {LEGEND}."
        ),
        html.table(ERROR_HEADS, error_rows(j), (3, 4, 5, 6, 7, 8, 9), kinds),
        _drawn(trace_figure(j)),
    )


def residuals(j: Judgement) -> str:
    """Residuals over time and frequency, their memory, and what they owe to the inputs."""
    heads = ("reading", "record", "Ljung-Box", "p", "runs z", "memory (samples)", "predictable",
             "in words")  # fmt: skip
    rows = [
        [
            c.channel, c.record, f"{c.white.q:.1f} ({c.white.degrees})", f"{c.white.p:.2g}",
            f"{c.white.runs_z:.1f}", f"{c.white.memory:.1f}",
            percent(c.white.predictable), c.white.words,
        ]
        for c in j.channels
        if c.white is not None
    ]  # fmt: skip
    crossed = [
        [c.channel, c.record, x.input, f"{x.causal_p:.2g}", f"{x.anticausal_p:.2g}", x.words]
        for c in j.channels
        for x in c.inputs
    ]
    return html.section(
        "Residuals",
        _drawn(residual_figure(j)),
        _drawn(correlation_figure(j)),
        html.heading("Memory of the training residuals"),
        html.table(heads, rows, (2, 3, 4, 5, 6)),
        html.heading("What the residuals owe to the inputs") if crossed else "",
        html.table(
            ("reading", "record", "input", "p, follows", "p, runs ahead", "in words"),
            crossed, (3, 4),
        ),
        html.paragraph(criteria_text(j)),
    )  # fmt: skip


def distortion(j: Judgement) -> str:
    """Noise, even and odd distortion of the records whose drive repeats; the first two drawn."""
    said = [f"{s.record}: {s.words(n)}" for s in j.separated for n in s.reading.outputs]
    drawn = [_drawn(distortion_figure(s, f"distortion{i}")) for i, s in enumerate(j.separated[:2])]
    return html.section("Noise and distortion", html.bullets(said), *drawn)


def starts(j: Judgement) -> str:
    """Waterfall of many starts."""
    return html.section("Many starts", _drawn(waterfall_figure(j)))


def others(c: Comparison | None) -> str:
    """Return the fit among others."""
    if c is None:
        return ""
    fits, *rest = html_parts(c)
    return html.section("Beside other fits", fits, _drawn(comparison_figure(c)), *rest)
