"""The printed NumPy module, run alone in a process that cannot import this project."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se
from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program, ProgramStep
from bondgraph.export.numpy_module import numpy_module
from bondgraph.export.tape import tape_of, written
from bondgraph.export.tape_languages import PYTHON_HELPERS, READABLE
from bondgraph.laws import Coulomb, Hysteretic, Law, QuadraticDrag
from bondgraph.support.errors import BondsightError
from tests.bondgraph.export.printed_models import (
    GRAPHS,
    NOW,
    TIME,
    VOLTAGE,
    A,
    U,
    X,
    Z,
    by_hand,
    cubic_loop,
    nonlinear_loop,
    programs,
    random_point,
)
from tests.bondgraph.hysteresis.examples import EXAMPLES, PI
from tests.settled import simulate
from tests.spring import spring

ALONE = """
import json, sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("bondgraph", "casadi", "sympy", "scipy", "actuators"):
            raise ImportError(name + " is not for this process")

sys.meta_path.insert(0, Refuse())
scope = {}
exec(compile(open(sys.argv[1]).read(), "model.py", "exec"), scope)
given = json.load(sys.stdin)
found = scope["simulate"](given["time"], given["inputs"], substeps=given["substeps"])
json.dump({k: list(v) for k, v in found.items()}, sys.stdout)
"""


def module(model: Program) -> Any:
    made = ModuleType("printed")
    exec(numpy_module(model), made.__dict__)
    return made


def run_alone(model: Program, folder: Path, substeps: int) -> dict[str, np.ndarray]:
    source = folder / "model.py"
    source.write_text(numpy_module(model), encoding="ascii")
    given = {"time": TIME.tolist(), "inputs": {"V_in": VOLTAGE.tolist()}, "substeps": substeps}
    done = subprocess.run(
        [sys.executable, "-I", "-W", "error", "-c", ALONE, str(source)],
        input=json.dumps(given), capture_output=True, text=True, cwd=folder, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return {k: np.array(v) for k, v in json.loads(done.stdout).items()}


@pytest.mark.parametrize(("name", "worst"), [("linear", 2e-4), ("hysteretic", 2e-4),
                                             ("ang", 1e-12), ("al_janaideh", 1e-12)])  # fmt: skip
def test_alone_it_follows_our_simulation_through_minor_loops(
    name: str, worst: float, tmp_path: Path
) -> None:
    graph = GRAPHS[name]()
    model = program(graph)
    expected = simulate(graph, TIME, {"V_in": VOLTAGE}, accuracy=1e-6)
    found = run_alone(model, tmp_path, 4)
    span = float(np.ptp(expected["x"]))
    error = (found["x"] - expected["x"]) / span
    # the worst sample is the second one: the drive starts with a kink and the body rings
    assert float(np.abs(error).max()) < worst
    assert float(np.sqrt(np.mean(error**2))) < 0.1 * worst
    if model.memory:
        kept = np.concatenate([np.array(v) for v in expected.memory.values()])
        np.testing.assert_allclose(found["memory"], kept, rtol=0, atol=1e-3 * np.abs(kept).max())
        # the loop is open: the linear model is far outside the tolerance
        line = np.polyval(np.polyfit(VOLTAGE, expected["x"], 1), VOLTAGE)
        assert float(np.abs(line - expected["x"]).max()) > 50 * worst * span
    if "i" in found:
        rms = float(np.sqrt(np.mean((found["i"] - expected["i"]) ** 2)))
        assert rms < 5e-3 * float(np.ptp(expected["i"]))


@pytest.mark.parametrize("name", [*GRAPHS, "cubic"])
def test_rates_outputs_and_memory_are_the_programs(name: str) -> None:
    model = programs()[name]
    printed = module(model)
    for seed in range(20):
        given, z = random_point(model, seed)
        t, x, _, u, p, m, h = given
        arguments = (t, x, u, p, m, h)
        dx, y = (v.full().ravel() for v in model.rhs(*given))
        np.testing.assert_allclose(printed.unknowns(*arguments), z, rtol=1e-10)
        for found, expected in (
            (printed.rates(*arguments), dx),
            (printed.outputs(*arguments), y),
            (printed.advance(*arguments), model.advance(*given).full().ravel()),
        ):
            scale = float(np.abs(expected).max(initial=1e-300))
            np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10 * scale)


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_operator_as_a_law(name: str) -> None:
    g = spring(1.0, 1.5, None, Hysteretic(EXAMPLES[name]))
    model = program(g)
    printed = module(model)
    memory = model.virgin
    for i, q in enumerate((0.4, 1.7, -0.9, 0.2)):
        given = (0.0, (q, 0.3 * i), (2.0,))
        dx, _ = model.rhs(0.0, given[1], [], 2.0, model.nominal, memory, 0.01)
        found = printed.rates(*given, memory=memory, h=0.01)
        np.testing.assert_allclose(found, dx.full().ravel(), rtol=1e-12, atol=1e-12)
        memory = printed.advance(*given, memory=memory, h=0.01)


def test_an_integrator_of_others_agrees() -> None:
    printed = module(cubic_loop())
    time = np.linspace(0.0, 6.0, 121)
    drive = np.sin(2.0 * time)
    found = printed.simulate(time, {"u": drive}, substeps=2)
    exact = solve_ivp(
        lambda t, x: printed.rates(t, x, [np.interp(t, time, drive)]), (0.0, 6.0), [0.0],
        t_eval=time, rtol=1e-9, atol=1e-11, max_step=0.01,
    )  # fmt: skip
    np.testing.assert_allclose(found["x"], exact.y[0], rtol=0, atol=1e-6)


@pytest.mark.long
def test_steps_are_as_fine_as_the_model_asks() -> None:
    """A resonance of four samples a period: one step a sample is far off."""
    with BondGraph("stage") as g:
        v = One("v")
        Se("F") >> v >> I("m", 1.0)
        v >> R("d", 0.6)
        v >> C("k", stiffness=(2 * np.pi) ** 2)
        v >> Dq("x")
    printed = module(program(g))
    time = np.arange(0.0, 10.0, 0.25)
    drive = np.sign(np.sin(1.3 * time))
    fine = printed.simulate(time, {"F": drive}, substeps=512, hold=True)["x"]
    own = printed.simulate(time, {"F": drive}, hold=True)["x"]
    single = printed.simulate(time, {"F": drive}, substeps=1, hold=True)["x"]
    assert np.abs(own - fine).max() < 2e-4 * np.ptp(fine)
    assert np.abs(single - fine).max() > 2e-2 * np.ptp(fine)


def test_too_few_steps_are_warned_of() -> None:
    printed = module(by_hand(-4e6 * X + 4e6 * U * U))
    time = np.arange(0.0, 1.0, 0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        printed.simulate(time, {"u": np.ones(time.size)})
    printed.simulate.__globals__["_close"] = lambda finer, rougher: False
    with pytest.warns(UserWarning, match="64 steps between samples"):
        printed.simulate(time, {"u": np.ones(time.size)})


def test_inputs_are_held_where_a_converter_holds_them() -> None:
    printed = module(cubic_loop())
    time = np.linspace(0.0, 6.0, 61)
    drive = np.sign(np.sin(2.0 * time))
    found = printed.simulate(time, {"u": drive}, substeps=8, hold=True)
    x, course = np.zeros(1), [0.0]
    for k in range(60):
        run = solve_ivp(
            lambda t, x, u=drive[k]: printed.rates(t, x, [u]), time[k : k + 2], x,
            rtol=1e-9, atol=1e-11,
        )  # fmt: skip
        x = run.y[:, -1]
        course.append(x[0])
    np.testing.assert_allclose(found["x"], course, rtol=0, atol=1e-6)
    straight = printed.simulate(time, {"u": drive}, substeps=8)["x"]
    assert np.abs(straight - course).max() > 1e-3


def test_what_is_read_at_a_sample_sees_its_held_input() -> None:
    with BondGraph("divider") as g:
        loop = One("loop")
        Se("u") >> loop >> R("a", 1.0)
        loop >> R("b", 3.0)
        loop >> Df("i")
    found = module(program(g)).simulate(np.arange(4.0), {"u": [0.0, 4.0, 8.0, -4.0]}, hold=True)
    np.testing.assert_allclose(found["i"], [0.0, 1.0, 2.0, -1.0], atol=1e-12)


def test_the_step_is_of_third_order_and_damps_what_is_stiff() -> None:
    model = by_hand(-A * X - X**3 + U)
    printed = module(model)
    errors = []
    for n in (10, 20, 40):
        time = np.linspace(0.0, 2.0, n + 1)
        end = printed.simulate(time, {"u": np.ones(n + 1)}, substeps=1)["x"][-1]
        fine = printed.simulate(time, {"u": np.ones(n + 1)}, substeps=800 // n)["x"][-1]
        errors.append(abs(end - fine))
    assert 6.0 < errors[0] / errors[1] < 10.0
    assert 6.0 < errors[1] / errors[2] < 10.0
    stiff = module(by_hand(1e9 * (U - A * X))).simulate([0.0, 1.0, 2.0], {"u": [0.0, 1.0, 2.0]})
    np.testing.assert_allclose(stiff["x"], [0.0, 1.0, 2.0], atol=1e-8)


@pytest.mark.parametrize("name", ["linear", "hysteretic"])
def test_ringing_that_the_step_resolves(name: str) -> None:
    """A step of voltage: 17.6 kHz of the body over a ramp of 20 us."""
    graph = GRAPHS[name]()
    time = np.arange(0.0, 4e-4, 2e-6)
    drive = 50.0 * np.clip(time / 2e-5, 0.0, 1.0)
    expected = simulate(graph, time, {"V_in": drive}, accuracy=1e-6)
    found = module(program(graph)).simulate(time, {"V_in": drive}, substeps=2)
    for reading in ("x", "i"):
        worst = float(np.abs(found[reading] - expected[reading]).max())
        assert worst < 2e-4 * float(np.ptp(expected[reading]))


def test_rates_of_inputs_and_time() -> None:
    model = by_hand(A * U + sp.Symbol("d_u"), inputs=("u", "d_u"), input_rates=("d_u",))
    time = np.linspace(0.0, 1.0, 11)
    found = module(model).simulate(time, {"u": time**1})
    np.testing.assert_allclose(found["x"], time**2 / 2 + time, atol=1e-12)
    ramp = module(by_hand(A * NOW)).simulate(time, {"u": 0 * time})
    np.testing.assert_allclose(ramp["x"], time**2 / 2, atol=1e-12)
    late = module(by_hand(A * NOW)).simulate(5.0 + time, {"u": 0 * time})
    np.testing.assert_allclose(late["x"], ramp["x"], atol=1e-12)


@pytest.mark.parametrize("law", [QuadraticDrag(0.7), Hysteretic(PI)], ids=["drag", "plays"])
def test_loops_of_the_engine_are_solved(law: Law) -> None:
    time = np.linspace(0.0, 6.0, 301)
    drive = 3.0 * np.sin(3.0 * time) + np.sin(11.0 * time)
    graph = nonlinear_loop(law)
    model = program(graph)
    assert model.algebraic
    expected = simulate(graph, time, {"V": drive}, accuracy=1e-6)["i"]
    found = module(model).simulate(time, {"V": drive}, substeps=2)["i"]
    assert float(np.abs(found - expected).max()) < 5e-5 * float(np.ptp(expected))


def test_no_solution_is_one_clear_error() -> None:
    printed = module(by_hand(Z + A, (Z**2 + 1,), guess=(0.3,)))
    with pytest.raises(printed.NoConvergence, match=r"at t = 2 s: no solution.*residual"):
        printed.rates(2.0, [0.0], [0.0])


def test_sticking_dry_friction_is_refused_not_invented() -> None:
    with BondGraph("slider") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 0.0, law=Coulomb(force=1.0))
        body >> Dq("x")
    printed = module(program(g))
    time = np.linspace(0.0, 1.0, 11)
    with pytest.raises(printed.NoConvergence):
        printed.simulate(time, {"F": 0.5 * np.sin(3.0 * time)})


def test_wrong_calls_name_what_is_wrong() -> None:
    printed = module(cubic_loop())
    with pytest.raises(ValueError, match=r"u needs 1 values \('u',\), not 2"):
        printed.rates(0.0, [0.0], [1.0, 2.0])
    with pytest.raises(KeyError, match="'v'"):
        printed.simulate([0.0, 1.0], {"v": [0.0, 1.0]})
    with pytest.raises(KeyError, match="'u' is missing"):
        printed.simulate([0.0, 1.0], {})
    with pytest.raises(ValueError, match="rise"):
        printed.simulate([0.0, 0.0], {"u": [0.0, 1.0]})
    with pytest.raises(ValueError, match="not finite"):
        printed.simulate([0.0, 1.0], {"u": [0.0, float("nan")]})


def test_names_of_the_model_cannot_break_the_module() -> None:
    steps = (ProgramStep("class", sp.Symbol("lambda") * 2, None, 'end """ \n import os  # \u00e9'),)
    model = by_hand(sp.Symbol("class") - X, parameter="lambda", unit='"""\n\'', steps=steps,
                    name='a"""\nb\\')  # fmt: skip
    text = numpy_module(model)
    found = {type(n).__name__ for n in ast.walk(ast.parse(text)) if isinstance(n, ast.ImportFrom)}
    assert not found
    imports = [a.name for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Import)
               for a in n.names]  # fmt: skip
    assert sorted(imports) == ["math", "numpy", "warnings"]
    printed = module(model)
    assert printed.PARAMETERS == ("lambda",)
    assert printed.rates(0.0, [0.5], [0.0], [3.0]) == pytest.approx([5.5])


