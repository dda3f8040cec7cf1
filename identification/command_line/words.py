"""A diagnosis in plain text for the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.regions import summary
from identification.diagnosis.verdict import effect_parameters, normalised_error, sentence


def in_words(d: Diagnosis, said: Sequence[str] = ()) -> str:
    """Answer, numbers, place in the recording, rivals, advice."""
    lines = [sentence(d), ""]
    lines += [f"note: {s}" for s in (*said, *d.notes)]
    if d.nominal is not None and d.data is not None:
        before = normalised_error(d.nominal)
        after = normalised_error(d.repaired) if d.repaired else {}
        for c, n in enumerate(d.data.names):
            text = f"held-out error of {n}: {100 * before[n]:.3g} %"
            if after:
                text += f" before, {100 * after[n]:.3g} % with the found effect"
            rmse = (d.repaired or d.nominal).rmse("test")[n]
            lines.append(f"{text} (rms {rmse:.3g}, noise floor {d.data.floor[c]:.3g}, SI)")
    if d.repaired is not None and d.decision is not None and d.decision.chosen is not None:
        for e in effect_parameters(d.decision.chosen, d):
            lines.append(f"  {e.name} = {e.value:.4g} {e.unit}  [{e.ci95[0]:.4g}, {e.ci95[1]:.4g}]")
    if d.kind in ("missing_physics", "unknown_physics"):
        lines += [f"fails at {s}" for s in summary(d.regions)[:3]]
    if d.decision is not None:
        lines += [f"because: {r}" for r in d.decision.reasons]
    lines += [f"next: {a}" for a in d.advice]
    lines.append(f"{d.seconds:.1f} s")
    return "\n".join(lines)
