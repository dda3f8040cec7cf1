"""Sections of the report that show the evidence: rivals, parameters, advice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.decision import Decision
from identification.diagnosis.report import html
from identification.diagnosis.report.found import extra
from identification.diagnosis.report.numbers import interval, quantity, short
from identification.diagnosis.report.rivals import Standing, nominal_misfit, standings, title
from identification.estimation.single_record import Estimate

SHOWN = 12
"""Rivals that are listed; the others are behind a line."""
DIVERGED = 1e3
"""Held-out misfit over the nominal one from which a fit is said to diverge."""


def rivals(d: Diagnosis) -> str:
    """All trials of every step, and why they lost."""
    parts: list[str] = []
    for k, step in enumerate(d.steps):
        found = standings(d, step)
        if not found and not step.reasons:
            continue
        if len(d.steps) > 1:
            parts.append(html.heading(_step_title(k, step)))
        parts.append(html.bullets(map(spoken, step.reasons)))
        if found:
            parts += _rival_tables(found, nominal_misfit(d, step))
    if not parts:
        return ""
    explained = (
        "The misfit is the held-out mean square residual over the noise floor, so 1 is noise; the "
        "bar is its logarithm. z is by how many standard errors one lies behind the best, which "
        "is shown as refitted on all training samples, none left out."
    )
    return html.section("The rivals, and why they lost", html.paragraph(explained), *parts)


def _step_title(k: int, step: Decision) -> str:
    which = ("first", "second", "third", "fourth")[k] if k < 4 else f"{k + 1}th"
    if step.chosen is not None and step.kind == "missing_physics":
        return f"{which} step: {spoken(step.chosen.label)}"
    return f"{which} step: nothing more to name"


def _rival_tables(found: Sequence[Standing], nominal: float) -> list[str]:
    values = [nominal, *(s.trial.test for s in found if s.trial.test < DIVERGED * nominal)]
    low, high = np.log(0.9 * min(1.0, *values)), np.log(max(*values, 1.1))

    def length(v: float) -> float:
        return float((np.log(v) - low) / (high - low)) if np.isfinite(v) and v > 0 else 1.0

    def size(v: float) -> str:
        return short(v) if v < DIVERGED * nominal else "diverges"

    rows = [
        ["the model as it is", html.bar(length(nominal), "nominal"), short(nominal), "", "", ""]
    ]
    kinds = [""]
    for s in found:
        z = "–" if s.role == "winner" or not np.isfinite(s.z) else f"{s.z:z.1f}".replace("-", "−")
        usual = "" if s.trial.home else " (unusual place)"
        share = f"{100 * s.share:z.1f} %".replace("-", "−") if s.share > -1 else "worse"
        bar = html.bar(length(s.trial.test), s.role)
        rows.append([title(s.trial) + usual, bar, size(s.trial.test), z, share, s.why])
        kinds.append({"winner": "named", "alike": "maybe", "locates": "quiet"}.get(s.role, ""))
    heads = ("effect and place", "", "misfit / floor", "z behind", "explained", "why it lost")

    def table(part: slice) -> str:
        return html.table(heads, rows[part], (2, 3, 4), kinds[part], trusted=(1,))

    more = len(rows) - SHOWN - 1
    tables = [table(slice(0, SHOWN + 1))]
    if more > 0:
        tables.append(html.folded(f"{more} more", table(slice(SHOWN + 1, None))))
    return tables


def spoken(text: str) -> str:
    """Replace the names of effects by words."""
    for e in CATALOGUE:
        text = text.replace(e.name, e.name.replace("_", " "))
    return text


def parameters(d: Diagnosis) -> str:
    """Fitted parameters and nuisances with their intervals."""
    if d.nominal is None:
        return ""
    f = d.repaired or d.nominal
    declared = d.graph.parameters
    nominal = {e.name: e for e in d.nominal.estimates}
    rows, kinds = [], []
    for e in f.estimates:
        given = quantity(declared[e.name].value, e.unit) if e.name in declared else "–"
        before = quantity(nominal[e.name].value, e.unit) if e.name in nominal else "–"
        rows.append(
            [
                e.name,
                given,
                before,
                quantity(e.value, e.unit),
                interval(*e.ci95, e.unit),
                _remark(e),
            ]
        )
        kinds.append("named" if e.name not in nominal else "")
    heads = [
        "parameter",
        "declared",
        "fitted, nominal",
        "fitted, repaired",
        "95 % interval",
        "remark",
    ]
    numeric = [1, 2, 3, 4]
    if d.repaired is None:
        rows = [r[:2] + r[3:] for r in rows]
        heads, numeric = [heads[0], heads[1], "fitted", *heads[4:]], [1, 2, 3]
    nuisances = [
        [e.name, quantity(e.value, e.unit), interval(*e.ci95, e.unit), _remark(e)]
        for e in f.nuisances
    ]
    return html.section(
        "Parameters",
        html.table(heads, rows, numeric, kinds),
        html.heading("nuisances: offsets and small delays of the readings") if nuisances else "",
        html.table(("nuisance", "fitted", "95 % interval", "remark"), nuisances, (1, 2)),
        html.paragraph(
            f"The fit {'' if f.status.value.startswith('stopped') else 'has '}{f.status.value}."
        ),
    )


def _remark(e: Estimate) -> str:
    if e.at_bound:
        return "at its bound"
    low, high = e.ci95
    if 0 < 100 * low < high:
        return "hardly determined"
    if np.isfinite([low, high]).all() and low < 0 < high:
        return "may be zero"
    return ""


def advice(d: Diagnosis) -> str:
    """Say what to record next."""
    lines = [*map(spoken, d.advice), *_experiments(d)]
    listed = html.bullets(dict.fromkeys(lines))
    boxed = f'<div class="callout">{listed}</div>' if listed else ""
    return html.section("What to record next", boxed)


def _experiments(d: Diagnosis) -> list[str]:
    """Return computed experiments with the separation that they promise."""
    found = []
    for x in extra(d, "experiments"):
        said = getattr(x, "sentence", None) or getattr(x, "words", None) or x
        z = getattr(x, "expected_z", None)
        known = isinstance(z, float) and np.isfinite(z) and "separation" not in str(said)
        found.append(spoken(str(said)) + (f" (expected separation z {z:.1f})" if known else ""))
    return found
