"""A comparison as text, as HTML and as a pandas frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.signals.files.checks import optional
from identification.report import html
from identification.report.numbers import ends, quantity, short, times_noise, told
from identification.report.tables import aligned

if TYPE_CHECKING:
    from identification.validation.compare import Comparison, Contestant


def heads(c: Comparison) -> list[str]:
    """Return the columns of the table of fits."""
    best = c.best.judgement
    readings = [best.material.label(x.channel, x.record) for x in best.channels]
    return [
        "fit", "error / noise", *(f"rms error {r}" for r in readings),
        "fitted numbers", "dAICc", "dBIC", "z behind", "standing",
    ]  # fmt: skip


def rows(c: Comparison) -> list[list[str]]:
    """Return one row a fit; criteria as distances from the least."""
    least = _least(c)
    return [
        [
            x.name,
            short(times_noise(x.held_out)),
            *(quantity(v.judged.rmse, v.unit, 3) for v in x.judgement.channels),
            str(x.judgement.material.n_free),
            *(_over(x, key, least) for key in ("aicc", "bic")),
            "–" if x is c.best else f"{x.behind:.1f}",
            x.words,
        ]
        for x in c.contestants
    ]


def _least(c: Comparison) -> dict[str, float]:
    known = [x.criteria for x in c.contestants if x.criteria is not None]
    return {k: min((float(getattr(v, k)) for v in known), default=np.nan) for k in ("aicc", "bic")}


def _over(x: Contestant, key: str, least: dict[str, float]) -> str:
    return "–" if x.criteria is None else f"{float(getattr(x.criteria, key)) - least[key]:.1f}"


def parameter_table(c: Comparison) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the parameters, one column a fit."""
    names = list(dict.fromkeys(n.name for x in c.contestants for n in x.judgement.material.numbers))
    table = []
    for name in names:
        row = [name]
        for x in c.contestants:
            found = [n for n in x.judgement.material.numbers if n.name == name]
            row.append(
                f"{told(found[0].value, *found[0].ci95, found[0].unit)} "
                f"({ends(*found[0].ci95, found[0].unit, found[0].value)})"
                if found
                else "fixed or absent"
            )
        table.append(row)
    return ["parameter", *(x.name for x in c.contestants)], table


def tests(c: Comparison) -> list[str]:
    """Return one sentence for each likelihood-ratio test."""
    return [f"{n.richer} over {n.simpler}: {n.test.words}" for n in c.nested]


def text_comparison(c: Comparison) -> str:
    """Comparison as plain text."""
    held = any(x.test.n for x in c.best.judgement.channels)
    part = "held-out samples" if held else "training samples (nothing is held out)"
    lines = [f"{len(c.contestants)} fits on {part}, best first", ""]
    lines += aligned(heads(c), rows(c))
    names, table = parameter_table(c)
    if table:
        lines += ["", *aligned(names, table)]
    if c.nested:
        lines += ["", *tests(c)]
    return "\n".join(lines)


def html_comparison(c: Comparison) -> str:
    """Comparison as HTML; every text is escaped."""
    return html.block(*html_parts(c))


def html_parts(c: Comparison) -> tuple[str, str, str]:
    """Fits, parameters and tests, as HTML."""
    numeric = range(1, 6 + len(c.best.judgement.channels))
    fits = html.table(heads(c), rows(c), numeric, ("named",))
    return fits, html.table(*parameter_table(c)), html.bullets(tests(c))


def frame(c: Comparison) -> Any:
    """Return a DataFrame: one row a fit; errors, criteria and parameters as columns, SI."""
    pd = optional("pandas", "to_pandas", "tables")
    records = []
    for x in c.contestants:
        row: dict[str, Any] = {"fit": x.name, "chi2": x.held_out, "behind": x.behind, "p": x.p}
        for v in x.judgement.channels:
            row[f"rmse {v.record} {v.channel}"] = v.judged.rmse
        if x.criteria is not None:
            row |= {k: getattr(x.criteria, k) for k in ("parameters", "aic", "aicc", "bic")}
        for n in x.judgement.material.numbers:
            row |= {n.name: n.value, f"{n.name} low": n.ci95[0], f"{n.name} high": n.ci95[1]}
        records.append(row)
    return pd.DataFrame(records).set_index("fit")
