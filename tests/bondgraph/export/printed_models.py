"""Programs for the tests of printed code: stacks with minor loops, and loops made by hand."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import sympy as sp

from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_al_janaideh, stack_ang
from bondgraph import BondGraph, C, Df, One, R, Se
from bondgraph.equations.casadi_printer import to_casadi
from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program, ProgramStep
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Law

TIME = np.arange(0.0, 0.1, 2e-4)
VOLTAGE = 40.0 * np.sin(2 * np.pi * 20 * TIME) + 25.0 * np.sin(2 * np.pi * 70 * TIME)
"""Reverses inside its large swings, so minor loops run and close."""


def hysteretic_stack() -> BondGraph:
    """Stack whose polarisation is a spring less plays: a passive minor-loop law in a storage."""
    stiffness = 1.0 / (1.65e-6 * 0.018**2)
    widths = (0.0, 2e-9, 6e-8, 2e-7)
    law = PrandtlIshlinskii(widths, tuple(w * stiffness for w in (1.0, -0.1, -0.15, -0.2)))
    return stack_bond_graph(law=Hysteretic(law), sensors=("x", "i"))


def nonlinear_loop(law: Law) -> BondGraph:
    """Resistor whose law must be solved for its flow: an algebraic unknown of the engine's own."""
    with BondGraph("loop") as g:
        loop = One("loop")
        Se("V") >> loop >> R("R_1", 2.0 if law.slope is None else None, law=law)
        loop >> C("C_1", 0.3)
        loop >> Df("i")
    return g


def linear_stack() -> BondGraph:
    return stack_bond_graph(sensors=("x", "i"), external_force=False)


GRAPHS = {
    "linear": linear_stack,
    "hysteretic": hysteretic_stack,
    "ang": stack_ang,
    "al_janaideh": stack_al_janaideh,
}


A, U, X, Z, NOW = sp.symbols("a u x z time")


def by_hand(
    rate: sp.Expr,
    residuals: tuple[sp.Expr, ...] = (),
    *,
    inputs: tuple[str, ...] = ("u",),
    input_rates: tuple[str, ...] = (),
    guess: tuple[float, ...] = (),
    parameter: str = "a",
    unit: str = "m",
    steps: tuple[ProgramStep, ...] = (),
    name: str = "by_hand",
) -> Program:
    """``dx/dt = rate``, ``y = x``, one parameter of value 1, unknowns z (or z0, z1)."""
    unknowns = ("z",) if len(residuals) == 1 else tuple(f"z{i}" for i in range(len(residuals)))
    names = {"x": ("x",), "z": unknowns, "u": inputs, "p": (parameter,)}
    t, h, m = ca.SX.sym("t"), ca.SX.sym("h"), ca.SX.sym("m", 0)
    columns = {k: ca.SX.sym(k, len(v)) for k, v in names.items()}
    table: dict[Any, Any] = {sp.Symbol("time"): t}
    for k, members in names.items():
        table |= {sp.Symbol(n): columns[k][i] for i, n in enumerate(members)}
    for s in steps:
        table[sp.Symbol(s.target)] = to_casadi(s.expression, table)
    f, g = sp.Add(rate), residuals
    ins = [t, columns["x"], columns["z"], columns["u"], columns["p"], m, h]
    labels = ["t", "x", "z", "u", "p", "m", "h"]
    rates = to_casadi(f, table)
    zero = ca.vertcat(*[to_casadi(e, table) for e in g]) if g else ca.SX(0, 1)
    return Program(
        name=name, states=("x",), algebraic=unknowns, inputs=inputs, parameters=(parameter,),
        memory=(), outputs=("y",), input_rates=input_rates, units={"y": unit}, nominal=(1.0,),
        start=(0.0,), guess=guess or (0.0,) * len(g), virgin=(), steps=steps, laws=(), rates=(f,),
        readings=(sp.Symbol("x"),), residuals=tuple(g),
        rhs=ca.Function("rhs", ins, [ca.SX(rates), columns["x"]], labels, ["dx", "y"]),
        residual=ca.Function("residual", ins, [ca.SX(zero)], labels, ["g"]),
        advance=ca.Function("advance", ins, [ca.SX(0, 1)], labels, ["m_next"]),
    )  # fmt: skip


def cubic_loop() -> Program:
    """Resistor with a cubic law in an algebraic loop: ``z + z^3 = x + u``."""
    return by_hand(-A * X + Z, (Z + Z**3 - X - U,))


def programs() -> dict[str, Program]:
    return {name: program(make()) for name, make in GRAPHS.items()} | {"cubic": cubic_loop()}


def random_point(model: Program, seed: int) -> tuple[list[Any], list[float]]:
    """Arguments ``t x z u p m h`` on the model's own scale; z solves the residuals."""
    random = np.random.default_rng(seed)
    scale = {"q_C_nl": 1e-7, "q_k": 1e-6, "p_m": 1e-5}
    x = [scale.get(n, 1.0) * random.normal() for n in model.states]
    u = [30.0 * random.normal() if n == "V_in" else random.normal() for n in model.inputs]
    p = [v * random.uniform(0.9, 1.1) for v in model.nominal]
    z = []
    if model.algebraic:
        total = x[0] + u[0]
        roots = np.roots([1.0, 0.0, 1.0, -total])
        z = [float(r.real) for r in roots if abs(r.imag) < 1e-9]
    t, h = float(random.uniform()), float(random.uniform(1e-5, 1e-2))
    m = model.advance(t, x, z, [0.6 * v for v in u], p, model.virgin, h).full().ravel().tolist()
    return [t, x, z, u, p, m, h], z
