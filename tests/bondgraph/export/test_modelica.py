"""Modelica text read back by pymoca: derivatives, readings and memory as the program has them.

pymoca parses and flattens `when` but cannot run it. The test takes the `when` out of the tree,
reads the discrete variables as inputs, and checks the assignments inside as plain equations with
``m`` for ``pre(m)``; that a tool fires ``sample`` in time is checked by no consumer here.
"""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pymoca.ast
import pymoca.backends.casadi.generator as pymoca_casadi
import pymoca.parser
import pytest
import sympy as sp

from actuators.models.catalogue import MODELS
from bondgraph import TF, BondGraph, C, De, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program, ProgramStep
from bondgraph.export.modelica import modelica
from bondgraph.export.modelica_language import RESERVED, Identifiers, quoted, unit_text
from bondgraph.export.numpy_module import numpy_module
from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import symbol
from bondgraph.laws import (
    DeadZone,
    Hysteretic,
    Law,
    LuGre,
    PiecewiseLinear,
    Polynomial,
    QuadraticDrag,
    Saturation,
    Sliding,
    Stribeck,
    TableLaw,
)
from bondgraph.support.errors import BondsightError, UnusableInput
from tests.bondgraph.hysteresis.examples import EXAMPLES, TIMED
from tests.settled import simulate

SEED = 20240611


@pytest.fixture(autouse=True)
def division(monkeypatch: pytest.MonkeyPatch) -> None:
    """pymoca divides by a method that CasADi 3.7 no longer has."""
    if not hasattr(ca.MX, "__div__"):
        monkeypatch.setitem(pymoca_casadi.OP_MAP, "/", "__truediv__")


def parsed(text: str) -> Any:
    tree = pymoca.parser.parse(text)
    assert tree is not None, "pymoca finds a syntax error"
    return tree


def model_class(tree: Any) -> Any:
    (found,) = (c for c in tree.classes.values() if c.type == "model")
    return found


def without_pre(node: Any) -> Any:
    """``m`` for ``pre(m)``."""
    if isinstance(node, pymoca.ast.Expression):
        if str(node.operator) == "pre":
            return node.operands[0]
        node.operands = [without_pre(o) for o in node.operands]
    return node


@dataclass
class Read:
    """What pymoca makes of a text: a residual over unknowns and what is known."""

    model: Any

    def solve(self, known: dict[str, float], guess: dict[str, float]) -> dict[str, float]:
        """All unknowns by Newton's method."""
        m = self.model
        given = [v.symbol for v in (*m.states, *m.inputs, *m.parameters)] + [m.time]
        unknown = [v.symbol for v in (*m.der_states, *m.alg_states)]
        residual = ca.vertcat(*m.equations)
        names = {s.name() for s in (*given, *unknown)}
        given += [s for s in ca.symvar(residual) if s.name() not in names]
        assert residual.numel() == len(unknown)
        column = ca.vertcat(*unknown)
        f = ca.Function("f", [column, *given], [residual, ca.jacobian(residual, column)])
        values = [known[s.name()] for s in given]
        at = np.array([guess.get(s.name(), 0.0) for s in unknown])
        for _ in range(60):
            miss, slope = (np.array(v) for v in f(at, *values))
            move = np.linalg.solve(slope, -miss.ravel())
            at = at + move
            if np.all(np.abs(move) <= 1e-13 * (1e-30 + np.abs(at))):
                break
        return {s.name(): float(v) for s, v in zip(unknown, at, strict=True)}


