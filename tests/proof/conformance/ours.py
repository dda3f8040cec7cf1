"""Bondsight's own answer to a case."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from bondgraph.causality.assignment import CausalConflict, alternatives
from bondgraph.equations.bond_signals import SignalNames
from bondgraph.equations.derivation import equations
from bondgraph.equations.system import System
from bondgraph.support.errors import BondsightError
from tests.proof.conformance.answer import Answer
from tests.proof.conformance.build import Built, build
from tests.proof.conformance.case import STORES, Case
from tests.proof.conformance.check import REFUSED, RIGHT, Judgement, judge


def judge_bondsight(case: Case) -> Judgement:
    """Derive the equations of a case and judge them."""
    begin = time.perf_counter()
    try:
        answer = answer_of(case)
    except CausalConflict as error:
        spent = time.perf_counter() - begin
        if case.impossible:
            return Judgement(case.identity, RIGHT, "", ("conflict",), spent)
        return Judgement(case.identity, REFUSED, str(error), (), spent)
    except Exception as error:  # a crash is one case in the table, not the end of the table
        return Judgement(case.identity, REFUSED, _said(error), (), time.perf_counter() - begin)
    return judge(case, answer, time.perf_counter() - begin)


def _said(error: Exception) -> str:
    return str(error) if isinstance(error, BondsightError) else repr(error)


def answer_of(case: Case) -> Answer:
    """Return Bondsight's equations of a case, in the names of the case."""
    built = build(case)
    derived = equations(built.graph)
    names, signals = _Names(case, built, derived), SignalNames(built.graph)

    def owners(storages: Iterable[str]) -> frozenset[str]:
        return frozenset(names.element(s) for s in storages)

    def transfer(source: str, output: str) -> sp.Expr:
        kind, _, one_port = output.partition(":")
        signal = signals.at(kind, built.elements[one_port])
        g = names(derived.transfer_function(built.elements[source], signal))
        return g if kind == "e" else case.arrow(one_port) * g

    def eigenvalues(values: Mapping[str, float]) -> NDArray[np.complex128]:
        return np.asarray(derived.eigenvalues(dict(values)), dtype=np.complex128)

    return Answer(
        rates={
            names.state(n): names(e) for n, e in zip(derived.states, derived.rates, strict=True)
        },
        dependent={names.state(n): names(e) for n, e in derived.dependent.items()},
        implicit={
            names.state(a.name): names(e)
            for a, e in zip(derived.algebraic, derived.residuals, strict=True)
        },
        order=derived.order,
        derivative=owners(derived.causality.derivative),
        alternatives=frozenset(owners(a.derivative) for a in alternatives(built.graph)),
        loops=len(derived.causality.free_choices),
        transfer=transfer,
        eigenvalues=eigenvalues,
    )


class _Names:
    """Symbols of the graph -> plain symbols in the names of the case."""

    def __init__(self, case: Case, built: Built, derived: System) -> None:
        self.states = built.states
        self.table: dict[str, sp.Expr] = dict(built.constants)
        back = {new: old for old, new in built.elements.items()}
        self.owners = {new: back[new] for new in back if case.part(back[new]).type in STORES}
        for new, old in back.items():
            if old in case.inputs:
                for ours, theirs in (("", "u_"), ("d_", "du_"), ("d2_", "ddu_")):
                    self.table[ours + new] = sp.Symbol(theirs + old)
        for n in (*derived.states, *derived.dependent, *(a.name for a in derived.algebraic)):
            self.table[n] = sp.Symbol(self.state(n))

    def state(self, name: str) -> str:
        """Name of a state (or unknown) in the case."""
        return self.states.get(name, name)

    def element(self, name: str) -> str:
        """Element a storage (or a port of a field) belongs to, in the case."""
        while name not in self.owners and name[-1:].isdigit():
            name = name[:-1]
        return self.owners.get(name, name)

    def __call__(self, e: sp.Expr) -> sp.Expr:
        """Expression in the names of the case, without assumptions."""
        e = sp.sympify(e)
        return e.xreplace({s: self.table.get(str(s), sp.Symbol(str(s))) for s in e.free_symbols})
