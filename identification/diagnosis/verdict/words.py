"""A diagnosis in plain text for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.regions import summary
from identification.diagnosis.verdict.document import effect_parameters, normalised_error, sentence

__all__ = ["in_words"]


def in_words(d: Diagnosis, said: Sequence[str] = ()) -> str:
    """Answer, numbers, place in the recording, every step, rivals, advice."""
    lines = [sentence(d), ""]
    lines += [f"note: {s}" for s in (*said, *d.notes)]
    lines += _errors(d)
    lines += _parameters(d)
    if d.kind in ("missing_physics", "unknown_physics"):
        lines += [f"fails at {s}" for s in summary(d.regions)[:3]]
    lines += _reasons(d)
    lines += [f"next: {a}" for a in d.advice]
    lines.append(f"{d.seconds:.1f} s")
    return "\n".join(lines)


def _errors(d: Diagnosis) -> list[str]:
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
        rmse = (d.repaired or d.nominal).rmse("test")[n]
        lines.append(f"{text} (rms {rmse:.3g}, noise floor {d.data.floor[c]:.3g}, SI)")
    return lines


def _parameters(d: Diagnosis) -> list[str]:
    """Parameters of every named effect, under its name where there are several."""
    if d.repaired is None:
        return []
    lines = []
    for step in d.findings:
        if step.chosen is None:
            continue
        if len(d.findings) > 1:
            lines.append(f"{step.chosen.label} (confidence {step.confidence:.2f}):")
        for e in effect_parameters(step.chosen, d):
            lines.append(f"  {e.name} = {e.value:.4g} {e.unit}  [{e.ci95[0]:.4g}, {e.ci95[1]:.4g}]")
    return lines


def _reasons(d: Diagnosis) -> list[str]:
    """Why each step ended as it did; after the first they say which one they belong to."""
    lines = []
    for number, step in enumerate(d.steps, start=1):
        word = "because" if number == 1 else f"step {number}"
        lines += [f"{word}: {r}" for r in step.reasons]
        if number > 1 and step.kind == "unknown_physics":
            lines.append(f"step {number}: something more is missing that may not be named")
    return lines
