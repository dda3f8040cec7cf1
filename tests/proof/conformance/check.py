"""The judge: every expected field of a case against the answer of a tool."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from bondgraph.support.errors import BondsightError
from tests.proof.conformance.answer import Answer, NoPoint
from tests.proof.conformance.brute import mismatch
from tests.proof.conformance.case import Case
from tests.proof.conformance.final import final_error
from tests.proof.conformance.numbers import evaluate, random_values

__all__ = ["REFUSED", "RIGHT", "UNSAID", "VERDICTS", "WRONG", "Judgement", "judge"]

RIGHT, WRONG = "right", "silently wrong"
REFUSED, UNSAID = "refused", "not expressible"
VERDICTS = (RIGHT, WRONG, REFUSED, UNSAID)

POINTS = 3
TOLERANCE = 1e-8
SEED = 20


@dataclass(frozen=True)
class Judgement:
    """Verdict about one case.

    Attributes
    ----------
    case : str
    verdict : str
        One of `VERDICTS`.
    reason : str
        Why it is not right; empty if it is.
    checked : tuple of str
        The fields that were compared.
    seconds : float
        Time of the tool.
    """

    case: str
    verdict: str
    reason: str = ""
    checked: tuple[str, ...] = ()
    seconds: float = 0.0


def judge(case: Case, answer: Answer, seconds: float = 0.0) -> Judgement:
    """Compare an answer with everything that is known about the case.

    Equations are compared as relations that hold at random solutions of the answer, so that it does
    not matter which storage was taken as dependent; they must satisfy the expected equations and,
    independently, all bond equations at once. Fields that the tool does not offer are not compared.
    """
    if case.impossible:
        reason = "an answer to an impossible graph"
        return Judgement(case.identity, WRONG, reason, ("conflict",), seconds)
    checked: list[str] = []
    for name, check in _CHECKS.items():
        try:
            lines = list(check(case, answer))
        except NoPoint as error:
            lines = [str(error)]
        except BondsightError as error:
            return Judgement(case.identity, REFUSED, f"{name}: {error}", tuple(checked), seconds)
        if lines == [_SKIPPED]:
            continue
        checked.append(name)
        if lines:
            reason = f"{name}: {lines[0]}"
            return Judgement(case.identity, WRONG, reason, tuple(checked), seconds)
    return Judgement(case.identity, RIGHT, "", tuple(checked), seconds)


_SKIPPED = "-"


def _order(case: Case, answer: Answer) -> Iterator[str]:
    expected = case.expected["order"]
    if answer.order != expected:
        yield f"{answer.order} instead of {expected}"
    if answer.order != len(answer.rates):
        yield f"{answer.order} reported, {len(answer.rates)} equations"


def _undefined(case: Case, answer: Answer) -> Iterator[str]:
    if names := answer.undefined(case):
        yield f"{', '.join(names)} is undefined"
    have, want = {*answer.rates, *answer.dependent}, set(case.stores)
    if have != want:
        yield f"states {', '.join(sorted(have ^ want))} missing or unknown"


def _state_equations(case: Case, answer: Answer) -> Iterator[str]:
    equations = case.equations
    if not equations:
        yield _SKIPPED
        return
    for point in _points(case, answer):
        for name, e in equations.items():
            value = evaluate(e, point)
            error = abs(point[name] - value) / max(1.0, abs(value), _largest(e, point))
            if not error < TOLERANCE:
                yield f"{name} is {point[name]:.6g}, expected {value.real:.6g} at a random point"


def _bond_equations(case: Case, answer: Answer) -> Iterator[str]:
    if not case.stores:
        yield _SKIPPED
        return
    for point in _points(case, answer):
        error = mismatch(case, point)
        if not error < TOLERANCE:
            yield f"no efforts and flows fit the states and rates (relative mismatch {error:.1e})"
        for e in answer.besides:
            if not abs(evaluate(e, point)) < TOLERANCE * max(1.0, _largest(e, point)):
                yield f"its own relation {e} = 0 does not hold"


def _transfer(case: Case, answer: Answer) -> Iterator[str]:
    if answer.transfer is None or not case.transfers:
        yield _SKIPPED
        return
    random = np.random.default_rng(SEED)
    for t in case.transfers:
        g = answer.transfer(t.input, t.output)
        unknown = {str(x) for x in g.free_symbols} - {"s", *case.parameters}
        if unknown:
            yield f"{t.input} to {t.output}: {', '.join(sorted(unknown))} is undefined"
            return
        for _ in range(POINTS):
            values: dict[str, complex] = {**random_values(case.parameters, random), **answer.fixed}
            values["s"] = complex(*random.uniform(0.4, 1.9, 2))
            value, expected = evaluate(g, values), evaluate(t.function, values)
            if not abs(value - expected) < TOLERANCE * abs(expected):
                yield f"{t.input} to {t.output} is {value:.6g}, expected {expected:.6g}"


def _eigenvalues(case: Case, answer: Answer) -> Iterator[str]:
    if "eigenvalues" not in case.expected:
        yield _SKIPPED
        return
    expected = np.array([complex(*pair) for pair in case.expected["eigenvalues"]])
    ours = answer.eigenvalues or (lambda values: eigenvalues_of(answer, values))
    found = np.asarray(ours(case.values), dtype=np.complex128)
    if len(found) != len(expected):
        yield f"{len(found)} instead of {len(expected)}"
    elif (error := spectrum_error(found, expected)) > 1.0:
        yield f"{np.sort_complex(found)}, expected {np.sort_complex(expected)} ({error:.1e})"


def _final(case: Case, answer: Answer) -> Iterator[str]:
    if "final" not in case.expected:
        yield _SKIPPED
    elif (error := final_error(case, answer)) > case.expected["final"]["tol"]:
        yield f"the state at the end is {error:.1e} off"


def _derivative(case: Case, answer: Answer) -> Iterator[str]:
    if answer.derivative is None:
        yield _SKIPPED
        return
    valid = {frozenset(a) for a in case.expected["derivative_causality"]}
    if answer.derivative not in valid:
        yield f"{_set(answer.derivative)}, expected {' or '.join(_set(v) for v in valid)}"
    if answer.alternatives is not None and answer.alternatives != valid:
        offered = " or ".join(_set(v) for v in answer.alternatives)
        yield f"alternatives {offered}, expected {' or '.join(_set(v) for v in valid)}"


def _loops(case: Case, answer: Answer) -> Iterator[str]:
    if answer.loops is None:
        yield _SKIPPED
    elif answer.loops != case.expected["algebraic_loops"]:
        yield f"{answer.loops}, expected {case.expected['algebraic_loops']}"


_CHECKS: dict[str, Callable[[Case, Answer], Iterator[str]]] = {
    "undefined variables": _undefined,
    "order": _order,
    "state equations": _state_equations,
    "bond equations": _bond_equations,
    "transfer functions": _transfer,
    "eigenvalues": _eigenvalues,
    "final value": _final,
    "derivative causality": _derivative,
    "algebraic loops": _loops,
}


def spectrum_error(found: NDArray[np.complex128], expected: NDArray[np.complex128]) -> float:
    """Distance of two spectra in units of what is allowed (best pairing), so 1 is the limit.

    Allowed are 1e-8 of the eigenvalue and 3e-8 of the largest: a double one is known to half the
    digits.
    """
    if not len(expected):
        return 0.0
    allowed = 1e-8 * np.abs(expected) + 3e-8 * np.max(np.abs(expected)) + 1e-12
    distance = np.abs(found[:, None] - expected[None, :]) / allowed[None, :]
    rows, columns = linear_sum_assignment(np.minimum(distance, 1e12))
    return float(np.max(distance[rows, columns]))


def eigenvalues_of(answer: Answer, values: Mapping[str, float]) -> NDArray[np.complex128]:
    """Eigenvalues of the rates of a linear answer, its implicit unknowns followed."""
    at = {**dict.fromkeys((*answer.rates, *answer.implicit), 0.7), **values, **answer.fixed}

    def slopes(of: Mapping[str, sp.Expr], by: Iterable[str]) -> NDArray[np.float64]:
        names = list(by)
        rows = [[evaluate(e.diff(sp.Symbol(n)), at).real for n in names] for e in of.values()]
        return np.array(rows).reshape(len(of), len(names))

    a = slopes(answer.rates, answer.rates)
    if answer.implicit:
        g_x, g_z = slopes(answer.implicit, answer.rates), slopes(answer.implicit, answer.implicit)
        a = a - slopes(answer.rates, answer.implicit) @ np.linalg.solve(g_z, g_x)
    return np.linalg.eigvals(a).astype(np.complex128)


def _points(case: Case, answer: Answer) -> Iterator[dict[str, float]]:
    random = np.random.default_rng(SEED)
    for _ in range(POINTS):
        yield answer.solution(case, random)


def _largest(e: sp.Expr, point: Mapping[str, float]) -> float:
    """Size of the largest term, to which rounding is relative."""
    return max((abs(evaluate(a, point)) for a in sp.Add.make_args(e)), default=0.0)


def _set(names: frozenset[str]) -> str:
    return "{" + ", ".join(sorted(names)) + "}"