def test_unknown_nodes_are_refused() -> None:
    x = sp.Symbol("x")
    with pytest.raises(BondsightError, match="no CasADi rule for the function gamma"):
        tape_of(sp.gamma(x), str)
    with pytest.raises(KeyError, match="y"):
        tape_of(x + sp.Symbol("y"), lambda s: {"x": "x"}[s.name])


def test_printed_expressions_have_their_value() -> None:
    a, b = sp.symbols("a b")
    for e in (a - (b - 1), a / (b * a), -(a + b) ** 2, a ** sp.Rational(1, 2), (a / b) ** 3,
              sp.sign(a - b) * sp.Abs(-a), sp.Max(a, b) - sp.Min(a, -b), a**-2 * b, sp.pi * a,
              sp.exp(-a) * sp.tanh(b) / 3, a**b, -a * -b, a - 2 * b, (-a) ** 3,
              sp.Max(a, b, 3), sp.Min(a, b, -1), sp.tan(a) + sp.sinh(b) * sp.cosh(a),
              sp.asin(a) - sp.acos(a) * sp.atan(b), sp.log(b) * sp.sin(a) / sp.cos(b)):  # fmt: skip
        found = written(tape_of(e, str), READABLE)
        lines = [f"{target} = {text}" for target, text in found.lines]
        scope: dict[str, Any] = dict(module(cubic_loop()).__dict__) | {"a": 0.7, "b": 1.9}
        exec("\n".join([*PYTHON_HELPERS.values(), *lines, f"value = {found.outputs[0][0]}"]), scope)
        expected = float(e.subs({a: 0.7, b: 1.9}))
        assert scope["value"] == pytest.approx(expected, rel=1e-14), found
