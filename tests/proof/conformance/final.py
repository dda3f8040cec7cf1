"""The state of an answer at the end of a simulation that a source published."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.proof.conformance.answer import Answer, NoPoint
from tests.proof.conformance.case import Case
from tests.proof.conformance.numbers import evaluate
from tests.proof.conformance.reader import read_expression


def final_error(case: Case, answer: Answer) -> float:
    """Return the largest deviation of the final states from those published.

    Parameters
    ----------
    case : Case
        With an expected ``final``: end time, inputs as expressions of ``t``, first and last states.
    answer : Answer
        Explicit.
    """
    final = case.expected["final"]
    inputs = {n: read_expression(e) for n, e in final.get("u", {}).items()}
    states = list(answer.rates)
    constant = {**case.values, **answer.fixed}

    def rate(t: float, x: NDArray[np.float64]) -> list[float]:
        point = {**constant, **dict(zip(states, x.tolist(), strict=True))}
        point.update({n: evaluate(e, {"t": t}).real for n, e in inputs.items()})
        return [evaluate(answer.rates[n], point).real for n in states]

    start = [float(final["x0"][n]) for n in states]
    run = solve_ivp(rate, (0.0, float(final["t"])), start, method="LSODA", rtol=1e-9, atol=1e-11)
    if not run.success:
        raise NoPoint(f"the simulation stopped: {run.message}")
    end = dict(zip(states, run.y[:, -1].tolist(), strict=True))
    return float(max(abs(end[n] - float(v)) for n, v in final["x"].items()))
