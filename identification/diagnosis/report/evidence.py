"""Sections of the report that show the evidence: rivals, parameters, advice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identification.diagnosis.catalogue.words import briefly, spoken
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.explanation.colour import COLOURED
from identification.diagnosis.explanation.doubts import file_first
from identification.diagnosis.explanation.rivals import Standing, nominal_misfit, standings, title
from identification.diagnosis.explanation.undetermined import is_undetermined, remark_of, weakness
from identification.diagnosis.report.found import found_of
from identification.diagnosis.verdict.document import law_constants
from identification.diagnosis.verdict.lines import bent
from identification.estimation.estimates import Estimate
from identification.report import html
from identification.report.numbers import interval, quantity, short, times_noise
from identification.report.words import listed, ordinal, stopped

INTERVALS = (
    "The intervals are the wider ones of two: those of white noise, and those from how much "
    "stretches of the recording differ, which hold where what is left has a memory, too."
)
KINDS = {"winner": "named", "alike": "maybe", "locates": "quiet"}
SHOWN = 12
"""Rivals that are listed; the others are behind a line."""
GIVEN = "of the law, not fitted"
"""Remark on a number of a law that was chosen."""
DIVERGED = 1e3
"""Held-out misfit over the nominal one from which a fit is said to diverge."""


def rivals(d: Diagnosis) -> str:
    """All trials of every step, and why they lost."""
    parts: list[str] = []
    for k, step in enumerate(d.steps, start=1):
        found = standings(d, step)
        if not found and not step.reasons:
            continue
        if len(d.steps) > 1:
            parts.append(html.heading(_step_title(k, step)))
        parts.append(html.bullets(map(briefly, step.reasons)))
        if found:
            parts += _rival_tables(found, nominal_misfit(d, step))
    if not parts:
        return ""
    if d.mistakes:
        return html.section("Why the file is doubted", *parts)
    explained = (
        "What an effect leaves is the root mean square of the residuals of all readings together "
        "over their noise, on the held-out samples that choices look at, so 1 is noise; the bar is "
        "its logarithm. Behind the best by less than 3 standard errors is a difference that may be "
        "chance. The best is shown as refitted on all training samples, none left out."
    )
    return html.section("The rivals, and why they lost", html.paragraph(explained), *parts)


def _step_title(k: int, step: Decision) -> str:
    if step.chosen is not None and step.kind == "missing_physics":
        return f"{ordinal(k)} step: {spoken(step.chosen.label)}"
    return f"{ordinal(k)} step: nothing more to name"


def _rival_tables(found: Sequence[Standing], nominal: float) -> list[str]:
    values = [nominal, *(s.trial.test for s in found if s.trial.test < DIVERGED * nominal)]
    low, high = np.log(0.9 * min(1.0, *values)), np.log(max(*values, 1.1))

    def size(v: float, role: str) -> list[str]:
        length = float((np.log(v) - low) / (high - low)) if np.isfinite(v) and v > 0 else 1.0
        told = short(times_noise(v)) if v < DIVERGED * nominal else "diverges"
        return [html.bar(length, role), told]

    rows = [["the model as it is", *size(nominal, "nominal"), "", "", ""]]
    for s in found:
        z = "–" if s.role == "winner" or not np.isfinite(s.z) else f"{s.z:z.1f}".replace("-", "−")
        share = f"{100 * s.share:z.1f} %".replace("-", "−") if s.share > -1 else "worse"
        name = title(s.trial) + ("" if s.trial.home else " (unusual place)")
        rows.append([name, *size(s.trial.test, s.role), z, share, s.why])
    kinds = ["", *(KINDS.get(s.role, "") for s in found)]
    heads = (
        "effect and place", "", "leaves, times the noise", "behind, standard errors", "explained",
        "why it lost",
    )  # fmt: skip
    first, rest = slice(0, SHOWN + 1), slice(SHOWN + 1, None)
    return [
        html.table(heads, rows[first], (2, 3, 4), kinds[first]),
        html.folded(
            f"{len(rows) - SHOWN - 1} more",
            html.table(heads, rows[rest], (2, 3, 4), kinds[rest]),
        ),
    ]


def parameters(d: Diagnosis) -> str:
    """Fitted parameters and nuisances with their intervals.

    Those that were bent to a wrong recording mean nothing.
    """
    if d.nominal is None or d.mistakes:
        return ""
    f = d.repaired or d.nominal
    declared = {n: p.value for n, p in d.graph.parameters.items()}
    nominal = {e.name: e.value for e in d.nominal.estimates} if d.repaired else {}

    def row(e: Estimate, *before: Mapping[str, float]) -> list[str]:
        given = [quantity(v[e.name], e.unit) if e.name in v else "–" for v in before]
        return [
            e.name,
            *given,
            "–" if is_undetermined(e, d) else quantity(e.value, e.unit),
            "–" if remark_of(e, d) else interval(*e.ci95, e.unit, e.value),
            remark_of(e, d) or weakness(e),
        ]

    known = ([declared, nominal], ["fitted as it is", "fitted, repaired"])
    columns, heads = known if d.repaired else ([declared], ["fitted"])
    chosen = {p.name: p for t in found_of(d) if d.repaired for p in law_constants(t, d)}
    constants = [
        [p.name, *["–"] * len(columns), quantity(p.value, p.unit), "–", GIVEN]
        for p in chosen.values()
    ]
    together = [
        [k.text, *["–"] * len(columns), quantity(k.value, k.unit),
         interval(*k.ci95, k.unit, k.value), f"of {listed(t.names)} only this"]
        for t in d.tied for k in t.told
    ]  # fmt: skip
    new = [bool(d.repaired) and e.name not in nominal for e in f.estimates]
    return html.section(
        "Parameters",
        html.table(
            ["parameter", "declared", *heads, "95 % interval", "remark"],
            [row(e, *columns) for e in f.estimates] + together + constants,
            range(1, len(columns) + 3),
            [*("named" if n else "" for n in new), *("maybe" for _ in together),
             *("quiet" for _ in constants)],
        ),
        html.heading("nuisances: offsets and small delays of the readings") if f.nuisances else "",
        html.table(
            ("nuisance", "fitted", "95 % interval", "remark"),
            [_with_size(row(e), d) for e in f.nuisances],
            (1, 2),
        ),
        html.paragraph(INTERVALS),
        html.bullets(map(stopped, bent(d))),
        html.bullets(n for n in d.notes if n.startswith(COLOURED)),
        html.paragraph(
            f"The fit {'' if f.status.value.startswith('stopped') else 'has '}{f.status.value}."
        ),
    )  # fmt: skip


def _with_size(row: list[str], d: Diagnosis) -> list[str]:
    """Say of a nuisance that the fit leans on what it does to a reading."""
    said = (n.does for n in d.leanings if n.estimate.name == row[0])
    return [*row[:-1], row[-1] or next(said, "")]


def advice(d: Diagnosis) -> str:
    """Say what to mend in the file first, and what to record next.

    Experiments are told with the separation that they promise.
    """
    mend = file_first(d)
    record = (*(a for a in d.advice if a not in mend), *(x.sentence for x in d.experiments))
    title = "What to mend in the file" if d.mistakes else "What to mend in the file first"
    boxes = ((title, mend), ("What to record next", record))
    return html.trusted(
        "".join(
            html.section(title, html.box(html.bullets(dict.fromkeys(map(spoken, lines)))))
            for title, lines in boxes
        )
    )
