"""Sections of the report that show the evidence: rivals, places, parameters, advice."""

from __future__ import annotations

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.effects import CATALOGUE
from identification.diagnosis.regions import Region
from identification.diagnosis.report import html
from identification.diagnosis.report.fit_figures import power_figure
from identification.diagnosis.report.numbers import interval, quantity, short
from identification.diagnosis.report.rivals import (
    places_figure,
    rivals_figure,
    standings,
    title,
)
from identification.diagnosis.report.sections import chosen_of
from identification.diagnosis.report.views import unit_of
from identification.fit import Estimate


def rivals(d: Diagnosis) -> str:
    """All trials, and why they lost."""
    found = standings(d)
    if not found:
        return ""
    rows, kinds = [], []
    for s in found:
        z = "–" if s.role == "winner" or not np.isfinite(s.z) else f"{s.z:z.1f}".replace("-", "−")
        usual = "" if s.trial.home else " (unusual place)"
        rows.append(
            [
                title(s.trial) + usual,
                short(s.trial.test),
                z,
                f"{100 * s.share:z.1f} %".replace("-", "−") if s.share > -1 else "worse",
                s.why,
            ]
        )
        kinds.append({"winner": "named", "alike": "maybe", "locates": "quiet"}.get(s.role, ""))
    heads = ("effect and place", "misfit / floor", "z behind", "explained", "why it lost")
    reasons = d.decision.reasons if d.decision else ()
    return html.section(
        "The rivals, and why they lost",
        html.paragraph(
            "Every effect of the catalogue was fitted at every place where it makes sense. The "
            "misfit is the held-out mean square residual over the noise floor; z is by how many "
            "standard errors one lies behind the best, which is shown as refitted on all samples."
        ),
        html.bullets(map(spoken, reasons)),
        html.figure(rivals_figure(d, found)),
        html.table(heads, rows, (1, 2, 3), kinds),
    )


def places(d: Diagnosis) -> str:
    """Where in the recording and where in the model the misfit sits."""
    if d.nominal is None or d.data is None:
        return ""
    parts = [
        html.heading("in the recording"),
        html.figure(power_figure(d), "Residual power along the recording; noise alone lies at 1."),
        html.bullets(region_words(d, r) for r in d.regions if r.density > 1.3),
    ]
    if d.trials and d.kind in ("missing_physics", "unknown_physics"):
        parts += [
            html.heading("in the model"),
            html.figure(
                places_figure(d),
                "How much of the misfit the best named effect, or any curve without memory, "
                "explains at each element.",
            ),
        ]
    if d.structure is not None:
        same = [c for c in d.structure.classes if len(c) > 1]
        text = "; ".join("{" + ", ".join(c) + "}" for c in same)
        parts.append(
            html.paragraph(
                f"By structure alone these sensors cannot separate {text}." if same
                else "By structure these sensors can tell all elements apart."
            )
        )  # fmt: skip
    return html.section("Where the model fails", *parts)


def spoken(text: str) -> str:
    """Replace the names of effects by words."""
    for e in CATALOGUE:
        text = text.replace(e.name, e.name.replace("_", " "))
    return text


def region_words(d: Diagnosis, r: Region) -> str:
    """Sentence about a part of an axis that carries more than its share of the misfit."""
    channel = r.axis.split()[-1]
    unit = {"time": "s", "frequency": "Hz"}.get(r.axis) or unit_of(d, channel)
    if r.axis.startswith("rate of"):
        unit = f"{unit}/s"
    if unit.startswith("/"):
        unit = f"1{unit}"
    size = max(abs(r.low), abs(r.high))
    low = 0.0 if abs(r.low) < 1e-6 * size else r.low
    times = f"{r.density:.1f}" if r.density < 10 else f"{r.density:.0f}"
    return (
        f"{r.axis}, {interval(low, r.high, unit)}: {100 * r.share:.0f} % of the misfit "
        f"({times} times its share of the axis)"
    )


def parameters(d: Diagnosis) -> str:
    """Fitted parameters and nuisances with their intervals."""
    if d.nominal is None:
        return ""
    chosen = chosen_of(d) if d.kind == "missing_physics" else None
    f = chosen.fit if chosen else d.nominal
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
    if chosen is None:
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
    """Say what to record next, and notes about how the answer came about."""
    lines = html.bullets(map(spoken, d.advice))
    notes = () if d.nominal is None else d.notes
    return "\n".join(
        p
        for p in (
            html.section(
                "What to record next", f'<div class="callout">{lines}</div>' if lines else ""
            ),
            html.section("Notes", html.bullets(notes)),
        )
        if p
    )
