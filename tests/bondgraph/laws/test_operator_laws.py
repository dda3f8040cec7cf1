"""Every operator as the law of a storage, a resistor, a drive and a sensor of one graph."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, Dq, I, One, R, Se, Zero
from bondgraph.equations.derivation import equations
from bondgraph.graph.drives import Drive
from bondgraph.laws import Hysteretic, Sliding
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import Compiled, compile_model
from bondgraph.support.ops import NUMPY
from tests.bondgraph.hysteresis.examples import EXAMPLES

N, STEP = 400, 0.02
PLACES = ("storage", "resistor", "drive", "sensor")


def positioner(operator: Any, place: str) -> BondGraph:
    law = Hysteretic(operator)

    def at(name: str) -> Any:
        return law if place == name else None

    with BondGraph("positioner") as g:
        body = One("body")
        drive = Drive(law=at("drive")) if place == "drive" else None
        supply = Zero("supply")
        Se("F", drive=drive) >> supply >> body >> I("m", 1.0)
        supply >> De("driven")
        body >> R("d", None if place == "resistor" else 1.5, law=at("resistor"))
        if place == "storage":
            body >> C("k", law=law)
            body >> C("guide", stiffness=3.0)
        else:
            body >> C("k", stiffness=3.0)
        body >> Dq("x", law=at("sensor"))
    return g


def inputs(model: Compiled) -> Any:
    t = STEP * np.arange(N)
    u = np.zeros((N, model.n_u))
    u[:, 0] = 3.0 * np.sin(1.9 * t) + 1.5 * np.sin(4.7 * t)
    return u


@pytest.mark.sampled(every=5)
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_law_in_the_graph_is_the_operator(name: str, place: str) -> None:
    """Argument and value of the law over the record satisfy the operator itself."""
    operator = EXAMPLES[name]
    model = compile_model(positioner(operator, place))
    run = run_record(model, model.nominal(), inputs(model), STEP, np.zeros(model.n_x))
    s, value = run.s[:, 0], run.w[:, 0] + Hysteretic(operator).slope * run.s[:, 0]
    assert np.isfinite(run.y).all()
    assert np.ptp(s) > 0.0
    memory = operator.initial_memory(float(s[0]))
    memory = operator.advance(NUMPY, float(s[0]), memory, 0.0)
    memory = tuple(float(m) for m in memory)
    expected, _ = operator.run(s[1:], memory, step=STEP)
    close = {"rtol": 0, "atol": 1e-8 * np.abs(expected).max()}
    np.testing.assert_allclose(value[1:], expected, **close)
    if place in ("drive", "sensor"):  # what comes out is the operator, not what its slope lacks
        outputs = [name for name, *_ in model.model.readings]
        seen = run.y[1:, outputs.index("driven" if place == "drive" else "x")]
        np.testing.assert_allclose(seen, expected, **close)


@pytest.mark.parametrize("name", EXAMPLES)
def test_equations_show_a_named_function(name: str) -> None:
    model = equations(positioner(EXAMPLES[name], "storage"))
    shown = map(model.right_side, model.relations)
    functions = {f.func.__name__ for e in shown for f in e.atoms(_undefined())}
    assert "k" in functions


def _undefined() -> Any:
    from sympy.core.function import AppliedUndef

    return AppliedUndef


@pytest.mark.parametrize("name", [n for n, o in EXAMPLES.items() if o.passive_port == "output"])
def test_sliding_contact_of_an_operator_loses_energy(name: str) -> None:
    with BondGraph("slider") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 0.5, law=Sliding(EXAMPLES[name]))
        body >> Dq("x")
    model = compile_model(g)
    u = inputs(model)
    run = run_record(model, model.nominal(), u, STEP / 4, np.zeros(model.n_x))
    work = np.cumsum(run.s[:, 0] * run.w[:, 0]) * STEP / 4
    assert work[-1] >= -1e-3 * np.abs(work).max()
    assert np.isfinite(run.y).all()
