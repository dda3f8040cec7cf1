"""Units of both standards, validated and run by FMPy."""

from __future__ import annotations

import ctypes
import importlib
import subprocess
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_ang
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se
from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program
from bondgraph.export.fmu import fmu2_cosimulation, fmu3_model_exchange
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Coulomb, EndStop, Hysteretic, Polynomial, Sliding
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnknownName, UnusableInput
from bondgraph.support.native import compiler
from tests.settled import simulate

fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")
pytestmark = pytest.mark.skipif(compiler() is None, reason="needs gcc")


def rlc() -> BondGraph:
    with BondGraph("rlc") as g:
        loop = One("loop")
        Se("V_in", unit="V") >> loop >> R("R_1", 10.0, unit="ohm")
        loop >> I("L_1", 1e-3, unit="H")
        loop >> C("C_1", 1e-6, unit="F")
        loop >> Df("i", unit="A")
    return g


def slider() -> BondGraph:
    """A mass on a spring that slips: every half swing is a turning point."""
    spring = Hysteretic(MaxwellResistiveCapacitor((2.0, 3.0, 5.0), (0.2, 1.0, 30.0)))
    with BondGraph("slider") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> C("k", law=spring)
        body >> Dq("x", unit="m")
    return g


def stack(**options: Any) -> BondGraph:
    from tests.actuators.stack.test_charge_drive import ANG

    return stack_bond_graph(ANG, **options)


def cubic_loop() -> Program:
    """``dx/dt = -x + z, 0 = z + z^3 - x - u, y = z``."""
    t, h, p, m = ca.SX.sym("t"), ca.SX.sym("h"), ca.SX.sym("p", 1), ca.SX.sym("m", 0)
    x, z, u = (ca.SX.sym(name, 1) for name in "xzu")
    ins = [t, x, z, u, p, m, h]
    base = program(rlc())
    return replace(
        base, name="cubic", states=("x",), algebraic=("z",), inputs=("u",), parameters=("a",),
        memory=(), outputs=("y",), input_rates=(), units={"x": "V", "z": "V"}, nominal=(1.0,),
        start=(0.5,), guess=(0.1,), virgin=(), steps=(), laws=(), rates=(), readings=(),
        residuals=(), rhs=ca.Function("rhs", ins, [p * z - x, z]),
        residual=ca.Function("residual", ins, [z + z**3 - x - u]),
        advance=ca.Function("advance", ins, [ca.SX(0, 1)]),
    )  # fmt: skip


def signals(time: Array, **columns: Array) -> Array:
    out = np.zeros(time.size, [("time", float), *((n, float) for n in columns)])
    out["time"] = time
    for name, values in columns.items():
        out[name] = values
    return out


def stairs(time: Array, **columns: Array) -> Array:
    """Each step of a held input as an event, so that an importer's solver starts anew there."""
    held = {n: np.append(np.repeat(v[:-1], 2), v[-1]) for n, v in columns.items()}
    return signals(np.append(time[0], np.repeat(time[1:], 2)), **held)


def run(path: Path, time: Array, names: Sequence[str], **options: Any) -> Any:
    return fmpy.simulate_fmu(
        str(path), start_time=time[0], stop_time=time[-1], output_interval=time[1] - time[0],
        output=list(names), **options,
    )  # fmt: skip


def worst(found: Array, expected: Array) -> float:
    return float(np.abs(found - expected).max() / np.ptp(expected))


def valid(path: Path) -> Path:
    assert validation.validate_fmu(str(path)) == []
    return path


@contextmanager
def instance(path: Path, folder: Path, **start: float) -> Iterator[tuple[Any, dict[str, int]]]:
    slave_class = importlib.import_module("fmpy.fmi2").FMU2Slave
    description = fmpy.read_model_description(str(path))
    where = fmpy.extract(str(path), unzipdir=str(folder))
    slave = slave_class(
        guid=description.guid, unzipDirectory=where, instanceName="one",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )  # fmt: skip
    at = {v.name: v.valueReference for v in description.modelVariables}
    slave.instantiate()
    begin(slave, at, **start)
    yield slave, at
    slave.terminate()
    slave.freeInstance()


