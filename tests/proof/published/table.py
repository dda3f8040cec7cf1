"""The printed table of published protocols."""

from __future__ import annotations

from collections.abc import Sequence

from tests.proof.published.outcome import Compared, Outcome, Reached

WORDS = {True: "reached", False: "NOT reached", None: ""}


def table(outcomes: Sequence[Outcome]) -> str:
    """Return all outcomes as text, one block a recording."""
    return "\n\n".join("\n".join(lines_of(o)) for o in outcomes)


def lines_of(outcome: Outcome) -> list[str]:
    """Return the lines of one outcome: protocol, errors, parameters, notes."""
    whose = "official split" if outcome.official else "own split, not comparable to published ones"
    lines = [
        f"{outcome.name}: {outcome.title}",
        f"  {outcome.protocol}",
        f"  {whose}; split {outcome.split}, init {outcome.init}, {outcome.seconds:.0f} s",
    ]
    lines += [_error(e) for e in outcome.errors]
    lines += [_parameter(p) for p in outcome.parameters]
    return [*lines, *(f"  note: {n}" for n in outcome.notes)]


def _error(e: Reached) -> str:
    target = "" if e.target is None else f"  target {e.target:.4g} {e.unit}"
    text = f"  {e.name:34s} {e.value:10.4g} {e.unit:8s} free-run simulation RMSE{target}"
    return f"{text}  {WORDS[e.reached]}".rstrip()


def _parameter(p: Compared) -> str:
    text = (
        f"  {p.name:34s} {p.value:10.5g} {p.unit:8s} published {p.published:.5g}"
        f" ({100 * p.distance:+.1f} %)"
    )
    allowed = "" if p.tolerance is None else f", {100 * p.tolerance:g} % allowed"
    return f"{text}{allowed}  {WORDS[p.reached]}".rstrip()
