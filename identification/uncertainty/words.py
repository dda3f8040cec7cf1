"""What data and model determine, as a text that can be read without a plot."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import indent

from identification.uncertainty.extra_sensor import SensorGain
from identification.uncertainty.finding import Finding
from identification.uncertainty.information import Information
from identification.uncertainty.practical import Practical
from identification.uncertainty.profile import Profile
from identification.uncertainty.structural import StructuralIdentifiability

DOUBT = " (if the model were right: it leaves out more than noise)"


def intervals(plain: Information, robust: Information | None = None) -> str:
    """Return a table: value, 95 % interval by Fisher information and by the sandwich."""
    lines = []
    s = plain.sensitivities
    for i, n in enumerate(s.names):
        low, high = plain.interval(n)
        text = f"  {n:16s} {s.values[i]:12.6g} {s.units[i]:10s} [{low:.5g}, {high:.5g}]"
        if robust is not None:
            low, high = robust.interval(n)
            text += f"  coloured: [{low:.5g}, {high:.5g}]"
        lines.append(text)
    return "\n".join(lines)


def report(
    *,
    structure: StructuralIdentifiability | None = None,
    sensors: Sequence[SensorGain] = (),
    before: Sequence[Finding] = (),
    practical: Practical | None = None,
    plain: Information | None = None,
    robust: Information | None = None,
    profiles: Sequence[Profile] = (),
    after: Sequence[Finding] = (),
) -> str:
    """Return one text of all parts that are given, the verdict first.

    Parameters
    ----------
    structure, sensors
        Of `identifiability` and `helpful_sensors`: what could be determined at best.
    before, after
        Of `preflight` and `postflight`; kinds that `practical` says already are left out.
    practical, plain, robust
        Of `practical_of` and of a `Fitted`.
    profiles
        Of `profiles`.
    """
    parts: list[str] = []
    if practical is not None:
        doubt = any(f.kind == "misfit" for f in after)
        parts.append(_verdict(practical) + (DOUBT if doubt else ""))
    if structure is not None:
        parts.append(f"by structure\n{indent(str(structure), '  ')}")
    if sensors:
        parts.append("a further sensor would help\n" + indent("\n".join(map(str, sensors)), "  "))
    if before:
        parts.append("before the fit\n" + indent("\n".join(map(str, before)), "  "))
    if plain is not None:
        parts.append("values and 95 % intervals, SI\n" + intervals(plain, robust))
    if practical is not None and practical.statements:
        parts.append("by the data\n" + indent("\n".join(map(str, practical.statements)), "  "))
    if profiles:
        words = [f"{p} [{p.shape}]" for p in profiles]
        parts.append("profiles\n" + indent("\n".join(words), "  "))
    known = {s.kind for s in practical.statements} if practical is not None else set()
    rest = [f for f in after if f.kind not in known]
    if rest:
        parts.append("after the fit\n" + indent("\n".join(map(str, rest)), "  "))
    return "\n".join(parts)


def _verdict(p: Practical) -> str:
    names = p.information.names
    every = {n for s in p.statements for n in s.names} | set(names)
    if not p.statements:
        return f"the data determine every parameter: {', '.join(p.pinned)}"
    if not p.pinned:
        return f"the data determine none of {len(every)} parameters by itself"
    return f"the data determine {len(p.pinned)} of {len(every)} parameters: {', '.join(p.pinned)}"
