"""A judgement as text and as HTML for notebooks."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from identification.report import html
from identification.report.numbers import ends, interval, quantity, short, times_noise, told
from identification.report.tables import aligned
from identification.report.words import listed
from identification.validation.held_out import Error
from identification.validation.remark import fault

if TYPE_CHECKING:
    from identification.validation.judge import Judgement
    from identification.validation.remark import Remark
    from identification.validation.validation_data import Number, ValidationData

ERROR_HEADS = ("record", "reading", "part", "samples", "rms error", "95 %", "noise floor",
               "fit", "error / noise", "95 %")  # fmt: skip
LEGEND = (
    "fit: 100 % less the rms error in percent of the reading's standard deviation; error / noise: "
    "1 is noise alone"
)
NUMBER_HEADS = ("parameter", "value", "95 % interval", "declared", "remark")


def error_row(e: Error) -> list[str]:
    """Return one row of the table of errors."""
    part = "held out" if e.part == "test" else "training"
    known = np.isfinite(e.rmse_ci).all()
    return [
        e.record, e.channel, part, str(e.n),
        quantity(e.rmse, e.unit, 3),
        interval(*e.rmse_ci, e.unit, e.rmse) if known else "too short",
        quantity(e.floor, e.unit, 3),
        f"{e.fit:.2f} %" if np.isfinite(e.fit) else "–",
        short(times_noise(e.chi2), 3),
        " … ".join(short(times_noise(end), 3) for end in e.chi2_ci) if known else "too short",
    ]  # fmt: skip


def error_rows(j: Judgement) -> list[list[str]]:
    """Rows of all errors that have samples."""
    return [error_row(e) for c in j.channels for e in (c.train, c.test) if e.n]


def number_row(n: Number) -> list[str]:
    """Return one row of the table of parameters."""
    remark = n.kind
    if n.at_bound and "bound" not in remark:
        remark = f"{remark}, at its bound" if remark else "at its bound"
    declared = quantity(n.nominal, n.unit) if np.isfinite(n.nominal) else "–"
    if n.only:
        remark = f"{remark}, {n.only}" if remark else n.only
    known = "–" if n.only else ends(*n.ci95, n.unit, n.value)
    shown = quantity(n.value, n.unit) if n.only else told(n.value, *n.ci95, n.unit)
    return [n.name, shown, known, declared, remark]


def number_rows(m: ValidationData) -> list[list[str]]:
    """Rows of all parameters, and of what is told of some only together."""
    together = [
        [k.text, quantity(k.value, k.unit), ends(*k.ci95, k.unit, k.value), "–",
         f"of {listed(t.names)} only this"]
        for t in m.tied for k in t.told
    ]  # fmt: skip
    return [*map(number_row, m.numbers), *together]


def criteria_text(j: Judgement) -> str:
    """Return one line of information criteria."""
    c = j.criteria
    if c is None:
        return ""
    return (
        f"fitted to {c.n:.0f} scored samples, worth {c.effective:.0f} independent ones:\n"
        f"{fitted_words(j.material, c.parameters)}\nto compare models of the same recordings "
        f"(smaller is better): AIC {c.aic:.1f}, AICc {c.aicc:.1f}, BIC {c.bic:.1f}"
    )


def fitted_words(m: ValidationData, total: int) -> str:
    """Return what the numbers are that were fitted, noise levels included."""
    levels = total - m.n_free
    sorts = (
        (len(m.numbers), "value", "of the model and its laws"), (m.states, "initial state", ""),
        (m.n_free - len(m.numbers) - m.states, "offset, lag or the like", "of the readings"),
        (levels, "noise level", ""),
    )  # fmt: skip
    said = [
        f"{n} {one if n == 1 else one.replace('offset, lag or', 'offsets, lags and')}"
        f"{'s' if n > 1 and ',' not in one else ''} {of}".strip()
        for n, one, of in sorts
        if n > 0
    ]
    return listed(said)


def in_a_word(j: Judgement) -> str:
    """Return whether there is anything to object to."""
    count = len(j.faults)
    if leads := next((r.leads for r in j.faults if r.leads), ""):
        return leads
    more = "s of the fit are" if count > 1 else " of the fit is"
    return "nothing to object to" if j.acceptable else f"{count} thing{more} not fine"


def groups(j: Judgement, *, brief: bool = False) -> list[tuple[str, Sequence[Remark]]]:
    """Remarks under their titles; a title without remarks is left out.

    Parameters
    ----------
    brief : bool
        Leave out the faults that most likely come of another one.
    """
    faults = j.leading if brief else j.faults
    if more := len(j.faults) - len(faults):
        said = f"{more} more that most likely come of it: in the report, and in judgement.faults"
        faults = (*faults, fault(said, ""))
    every = (("What is not fine", faults), ("To know", j.notes), ("What is fine", j.fine))
    return [(title, found) for title, found in every if found]


def text_judgement(j: Judgement) -> str:
    """Judgement as plain text."""
    m = j.material
    lines = [f"{m.model}: {in_a_word(j)}", f"simulated as {m.run}", ""]
    lines += [*aligned(ERROR_HEADS, error_rows(j)), LEGEND]
    if m.numbers:
        lines += ["", *aligned(NUMBER_HEADS, number_rows(m))]
    for title, found in groups(j, brief=True):
        lines += ["", title, *(line for r in found for line in _remark(r))]
    if j.criteria is not None:
        lines += ["", criteria_text(j)]
    return "\n".join(line.rstrip() for line in lines)


def _remark(r: Remark) -> list[str]:
    lines = textwrap.wrap(r.text, 96, initial_indent="  - ", subsequent_indent="    ")
    if r.advice:
        lines += textwrap.wrap(
            f"try: {r.advice}", 96, initial_indent="    ", subsequent_indent="    "
        )
    return lines


def html_judgement(j: Judgement) -> str:
    """Judgement as HTML without scripts; every text is escaped."""
    m = j.material
    said = []
    for title, found in groups(j, brief=True):
        tried = [f"{r.text}. Try: {r.advice}." if r.advice else f"{r.text}." for r in found]
        said += [html.heading(title), html.bullets(tried)]
    return html.block(
        html.heading(f"{m.model}: {'nothing to object to' if j.acceptable else 'not yet good'}"),
        html.paragraph(f"Simulated as {m.run}."),
        html.table(ERROR_HEADS, error_rows(j), (3, 4, 5, 6, 7, 8, 9)),
        html.table(NUMBER_HEADS, number_rows(m), (1, 2, 3)),
        *said,
        html.paragraph(criteria_text(j)),
    )