def read(text: str) -> tuple[Read, Read | None]:
    """The continuous part, and the assignments of `when` as equations for ``next_NAME``."""
    first = parsed(text)
    trees = [first, copy.deepcopy(first)]
    main, other = (model_class(t) for t in trees)
    whens = [e for e in main.equations if isinstance(e, pymoca.ast.WhenEquation)]
    for c in (main, other):
        c.equations = [e for e in c.equations if not isinstance(e, pymoca.ast.WhenEquation)]
        for s in c.symbols.values():
            if "discrete" in s.prefixes:
                s.prefixes = ["input"]
    continuous = Read(pymoca_casadi.generate(trees[0], main.name))
    if not whens:
        return continuous, None
    (when,) = whens
    assert str(when.conditions[0].operator) == "sample"
    for e in when.blocks[0]:
        e.right = without_pre(e.right)
        left = e.left if isinstance(e.left, list) else [e.left]
        for reference in left:
            new = copy.deepcopy(other.symbols[reference.name])
            new.name, new.prefixes = f"next_{reference.name}", []
            reference.name = new.name
            other.symbols[new.name] = new
        other.equations.append(e)
    return continuous, Read(pymoca_casadi.generate(trees[1], other.name))


def assert_same_numbers(p: Program, scale: dict[str, float] | None = None, times: int = 4) -> None:
    """Derivatives, readings and next memory at random points, in pymoca and in the program."""
    text = modelica(p)
    continuous, update = read(text)
    stated = {v.symbol.name(): v.value for v in continuous.model.parameters}
    assert all(stated[n] == v for n, v in zip(p.parameters, p.nominal, strict=True))
    memory, last, rng = np.array(p.virgin), 0.0, np.random.default_rng(SEED)
    for _ in range(times):
        x, u = (
            np.array([(scale or {}).get(n, 1.0) * rng.normal() for n in names])
            for names in (p.states, p.inputs)
        )
        q = np.array(p.nominal) * rng.uniform(0.7, 1.4, len(p.nominal))
        t = last + rng.uniform(1e-3, 5e-3)
        known = {n: float(v) for n, v in zip(p.parameters, q, strict=True)}
        known |= dict(zip(p.states, x, strict=True)) | dict(zip(p.inputs, u, strict=True))
        known |= dict(zip(p.memory, memory, strict=True))
        known |= {"time": t, "memory_time": last, "memory_step": 1e-3}
        known |= {f"der({n.removeprefix('d_')})": known[n] for n in p.input_rates}
        guess = dict(zip(p.algebraic, p.guess, strict=True))
        found = continuous.solve(known, guess)
        z = [found[n] for n in p.algebraic]
        point = (t, x, z, u, q, memory, t - last)
        rates, readings = (np.array(v).ravel() for v in p.rhs(*point))
        near = 1e-9 * float(np.max(np.abs([*rates, *readings, 1e-30])))
        np.testing.assert_allclose(
            [found[f"der({n})"] for n in p.states], rates, rtol=1e-9, atol=near
        )
        np.testing.assert_allclose([found[n] for n in p.outputs], readings, rtol=1e-9, atol=near)
        if p.algebraic:
            size = float(np.max(np.abs([*rates, *readings])))
            np.testing.assert_allclose(np.array(p.residual(*point)).ravel(), 0.0, atol=1e-9 * size)
        if p.memory:
            assert update is not None
            new = update.solve(known, guess)
            memory = np.array(p.advance(*point)).ravel()
            got = [new[f"next_{n}"] for n in p.memory]
            np.testing.assert_allclose(got, memory, rtol=1e-9, atol=1e-15)
            last = t
    assert not p.memory or np.any(memory != np.array(p.virgin))


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", MODELS)
def test_models_of_the_catalogue(name: str) -> None:
    if name == "stack_lumped_maxwell":
        pytest.skip("the reader's plain Newton on all equations at once meets a singular matrix")
    try:
        p = program(MODELS[name]())
    except BondsightError as error:
        pytest.skip(f"no program: {error}")
    sizes = {"q_C_nl": 1e-8, "q_k": 1e-6, "p_m": 1e-3, "V_in": 50.0}
    assert_same_numbers(p, sizes)


