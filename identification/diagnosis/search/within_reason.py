"""What was named last is taken back where it only holds with values that nothing can have.

A further law that is free to move everything else may win on all samples and be nothing: with an
axis whose belt has become a billionth as stiff, whatever holds the carriage fits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bondgraph.graph.parameter import Parameter
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.explanation.notes import taken_over
from identification.diagnosis.screening.carried import SEVERAL, far_off
from identification.diagnosis.screening.mixups import times
from identification.diagnosis.search.candidates import Candidate


def within_reason(
    decisions: tuple[Decision, ...], declared: Mapping[str, Parameter]
) -> tuple[Decision, ...]:
    """Give no further name whose fit carries several values absurdly far from what is declared.

    Values that are far off beside the first name tell of units, and are told as such.
    """
    made: list[Decision] = []
    named: list[Candidate] = []
    for d in decisions:
        chosen = d.chosen
        if d.kind != "missing_physics" or chosen is None:
            made.append(d)
        elif named and (far := _far(chosen, [*named, chosen], declared)):
            made.append(_taken_back(d, f"{chosen.label} holds only with values that are {far}"))
        else:
            named.append(chosen)
            made.append(d)
    return tuple(made)


def _taken_back(d: Decision, reason: str) -> Decision:
    return replace(
        d, kind="unknown_physics", answer="unknown", physics="", places=(), confidence=0.0,
        reasons=(*d.reasons, reason),
    )  # fmt: skip


def _far(last: Candidate, named: list[Candidate], declared: Mapping[str, Parameter]) -> str:
    """Say how far off values are that no found law has taken over; empty if few are."""
    kept = {n: p for n, p in declared.items() if n not in taken_over(last.fit, named)}
    found = far_off(last.fit, kept)
    if len(found) < SEVERAL:
        return ""
    return (
        f"absurdly far from what is declared, at so many times it: {times(found)}; with the spread "
        "that they can have (a prior) it would not come to that"
    )
