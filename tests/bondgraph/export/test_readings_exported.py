"""Every kind of reading and of recorded input through each export, as the simulation has it."""

from __future__ import annotations

import json
from pathlib import Path

import control as ct
import jsonschema
import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.equations.codegen import program
from bondgraph.export.control import to_control, to_nonlinear_control
from bondgraph.export.fmu import fmu2_cosimulation, fmu3_model_exchange
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.schema import graph_schema
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.support.errors import UnusableInput
from tests.bondgraph.export import test_c_code, test_fmu, test_modelica, test_numpy_module
from tests.bondgraph.export.test_modelica import division as division
from tests.bondgraph.readings_bench import FORCE, TIME, bench, power, shaken, spring
from tests.settled import simulate

GRAPHS = {
    "bench": bench(),
    "acceleration": shaken("rate"),
    "displacement": shaken("integral"),
    "power": power(),
}


def expected(graph: BondGraph, hold: str = "linear", last: int = 1001) -> dict[str, np.ndarray]:
    (source,) = (n for n in ("F", "b") if n in graph.elements)
    x0 = dict.fromkeys(program(graph).states, 0.0)
    time, force = TIME[:last], FORCE[:last]
    return simulate(graph, time, {source: force}, x0=x0, accuracy=1e-6, hold=hold).outputs


def alike(found: np.ndarray, wanted: np.ndarray, graph: BondGraph, name: str, near: float) -> None:
    """Equal but for a step of a converter now and then, where a value lies between two."""
    step = graph[name].resolution or 0.0  # type: ignore[attr-defined]
    error = np.abs(found - wanted)
    assert error.max() <= near * np.ptp(wanted) + 1.01 * step, name
    assert np.mean(error > near * np.ptp(wanted)) < 0.05, name


@pytest.mark.parametrize("name", GRAPHS)
def test_printed_numpy_and_c_are_the_program(name: str, tmp_path: Path) -> None:
    model, random = program(GRAPHS[name]), np.random.default_rng(1)
    printed, rows, wanted = test_numpy_module.module(model), [], []
    for _ in range(20):
        x, u = (0.1 * random.normal(size=len(n)) for n in (model.states, model.inputs))
        p = np.array(model.nominal) * random.uniform(0.9, 1.1, len(model.nominal))
        dx, y = (v.full().ravel() for v in model.rhs(0.3, x, [], u, p, [], 1e-3))
        assert printed.rates(0.3, x, u, p, [], 1e-3) == pytest.approx(dx, rel=1e-10)
        assert printed.outputs(0.3, x, u, p, [], 1e-3) == pytest.approx(y, rel=1e-10, abs=1e-12)
        rows.append([0.3, *x, *u, *p, 1e-3])
        wanted.append([0.0, *dx, *y])
    if test_c_code.GCC is None:
        pytest.skip("no gcc")
    found = test_c_code.run(test_c_code.build(model, tmp_path, test_c_code.PROBE), rows)
    assert found == pytest.approx(np.array(wanted), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("name", GRAPHS)
def test_modelica_is_the_program(name: str) -> None:
    test_modelica.assert_same_numbers(program(GRAPHS[name]))


@pytest.mark.parametrize("name", ["bench", "acceleration"])
def test_a_unit_reads_as_the_simulation(name: str, tmp_path: Path) -> None:
    graph = GRAPHS[name]
    model, wanted = program(graph), expected(graph, "hold")
    (source,) = model.inputs  # an offset asks nothing of who runs the unit
    exact = {"record_events": False, "relative_tolerance": 1e-7}
    for unit, given, options in (
        (fmu2_cosimulation(model, tmp_path / "two.fmu"), test_fmu.signals, {}),
        (fmu3_model_exchange(model, tmp_path / "three.fmu"), test_fmu.stairs, exact),
    ):
        found = test_fmu.run(
            test_fmu.valid(unit), TIME, model.outputs, input=given(TIME, **{source: FORCE}),
            **options,
        )  # fmt: skip
        for n in model.outputs:
            # readings that jump with a held input are taken before or after the jump
            if n not in ("monitor", "a", "force"):
                alike(found[n], wanted[n], graph, n, 2e-3)


def test_a_unit_of_a_base_by_its_displacement_takes_the_rate_beside_it(tmp_path: Path) -> None:
    graph, model = GRAPHS["displacement"], program(GRAPHS["displacement"])
    unit = test_fmu.valid(fmu2_cosimulation(model, tmp_path / "base.fmu"))
    given = test_fmu.signals(TIME, b=FORCE, d_b=np.gradient(FORCE, TIME))
    found, wanted = test_fmu.run(unit, TIME, model.outputs, input=given), expected(graph)
    for n in model.outputs:  # held over a step of 1 ms
        assert np.abs(found[n] - wanted[n]).max() < 2e-2 * np.ptp(wanted[n]), n


def test_python_control_has_the_linear_ones() -> None:
    graph = bench().with_element("x", resolution=None, offset=None).with_element("a", offset=None)
    graph = graph.with_element("F", offset=None)
    system = to_control(program(graph))
    found = ct.forced_response(system, TIME, FORCE).outputs
    wanted = expected(graph)
    for i, n in enumerate(system.output_labels):
        assert np.abs(found[i] - wanted[n]).max() < 2e-4 * np.ptp(wanted[n]), n


def test_python_control_takes_offsets_rounding_and_products_as_nonlinear() -> None:
    for name in ("bench", "power"):
        graph = GRAPHS[name]
        with pytest.raises(UnusableInput, match="to_nonlinear_control"):
            to_control(program(graph))
        system, wanted = to_nonlinear_control(program(graph)), expected(graph, last=151)
        found = ct.input_output_response(
            system, TIME[:151], FORCE[:151], solve_ivp_kwargs={"rtol": 1e-7}
        )
        for i, n in enumerate(system.output_labels):
            alike(found.outputs[i], wanted[n], graph, n, 2e-3)


@pytest.mark.parametrize("name", GRAPHS)
def test_files_keep_it_in_both_directions(name: str) -> None:
    graph = GRAPHS[name]
    text = to_json(graph)
    jsonschema.Draft202012Validator(graph_schema()).validate(json.loads(text))
    again = from_json(text)
    assert to_json(again) == text
    assert dict(again.elements) == dict(graph.elements)


@pytest.mark.parametrize("value", [True, [1], ["nope", 1], {"a": 1}, "not a name"])
def test_files_hold_no_other_values(value: object) -> None:
    wrong = json.loads(to_json(spring(gain=2.0)))
    (row,) = (e for e in wrong["elements"] if e["name"] == "x")
    row["gain"] = value
    with pytest.raises(UnusableInput, match=r"elements\[\d+\] x.gain: "):
        from_json(json.dumps(wrong))