SMOOTH: dict[str, Law] = {
    "stribeck": Stribeck(2.0, 0.5, 0.3),
    "drag": QuadraticDrag(0.7),
    "table": TableLaw((-1.0, 0.0, 0.5, 2.0), (-2.0, 0.0, 0.2, 3.0), "linear", True, True, 1.0),
    "pchip": TableLaw((-1.0, 0.0, 0.5, 2.0), (-2.0, 0.0, 0.2, 3.0), "pchip", False, False, 0.5),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_laws_without_memory(name: str) -> None:
    with BondGraph("laws") as g:
        body = One("body")
        Se("F", unit="N", drive=Drive(Saturation(-1.0, 1.5, 0.2))) >> body
        body >> I("m", 2.0, unit="kg")
        own = 0.5 if SMOOTH[name].slope is None else None
        body >> R("b", own, unit="N*s/m", law=SMOOTH[name])
        body >> C("k", stiffness=3.0, unit="N/m", law=Polynomial(0.1, 2.0))
        body >> Df("v", unit="m/s", law=DeadZone(0.1, 0.3))
        body >> Dq("x", unit="m", law=PiecewiseLinear())
    p = program(g)
    assert len(p.laws) == 5
    assert_same_numbers(p)


@pytest.mark.sampled(every=4)
@pytest.mark.parametrize("name", EXAMPLES)
def test_operators_with_memory(name: str) -> None:
    with BondGraph("operators") as g:
        body = One("body")
        Se("F", unit="N", drive=Drive(Hysteretic(EXAMPLES[name]))) >> body
        body >> I("m", 2.0, unit="kg")
        body >> R("b", 0.5, unit="N*s/m")
        body >> Df("v", unit="m/s")
    p = program(g)
    if p.memory:
        assert_same_numbers(p, {"F": 3.0}, times=3)
    assert ("memory_time" in modelica(p)) == (name in TIMED)


@pytest.mark.parametrize("law", [LuGre(), Sliding(EXAMPLES["dahl"])], ids=["lugre", "sliding"])
def test_friction_with_memory(law: Law) -> None:
    with BondGraph("friction") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 2.0, unit="kg")
        body >> R("b", 0.5, unit="N*s/m", law=law)
        body >> Df("v", unit="m/s")
    assert_same_numbers(program(g), times=3)


def test_minor_loops_with_the_test_as_event_loop() -> None:
    """pymoca's functions, sampled as `when sample` says, against the simulation."""
    graph = MODELS["stack_ang"]()
    p = program(graph)
    continuous, update = read(modelica(p))
    assert update is not None
    time = np.linspace(0.0, 1.0, 161)
    volts = 60.0 * np.sin(7.0 * time) * np.sin(31.0 * time) + 30.0 * time
    wanted = simulate(graph, time, {"V_in": volts})["x"]
    memory, found = dict(zip(p.memory, p.virgin, strict=True)), []
    known = dict(zip(p.parameters, p.nominal, strict=True))
    known |= {"memory_step": 1.0 / 160, "memory_time": 0.0}
    for t, v in zip(time, volts, strict=True):
        known |= {"time": t, "V_in": v} | memory
        found.append(continuous.solve(known, {})["x"])
        new = update.solve(known, {})
        memory = {n: new[f"next_{n}"] for n in p.memory}
    assert np.ptp(wanted) > 0.0
    np.testing.assert_allclose(found, wanted, atol=1e-9 * float(np.ptp(wanted)))


