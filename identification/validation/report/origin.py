"""Where the numbers of a report come from."""

from __future__ import annotations

from textwrap import wrap

from identification.estimation.archive import provenance
from identification.estimation.result import Estimation
from identification.report import html
from identification.report.words import spaced
from identification.validation.judge import Judgement

HEADS = ("recording", "samples", "rate", "channels", "SHA-256 of the file")


def origin(j: Judgement, command: str = "") -> str:
    """Return recordings with their checksums, options of the fit, versions, command."""
    rows = [
        [r.name, str(r.time.size), f"{1 / r.dt:.6g} Hz", ", ".join((*r.inputs, *r.names)),
         " ".join(wrap(r.sha256, 16)) or "none: made in memory"]
        for r in j.material.records
    ]  # fmt: skip
    made = provenance(command)
    pairs = [("made by", made["software"])]
    pairs += [(name, made[name]) for name in ("python", "numpy", "scipy", "casadi")]
    if j.estimation is not None:
        pairs = [*_options(j.estimation), *pairs]
    return html.section(
        "Provenance",
        html.table(HEADS, rows, (1, 2)),
        html.facts(pairs),
        html.paragraph(command, "mono"),
    )


def _options(e: Estimation) -> list[tuple[str, str]]:
    study = e.study
    noise = study.noise if isinstance(study.noise, str) else "known: " + ", ".join(study.noise)
    initial = study.initial if isinstance(study.initial, str) else "some known, others fitted"
    fixed = ", ".join(f"{k} = {v:.6g}" for k, v in study.fixed.items())
    read = dict.fromkeys(f"{r.name}: {note}" for r in study.records for note in r.notes)
    return [
        ("method", spaced(e.method)),
        ("optimiser", spaced(e.optimiser)),
        ("iterations", str(len(e.trace) - 1)),
        ("computed in", f"{e.seconds:.3g} s"),
        ("between samples", e.setting.hold),
        ("sub-steps", ", ".join(map(str, e.setting.n_sub))),
        ("noise", noise),
        ("initial states", initial),
        ("held fixed", fixed),
        ("splits", "; ".join(dict.fromkeys(s.rule for s in study.splits))),
        ("on reading", "; ".join(read)),
    ]