def begin(slave: Any, at: dict[str, int], **start: float) -> None:
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    for name, value in start.items():
        slave.setReal([at[name]], [value])
    slave.exitInitializationMode()


FAST = np.linspace(0.0, 0.01, 1001)
# falls and rises inside each other: minor loops
LOOPS = np.interp(
    FAST, np.array([0, 1, 2, 3, 4, 5.5, 7, 8, 10]) * 1e-3, [0, 100, 30, 80, 45, 120, 0, 60, 20]
)


def test_the_linear_stack_in_co_simulation(tmp_path: Path) -> None:
    graph = stack_bond_graph(sensors=("x", "i"))
    path = valid(fmu2_cosimulation(program(graph), tmp_path / "stack.fmu"))
    found = run(path, FAST, ("x", "i"), input=signals(FAST, V_in=LOOPS))
    expected = simulate(graph, FAST, {"V_in": LOOPS}, hold="hold")
    assert worst(found["x"], expected["x"]) < 1e-8
    assert worst(found["i"], expected["i"]) < 1e-6


def test_minor_loops_of_the_stack_in_both_standards(tmp_path: Path) -> None:
    graph = stack()
    expected = simulate(graph, FAST, {"V_in": LOOPS}, hold="hold", accuracy=1e-7)["x"]
    linear = simulate(stack_bond_graph(), FAST, {"V_in": LOOPS}, hold="hold")["x"]
    assert worst(linear, expected) > 0.02  # there is hysteresis to reproduce
    two = valid(fmu2_cosimulation(program(graph), tmp_path / "two.fmu"))
    found = run(two, FAST, ("x",), input=signals(FAST, V_in=LOOPS))
    assert worst(found["x"], expected) < 1e-6
    three = valid(fmu3_model_exchange(program(graph), tmp_path / "three.fmu"))
    options = {"record_events": False, "relative_tolerance": 1e-6}
    found = run(three, FAST, ("x",), input=stairs(FAST, V_in=LOOPS), **options)
    assert worst(found["x"], expected) < 1e-5


def test_a_law_without_states(tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.0, 201)
    volt = np.interp(time, [0, 0.2, 0.4, 0.6, 0.8, 1.0], [0, 100, 30, 80, 45, 120])
    path = valid(fmu2_cosimulation(program(stack_ang()), tmp_path / "ang.fmu"))
    found = run(path, time, ("x",), input=signals(time, V_in=volt))
    expected = simulate(stack_ang(), time, {"V_in": volt}, hold="hold")
    assert worst(found["x"], expected["x"]) < 1e-12


def test_rlc_in_both_standards_and_with_slopes(tmp_path: Path) -> None:
    time = np.linspace(0.0, 2e-3, 401)
    volt = np.sin(9e3 * time)
    two = valid(fmu2_cosimulation(program(rlc()), tmp_path / "two.fmu"))
    held = simulate(rlc(), time, {"V_in": volt}, hold="hold")["i"]
    assert worst(run(two, time, ("i",), input=signals(time, V_in=volt))["i"], held) < 1e-6
    linear = simulate(rlc(), time, {"V_in": volt}, hold="linear")["i"]
    assert worst(held, linear) > 1e-3
    with instance(two, tmp_path / "a") as (slave, at):
        sloped = [slave.getReal([at["i"]])[0]]
        for k in range(400):
            slave.setReal([at["V_in"]], [volt[k]])
            slave.setRealInputDerivatives([at["V_in"]], [1], [(volt[k + 1] - volt[k]) / 5e-6])
            slave.doStep(time[k], 5e-6)
            sloped += slave.getReal([at["i"]])
    assert worst(np.array(sloped), linear) < 1e-6
    three = valid(fmu3_model_exchange(program(rlc()), tmp_path / "three.fmu"))
    options = {"record_events": False, "relative_tolerance": 1e-8}
    found = run(three, time, ("i",), input=stairs(time, V_in=volt), **options)
    assert worst(found["i"], held) < 1e-5