def loop() -> Program:
    """``dx = -x + z + t``, ``0 = z + z^3 - a x - u``, and an input rate; made by hand."""
    names = ("t", "x", "z", "u", "p", "m", "h")
    t, x, z, u, q, m, h = (
        ca.SX.sym(n, s) for n, s in zip(names, (1, 1, 1, 2, 1, 0, 1), strict=True)
    )
    x_, z_, u_, d_, e_, a_ = (
        symbol("x"),
        symbol("z"),
        symbol("u"),
        symbol("d_u"),
        symbol("e_R"),
        symbol("a", positive=True),
    )
    ins = [t, x, z, u, q, m, h]

    def function(name: str, outs: list[Any], labels: list[str]) -> ca.Function:
        return ca.Function(name, ins, outs, list(names), labels)

    return Program(
        name="loop",
        states=("x",),
        algebraic=("z",),
        inputs=("u", "d_u"),
        parameters=("a",),
        memory=(),
        outputs=("y",),
        input_rates=("d_u",),
        units={"x": "m", "a": "N*s/m", "y": "V"},
        nominal=(0.3,),
        start=(0.25,),
        guess=(0.1,),
        virgin=(),
        steps=(ProgramStep("e_R", z_ + z_**3, None, "R"),),
        laws=(),
        rates=(-x_ + z_ + symbol("time"),),
        readings=(x_ * d_ + sp.exp(-z_) / a_ ** sp.Rational(3, 2),),
        residuals=(e_ - a_ * x_ - u_,),
        rhs=function("rhs", [-x + z + t, x * u[1] + ca.exp(-z) / q[0] ** 1.5], ["dx", "y"]),
        residual=function("residual", [z + z**3 - q[0] * x - u[0]], ["g"]),
        advance=function("advance", [ca.SX(0, 1)], ["m_next"]),
    )


def test_algebraic_unknowns_and_input_rates() -> None:
    text = modelica(loop())
    assert "d_u = der(u);" in text
    assert re.search(r"0\.0 = e_R - ", text)
    assert 'Real x(start = 0.25, fixed = true, unit="m");' in text
    assert "Real z(start = 0.1)" in text
    assert "startTime = 0" in text  # it reads the time, which counts from the start
    assert 'parameter Real a(unit="N.s/m") = 0.3;' in text
    assert_same_numbers(loop())


def test_a_second_derivative_is_that_of_the_first() -> None:
    """A base whose displacement is recorded moves an inertia: its force is read."""
    with BondGraph("shaker") as g:
        base, mass = Zero("base"), One("mass")
        Sf("b", unit="m", given="integral") >> base >> mass >> I("m", 2.0, unit="kg")
        base >> De("F", unit="N")
    made = program(g)
    assert made.input_rates == ("d_b", "d2_b")
    lines = [line.strip() for line in modelica(made).splitlines()]
    assert {"d_b = der(b);", "d2_b = der(d_b);"} <= set(lines)
    scope: dict[str, Any] = {}
    exec(compile(numpy_module(made), "shaker", "exec"), scope)
    t = np.linspace(0.0, 1.0, 11)
    with pytest.raises(KeyError, match="'d2_b' is missing"):
        scope["simulate"](t, {"b": t**2})
    found = scope["simulate"](t, {"b": t**2, "d2_b": 2.0 + 0 * t})
    assert found["F"] == pytest.approx(4.0 + 0 * t)  # m d2b


HOSTILE_NAMES = ("der", "model", "time", "end", "Real", "sample", "memory_step", "max", "é", "__x")


def test_reserved_and_foreign_names() -> None:
    with BondGraph('end x; "quoted" \\ \n */ model') as g:
        body = One("time")
        Se("der", unit="N") >> body
        body >> I("model", 2.0, unit="kg")
        body >> R("end", 0.5, unit="N*s/m", law=QuadraticDrag(0.5))
        body >> R("Änderung", 0.25, unit="N*s/m")
        body >> C("e_lock", law=Hysteretic(EXAMPLES["prandtl_ishlinskii"]))
        body >> Df("equation", unit="m/s")
    p = program(g)
    text = modelica(p)
    assert text.isascii()
    tree = parsed(text)
    written = [c for c in tree.classes.values() if c.type in ("model", "function")]
    declared = [s for c in written for s in c.symbols]
    assert len(written) == 4
    assert not set(declared) & RESERVED
    assert {"der_", "model_", "end_", "equation_"} <= set(declared)
    assert "input Real der_" in text
    assert '"name in the graph: der"' in text
    continuous, _ = read(text)
    own = {n: n + "_" for n in ("der", "model", "end", "equation")}
    rng = np.random.default_rng(SEED)
    values = {n: rng.normal() for n in (*p.states, *p.inputs)}
    known = {own.get(n, n): v for n, v in values.items()}
    known |= {"u00c4nderung": 0.25, "time": 0.0, "memory_step": 1.0}
    known |= {own.get(n, n): v for n, v in zip(p.parameters, p.nominal, strict=True)}
    known |= dict(zip(p.memory, p.virgin, strict=True))
    taken = {v.symbol.name() for v in continuous.model.states}
    assert len(taken) == len(p.states)
    found = continuous.solve(known, {})
    x, u = ([values[n] for n in names] for names in (p.states, p.inputs))
    rates, readings = p.rhs(0.0, x, [], u, p.nominal, p.virgin, 0.0)
    np.testing.assert_allclose(
        [found[f"der({n})"] for n in p.states], np.array(rates).ravel(), rtol=1e-9
    )
    np.testing.assert_allclose(found["equation_"], float(readings[0]), rtol=1e-9)


