"""Storages in derivative causality that only seem to follow their own rates: these cancel.

Where a loop of junctions passes the rate of a dependent storage on to what the storage follows,
``q_D = P x + Q u + W r_D`` with ``r_D`` the rates. Where `W` vanishes the storages follow the
states by the same relations with the rates left out. Whether it does is decided exactly, by
residues (`elimination.Residues`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bondgraph.equations.elimination import PRIME, Residues, echelon
from bondgraph.equations.ordering import reached
from bondgraph.equations.refusals import DerivativeCausality
from bondgraph.equations.relation import Relation, Relations, readers_in

MOST = 400
"""Signals between the rates and the storages at the most: the elimination is dense."""


def without_cancelled_rates(made: Relations) -> Relations:
    """Return relations in which no dependent storage seems to follow its own rate.

    Raises
    ------
    DerivativeCausality
        One does, none seems to, or what lies between is not linear, or singular.
    """
    rates = {d.rate for d in made.dependents}
    stores = {d.stored for d in made.dependents}
    between = _between(made.found, rates, stores)
    if not between & stores or len(between) > MOST:
        raise _refused(made, "its own rate decides what it stores")
    if any(_bends(made.found[n], between) for n in between):
        raise _refused(made, "a law lies between its own rate and what it stores")
    follows = _influence(made.found, [n for n in made.found if n in between], sorted(rates))
    if follows is None:
        raise _refused(made, "a singular loop lies between its own rate and what it stores")
    if any(any(follows[s]) for s in between & stores):
        raise _refused(made, "its own rate decides what it stores")
    found = dict(made.found)
    for n in made.found:
        if n in between:
            r = made.found[n]
            name = n if n in stores else _still(n)
            kept = ((c, s) for c, s in r.terms if s not in rates)
            terms = tuple((c, _still(s) if s in between - stores else s) for c, s in kept)
            why = f"{r.reason}; the rates cancel"
            found[name] = replace(r, target=name, terms=terms, reason=why)
    return replace(made, found=found)


def _still(name: str) -> str:
    return f"still_{name}"


def _between(found: Mapping[str, Relation], rates: set[str], stores: set[str]) -> set[str]:
    """Return the signals on the ways from the rates to what is stored."""
    after = reached(rates, readers_in(found.values()))
    before = reached(stores, lambda n: found[n].sources if n in found else ())
    return {n for n in after & before if n in found}


def _bends(r: Relation, between: set[str]) -> bool:
    return r.implicit or r.law is not None or any(s in between for s in r.reads)


def _influence(
    found: Mapping[str, Relation], names: list[str], rates: list[str]
) -> dict[str, list[int]] | None:
    """Return how each signal follows each rate, modulo a prime; None where a loop is singular."""
    residues = Residues()
    at = {n: i for i, n in enumerate([*names, *rates])}
    rows = []
    for n in names:
        row = [0] * len(at)
        row[at[n]] = 1
        for c, s in found[n].terms:
            if s in at:
                row[at[s]] = (row[at[s]] - residues.of(c)) % PRIME
        rows.append(row)
    reduced = echelon(rows)  # what stands beside the unit matrix that the first columns become
    if [pivot for pivot, _ in reduced] != list(range(len(names))):
        return None
    return {n: row[len(names) :] for n, (_, row) in zip(names, reduced, strict=True)}


def _refused(made: Relations, why: str) -> DerivativeCausality:
    names = ", ".join(made.causality.derivative)
    return DerivativeCausality(
        f"{made.graph.name}: {names} cannot be solved in derivative causality ({why}); put a small "
        "resistance in series with a C (in parallel with an I) so that it can store freely"
    )