def test_an_algebraic_loop_in_both_standards(tmp_path: Path) -> None:
    def z_of(x: float) -> float:
        roots = np.roots([1.0, 0.0, 1.0, -x - 2.0])
        return float(roots[np.abs(roots.imag) < 1e-9].real[0])

    time = np.linspace(0.0, 2.0, 41)
    reference = solve_ivp(
        lambda t, x: [-x[0] + z_of(x[0])], (0, 2), [0.5], t_eval=time, rtol=1e-11, atol=1e-13
    )  # fmt: skip
    z = np.array([z_of(x) for x in reference.y[0]])
    two = valid(fmu2_cosimulation(cubic_loop(), tmp_path / "two.fmu", tolerance=1e-9))
    three = valid(fmu3_model_exchange(cubic_loop(), tmp_path / "three.fmu", nominal={"x": 1e-2}))
    for path, options, most in ((two, {}, 1e-8), (three, {"relative_tolerance": 1e-9}, 1e-6)):
        found = run(path, time, ("x", "y", "z"), start_values={"u": 2.0}, **options)
        assert worst(found["x"], reference.y[0]) < most
        assert worst(found["z"], z) < most
        assert np.array_equal(found["y"], found["z"])


def test_a_loop_of_a_graph(tmp_path: Path) -> None:
    """A resistor with a law in series with a plain one: the engine leaves an unknown."""
    with BondGraph("pair") as g:
        loop = One("loop")
        Se("V_in", unit="V") >> loop >> R("R_1", 10.0, unit="ohm")
        loop >> R("R_2", 5.0, unit="ohm", law=Polynomial())
        loop >> C("C_1", 1e-3, unit="F")
        loop >> Df("i", unit="A")
    model = program(g)
    assert model.algebraic
    time = np.linspace(0.0, 0.05, 101)
    volt = 8.0 * np.sin(200.0 * time)
    path = valid(fmu2_cosimulation(model, tmp_path / "pair.fmu"))
    bent = {"a_3_R_2": 300.0}
    found = run(path, time, ("i",), input=signals(time, V_in=volt), start_values=bent)
    expected = simulate(g, time, {"V_in": volt}, bent, hold="hold", accuracy=1e-6)["i"]
    straight = simulate(g, time, {"V_in": volt}, hold="hold")["i"]
    assert worst(straight, expected) > 0.05
    assert worst(found["i"], expected) < 5e-5


def test_turning_points_between_communication_points(tmp_path: Path) -> None:
    """Few communication points: the units find the turning points themselves."""
    fine = np.linspace(0.0, 12.0, 12001)
    coarse = fine[::1500]
    force = {"F": np.full(fine.size, 3.0)}
    expected = simulate(slider(), fine, force, x0=np.zeros(2), accuracy=1e-8)["x"]
    assert np.sum(np.diff(np.sign(np.diff(expected))) != 0) > 5
    two = fmu2_cosimulation(program(slider()), tmp_path / "two.fmu")
    found = run(two, coarse, ("x",), start_values={"F": 3.0})
    assert worst(found["x"], expected[::1500]) < 1e-5
    three = valid(fmu3_model_exchange(program(slider()), tmp_path / "three.fmu"))
    found = run(
        three, coarse, ("x",), start_values={"F": 3.0}, relative_tolerance=1e-9,
        record_events=False,
    )  # fmt: skip
    assert worst(found["x"], expected[::1500]) < 2e-5