@pytest.mark.parametrize("name", HOSTILE_NAMES)
def test_identifiers(name: str) -> None:
    names = Identifiers()
    made = [names.new(name) for _ in range(3)]
    assert len(set(made)) == 3
    assert not set(made) & RESERVED
    for found in made:
        assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", found)


@pytest.mark.parametrize("name", ["", "a" * 300])
def test_impossible_identifiers(name: str) -> None:
    with pytest.raises(UnusableInput, match="cannot stand in a Modelica model"):
        Identifiers().new(name)


@pytest.mark.parametrize(
    "comment",
    ['"; end loop; model evil "', "line\nbreak */ // x", "back\\", "\x00\x1b[2J", "é" * 999],
)
def test_hostile_comments(comment: str) -> None:
    base = loop()
    step = replace(base.steps[0], comment=comment)
    hostile = replace(base, steps=(step,), name=comment, units={"x": comment, "a": comment})
    text = modelica(hostile)
    assert text.isascii()
    tree = parsed(text)
    assert [c.type for c in tree.classes.values()].count("model") == 1
    assert len(model_class(tree).equations) == 5
    assert len(text.splitlines()) == len(modelica(base).splitlines())
    line = quoted(comment)
    assert "\n" not in line
    assert re.fullmatch(r'"[^"\\]*"', line)


def test_units() -> None:
    for unit in ("N*s/m", "C*m/(V/m)", "kg", "1", "1/s", "V/m"):
        assert re.fullmatch(r"(1|[A-Za-z0-9.]+)(/(\w+|\([A-Za-z0-9.]+\)))?", unit_text(unit))
    assert unit_text("mm") == ""
    assert unit_text('V"') == ""


class Quotient(Law):
    """Rate of the argument: no value at the time of the memory itself."""

    name: ClassVar[str] = "quotient"
    timed = True
    n_memory = 1

    def initial_memory(self, s: float) -> tuple[float, ...]:
        return (s,)

    def advance(self, ops: Any, s: Any, memory: Any, p: Any) -> tuple[Any, ...]:
        return (s,)

    def deviation(self, ops: Any, s: Any, memory: Any, p: Any) -> Any:
        return (s - memory[0]) / p[-1]


class Erf(Law):
    name: ClassVar[str] = "erf"

    def deviation(self, ops: Any, s: Any, memory: Any, p: Any) -> Any:
        return ca.erf(s)


@pytest.mark.parametrize(
    ("law", "message"),
    [(Quotient(), "law quotient of V has no value right after"), (Erf(), "cannot hold this law")],
)
def test_laws_that_modelica_cannot_carry(law: Law, message: str) -> None:
    with BondGraph("refused") as g:
        tip = Zero("tip")
        Se("V", drive=Drive(law)) >> TF("G", 2.0) >> tip >> De("x")
        tip >> R("R_1", 1.0)
    with pytest.raises(BondsightError, match=message):
        modelica(program(g))


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan"), float("inf")])
def test_memory_step(step: float) -> None:
    with pytest.raises(UnusableInput, match="not a positive number"):
        modelica(loop(), memory_step=step)