def test_pieces_of_a_law_are_events(tmp_path: Path) -> None:
    """Steps of an importer end where a mass meets its stop and where it leaves it."""
    with BondGraph("stopped") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> C("k", stiffness=400.0, unit="N/m", law=EndStop(2e5, -5e-3, 5e-3))
        body >> R("d", 0.4, unit="N*s/m")
        body >> Dq("x", unit="m")
    time = np.linspace(0.0, 0.4, 401)
    expected = simulate(g, time, {"F": np.full(time.size, 3.0)}, x0=np.zeros(2), accuracy=1e-8)["x"]
    bounces = np.sum(np.diff((expected > 5e-3).astype(int)) != 0)
    assert bounces == 8
    path = valid(fmu3_model_exchange(program(g), tmp_path / "stopped.fmu"))
    names = [v.name for v in fmpy.read_model_description(str(path)).modelVariables]
    assert [n for n in names if "event" in n] == ["event.switch_0", "event.switch_1"]
    found = run(path, time[::400], ("x",), start_values={"F": 3.0}, relative_tolerance=1e-9)
    assert np.unique(found["time"][1:-1]).size == bounces  # all others are the ends
    assert found["x"][1:-1] == pytest.approx(5e-3, rel=1e-8)
    assert found["x"][-1] == pytest.approx(expected[-1], rel=1e-4)


def test_a_timed_law_is_stepped_by_its_memory(tmp_path: Path) -> None:
    operator = MaxwellResistiveCapacitor((2.0, 3.0), (0.2, 0.5))
    with BondGraph("friction") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0)
        body >> R("d", 0.5, law=Sliding(operator))
        body >> Dq("x")
    time = np.linspace(0.0, 6.0, 121)
    force = 2.0 * np.sin(2.0 * time)
    expected = simulate(g, time, {"F": force}, hold="hold", accuracy=1e-8)["x"]
    path = valid(fmu2_cosimulation(program(g), tmp_path / "friction.fmu"))
    found = run(path, time, ("x",), input=signals(time, F=force))
    assert worst(found["x"], expected) < 1e-4


def test_the_whole_state_can_be_taken_back_memory_too(tmp_path: Path) -> None:
    path = fmu2_cosimulation(program(stack()), tmp_path / "stack.fmu")
    with instance(path, tmp_path / "a") as (slave, at):
        memory = [at[n] for n in at if n.startswith("C_nl_m")]
        step = 1e-4

        def walk(first: int, volts: Sequence[float]) -> list[list[float]]:
            rows = []
            for i, volt in enumerate(volts):
                slave.setReal([at["V_in"]], [volt])
                slave.doStep((first + i) * step, step)
                rows.append(slave.getReal([at["x"], *memory]))
            return rows

        virgin = slave.getReal(memory)
        walk(0, [100.0, 40.0])
        state, moved = slave.getFMUState(), slave.getReal(memory)
        assert moved != virgin
        once = walk(2, [90.0, 10.0])
        assert slave.getReal(memory) != moved
        slave.setFMUState(state)
        assert slave.getReal(memory) == moved
        assert walk(2, [90.0, 10.0]) == once
        data = slave.serializeFMUstate(state)
        again = slave.deSerializeFMUstate(data)
        slave.setFMUState(again)
        assert walk(2, [90.0, 10.0]) == once
        for kept in (state, again):
            slave.freeFMUState(kept)
        slave.reset()
        begin(slave, at)
        assert slave.getReal(memory) == virgin


def test_instances_do_not_disturb_each_other_and_parameters_are_tunable(tmp_path: Path) -> None:
    path = fmu2_cosimulation(program(rlc()), tmp_path / "rlc.fmu")
    time = np.linspace(0.0, 1e-3, 101)
    with instance(path, tmp_path / "a", V_in=1.0) as (a, at):
        other = type(a)(
            guid=a.guid, unzipDirectory=a.unzipDirectory, instanceName="two",
            modelIdentifier=a.modelIdentifier,
        )  # fmt: skip
        other.instantiate()
        begin(other, at, V_in=1.0, R_1=50.0)
        rows = []
        for k in range(100):
            if k == 50:
                a.setReal([at["R_1"]], [50.0])
            for slave in (a, other):
                slave.doStep(time[k], 1e-5)
            rows.append([a.getReal([at["i"]])[0], other.getReal([at["i"]])[0]])
        with pytest.raises(fmpy.fmi1.FMICallException):
            a.setReal([at["q_C_1"]], [0.0])
        other.terminate()
        other.freeInstance()
    one = {"V_in": np.ones(time.size)}
    x0 = np.zeros(2)
    damped = simulate(rlc(), time, one, {"R_1": 50.0}, x0=x0)
    assert worst(np.array(rows)[:, 1], damped["i"][1:]) < 1e-6
    half = simulate(rlc(), time[:51], {"V_in": np.ones(51)}, x0=x0)
    rest = simulate(rlc(), time[:51], {"V_in": np.ones(51)}, {"R_1": 50.0}, x0=half.state)
    assert worst(np.array(rows)[:, 0], np.append(half["i"][1:], rest["i"][1:])) < 1e-6


def test_equal_programs_give_equal_bytes_and_others_another_token(tmp_path: Path) -> None:
    for write in (fmu2_cosimulation, fmu3_model_exchange):
        same = [write(program(rlc()), tmp_path / f"{i}.fmu").read_bytes() for i in range(2)]
        assert same[0] == same[1]
        changed = replace(program(rlc()), nominal=(11.0, 1e-3, 1e-6))
        write(changed, tmp_path / "2.fmu")
        tokens = {fmpy.read_model_description(str(tmp_path / f"{i}.fmu")).guid for i in (0, 2)}
        assert len(tokens) == 2 or write is fmu3_model_exchange
        descriptions = [zipfile.ZipFile(tmp_path / f"{i}.fmu") for i in (0, 2)]
        texts = [z.read("sources/token.h") for z in descriptions]
        for z in descriptions:
            z.close()
        assert texts[0] != texts[1]


def test_hostile_names(tmp_path: Path) -> None:
    with BondGraph("while") as g:
        loop = One("loop")
        Se("template", unit="V") >> loop >> R("N_X", 10.0, unit="ohm")
        loop >> C("double", 1e-3, unit="F")
        loop >> I("Ω", 1e-3, unit="H")
        loop >> Df("time", unit="A")
    base = program(g)
    nasty = replace(base, outputs=(base.states[0],), name="while")  # an output named as a state
    loud = replace(base, name='*/ #error "<&>\x07 \\')
    time = np.linspace(0.0, 1e-2, 11)
    for i, model in enumerate((base, nasty, loud)):
        two = valid(fmu2_cosimulation(model, tmp_path / f"{i}.fmu"))
        three = valid(fmu3_model_exchange(model, tmp_path / f"{i}_me.fmu"))
        name = model.outputs[0]
        values = [run(f, time, [name], start_values={"template": 1.0}) for f in (two, three)]
        assert np.ptp(values[0][name]) > 0.0
        assert worst(values[1][name], values[0][name]) < 1e-2
    with zipfile.ZipFile(tmp_path / "0.fmu") as archive:
        assert "binaries/linux64/while_model.so" in archive.namelist()
    names = fmpy.read_model_description(str(tmp_path / "1.fmu")).modelVariables
    assert f"state.{base.states[0]}" in [v.name for v in names]


def test_units_are_described(tmp_path: Path) -> None:
    path = fmu2_cosimulation(program(rlc()), tmp_path / "rlc.fmu")
    description = fmpy.read_model_description(str(path))
    units = {u.name: u.baseUnit for u in description.unitDefinitions}
    assert (units["ohm"].kg, units["ohm"].m, units["ohm"].s, units["ohm"].A) == (1, 2, -3, -2)
    by_name = {v.name: v for v in description.modelVariables}
    assert (by_name["R_1"].unit, by_name["R_1"].variability) == ("ohm", "tunable")
    assert by_name["i"].unit == "A"


def test_without_gcc_the_unit_holds_sources_that_others_can_compile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    gcc = compiler()
    assert gcc is not None
    monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    for version, path in (
        (2, fmu2_cosimulation(program(stack()), tmp_path / "2.fmu")),
        (3, fmu3_model_exchange(program(stack()), tmp_path / "3.fmu")),
    ):
        with zipfile.ZipFile(valid(path)) as archive:
            assert not [n for n in archive.namelist() if n.startswith("binaries")]
            archive.extractall(tmp_path / str(version))
        for prefix in ([], [f"-DFMI{version}_FUNCTION_PREFIX=stack_"]):
            subprocess.run(
                [gcc, "-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function",
                 "-Wno-unused-parameter", "-Wno-type-limits", "-fsyntax-only", *prefix,
                 f"fmi{version}.c"],
                cwd=tmp_path / str(version) / "sources", check=True,
            )  # fmt: skip


def test_what_cannot_be_exported_or_run_is_said(tmp_path: Path) -> None:
    with BondGraph("stick") as g:
        body = One("body")
        Se("F") >> body >> I("m", 1.0)
        body >> R("d", 0.5, law=Coulomb())
    with pytest.raises(UnusableInput, match="law of d jumps"):
        fmu2_cosimulation(program(g), tmp_path / "a.fmu")
    with pytest.raises(UnusableInput, match="must be positive"):
        fmu2_cosimulation(program(rlc()), tmp_path / "a.fmu", step=-1.0)
    with pytest.raises(UnknownName, match="no state 'q'"):
        fmu3_model_exchange(program(rlc()), tmp_path / "a.fmu", nominal={"q": 1.0})
    with pytest.raises(UnusableInput, match="cannot be written"):
        fmu3_model_exchange(program(rlc()), tmp_path / "none" / "a.fmu")
    path = fmu2_cosimulation(program(rlc()), tmp_path / "rlc.fmu")
    with instance(path, tmp_path / "b") as (slave, at):
        bad = (
            ("setReal", [at["V_in"]], [float("nan")]),
            ("getReal", [9999]),
            ("doStep", 0.5, 1e-3),
            ("doStep", 0.0, -1e-3),
        )
        for name, *values in bad:
            with pytest.raises(fmpy.fmi1.FMICallException):
                getattr(slave, name)(*values)
        slave.doStep(0.0, 1e-3)
        assert slave.getReal([at["i"]]) == [0.0]


def test_an_unsolvable_loop_is_an_error_and_leaves_the_unit_usable(tmp_path: Path) -> None:
    base = cubic_loop()
    v = [ca.SX.sym(n, base.rhs.size1_in(i)) for i, n in enumerate("txzupmh")]
    # 0 = z^2 - u has no solution below u = 0
    square = replace(base, residual=ca.Function("residual", v, [v[2] ** 2 - v[3]]), guess=(1.0,))
    path = fmu2_cosimulation(square, tmp_path / "square.fmu")
    with instance(path, tmp_path / "a", u=4.0) as (slave, at):
        slave.setReal([at["u"]], [-1.0])
        with pytest.raises(fmpy.fmi1.FMICallException):
            slave.doStep(0.0, 0.1)
        slave.setReal([at["u"]], [9.0])
        slave.doStep(0.0, 0.1)
        assert slave.getReal([at["z"]])[0] == pytest.approx(3.0, rel=1e-9)


def test_states_of_model_exchange_are_kept_and_restored(tmp_path: Path) -> None:
    model_class = importlib.import_module("fmpy.fmi3").FMU3Model
    path = fmu3_model_exchange(program(slider()), tmp_path / "slider.fmu")
    description = fmpy.read_model_description(str(path))
    where = fmpy.extract(str(path), unzipdir=str(tmp_path / "a"))
    model = model_class(
        guid=description.guid, unzipDirectory=where, instanceName="one",
        modelIdentifier=description.modelExchange.modelIdentifier,
    )  # fmt: skip
    at = {v.name: v.valueReference for v in description.modelVariables}
    memory = [at[n] for n in at if n.startswith("k_m")]
    model.instantiate()
    model.enterInitializationMode(startTime=0.0)
    model.exitInitializationMode()
    model.updateDiscreteStates()
    model.enterContinuousTimeMode()
    virgin = model.getFloat64(memory)
    state = model.getFMUState()
    x = (ctypes.c_double * 2)(1.0, 1.0)
    model.setTime(0.1)
    model.setContinuousStates(x, 2)
    assert model.getFloat64(memory) == virgin  # a trial does not move it
    model.completedIntegratorStep()
    assert model.getFloat64(memory) != virgin
    model.setFMUState(state)
    assert model.getFloat64(memory) == virgin
    model.freeFMUState(state)
    model.terminate()
    model.freeInstance()
