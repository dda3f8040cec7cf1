"""The compiled step: derivatives, the path without a compiler, the cache."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators import stack_bond_graph, stack_lumped
from bondgraph import BondGraph, C, Df, Dq, I, One, R, Se, Zero
from bondgraph.graph.drives import Drive
from bondgraph.hysteresis import MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.laws import (
    Coulomb,
    Hysteretic,
    Law,
    LuGre,
    PiecewiseLinear,
    Polynomial,
    QuadraticDrag,
    Saturation,
    Sliding,
    StopSum,
    Stribeck,
)
from bondgraph.simulation import lure_kernel as kernel
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import Compiled, compile_model
from bondgraph.simulation.lure_march import march_source
from bondgraph.support import native
from tests.beside import beside

N, STEP = 60, 0.05


def oscillator_graph(
    spring: Law | None = None,
    friction: Law | None = None,
    drive: Law | None = None,
    reading: Law | None = None,
) -> BondGraph:
    with BondGraph("oscillator") as g:
        body = One("body")
        Se("F", drive=Drive(law=drive) if drive else None) >> body >> I("m", 1.3)
        body >> R("d", beside(friction, 0.4), law=friction)
        body >> C("k", stiffness=beside(spring, 3.0), law=spring)
        body >> Dq("x", law=reading)
        body >> Df("v")
    return g


def oscillator(*laws: Law | None) -> Compiled:
    return compile_model(oscillator_graph(*laws))


def longer(law: Law | None = None) -> Compiled:
    """Two masses, and the law at the spring between them."""
    with BondGraph("two masses") as g:
        near, far, between = One("near"), One("far"), Zero("between")
        Se("F") >> near >> I("m_1", 1.3)
        near >> R("d", 0.4)
        near >> between >> far >> I("m_2", 0.7)
        between >> C("k", stiffness=beside(law, 3.0), law=law)
        far >> Df("v")
    return compile_model(g)


def dependent() -> Compiled:
    """Charge from q = (I + C H)^-1 [C V + T x]: the argument depends on the parameters."""
    law = Hysteretic(PrandtlIshlinskii((0.0, 0.05, 0.2), (2.0, 0.7, 0.3)))
    options: dict[str, Any] = {"capacitance": 0.8, "transducer": 0.6, "stiffness": 3.0, "mass": 1.3}
    return compile_model(stack_lumped(law, **options, damping=0.4))


def inputs(model: Compiled) -> Any:
    u = np.zeros((N, model.n_u))
    t = STEP * (np.arange(N) + 3)
    u[:, 0] = 2.0 * np.sin(2.1 * t) + 1.1 * np.sin(5.3 * t)
    return u


MODELS = {
    "linear": lambda: oscillator(),
    "cubic": lambda: oscillator(Polynomial(size=1.0)),
    "cubic and drag": lambda: oscillator(Polynomial(), QuadraticDrag(0.5)),
    "stribeck": lambda: oscillator(None, Stribeck(0.3, 0.2, 0.1)),
    "coulomb": lambda: oscillator(None, Coulomb(0.3)),
    "stops": lambda: oscillator(StopSum((0.1, 0.3), height=0.7)),
    "stops everywhere": lambda: oscillator(
        StopSum((0.1, 0.3), height=0.7), None, StopSum((0.4,), 0.2, sign=-1.0), StopSum((0.2,), 0.1)
    ),
    "lugre": lambda: oscillator(None, LuGre(0.3, 0.2, 0.3, 40.0, 0.2)),
    "sliding": lambda: oscillator(None, Sliding(MaxwellResistiveCapacitor((3.0, 2.0), (0.1, 0.3)))),
    "operator": lambda: oscillator(Hysteretic(PrandtlIshlinskii((0.0, 0.2), (2.0, 0.7)))),
    "dependent store": lambda: dependent(),
    "limits": lambda: oscillator(PiecewiseLinear(size=1.0), None, Saturation(-1.5, 2.0, 0.1)),
}


def point(model: Compiled) -> Any:
    """Parameters away from their defaults, so that zero starts hide nothing."""
    p = model.nominal()
    for i, name in enumerate(model.parameter_names):
        if p[i] == 0.0:
            p[i] = 0.3 + 0.1 * i
        assert name
    return p


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize("name", MODELS)
def test_derivatives_against_central_differences(name: str) -> None:
    model = MODELS[name]()
    p, u, x0 = point(model), inputs(model), np.array([0.11, -0.23])
    n_p = len(p)
    options: dict[str, Any] = {"n_sub": 2}
    run = run_record(model, p, u, STEP, x0, directions=range(n_p), state_directions=True, **options)
    plain = run_record(model, p, u, STEP, x0, **options)
    np.testing.assert_allclose(run.y, plain.y, rtol=1e-12, atol=1e-13)
    for d in range(n_p + model.n_x):
        h = 1e-6

        def shifted(sign: float, d: int = d, h: float = h) -> Any:
            q, z = p.copy(), x0.copy()
            (q if d < n_p else z)[d if d < n_p else d - n_p] += sign * h
            return run_record(model, q, u, STEP, z, **options).y

        central = (shifted(1) - shifted(-1)) / (2 * h)
        size = max(np.abs(central).max(), 1e-3)
        error = np.abs(run.dy[:, :, d] - central).max()
        assert error < 2e-6 * size, (d, error, size)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", MODELS)
def test_without_a_compiler(name: str, monkeypatch: Any) -> None:
    model = MODELS[name]()
    p, u, x0 = point(model), inputs(model), np.array([0.11, -0.23])
    wide = np.vstack([u] * 4)  # longer than a chunk, with a remainder
    arguments: dict[str, Any] = {"n_sub": 2, "directions": (0, len(p) - 1)}
    native = run_record(model, p, wide, STEP, x0, **arguments)
    monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    kernel._runner.cache_clear()
    try:
        machine = run_record(model, p, wide, STEP, x0, **arguments)
    finally:
        kernel._runner.cache_clear()
    for field in ("y", "dy", "s", "w"):
        a, b = getattr(native, field), getattr(machine, field)
        np.testing.assert_allclose(b, a, rtol=0, atol=1e-10 * max(1.0, np.abs(a).max(initial=0)))


@pytest.fixture
def compiled_files(tmp_path: Path, monkeypatch: Any) -> Iterator[Callable[[], list[str]]]:
    """Names of the libraries in a cache that begins empty; the kernels in memory go with it."""
    if not shutil.which("gcc"):
        pytest.skip("no gcc")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("BONDSIGHT_NO_COMPILER", raising=False)
    kernel._runner.cache_clear()
    folder = native.cache_folder()
    assert folder.is_relative_to(tmp_path)
    yield lambda: sorted(f.name for f in folder.iterdir())
    kernel._runner.cache_clear()


def test_the_cache_is_by_content(compiled_files: Callable[[], list[str]], monkeypatch: Any) -> None:
    """The march, and a file for one set of laws, whatever numbers, names and order of calls."""

    def run(model: Compiled) -> list[str]:
        kernel._runner.cache_clear()
        p, x0 = model.nominal(), np.zeros(model.n_x)
        run_record(model, p, np.ones((5, model.n_u)), STEP, x0)
        return compiled_files()

    first = run(oscillator(Polynomial(orders=(3,))))
    assert len(first) == 2
    assert run(oscillator(Polynomial(orders=(3,)))) == first
    assert len(run(oscillator(Polynomial(orders=(2,))))) == 3
    stack = run(compile_model(stack_bond_graph(mass=1.0)))
    assert run(compile_model(stack_bond_graph(mass=2.0))) == stack
    # a broken or missing compiler falls back to the machine
    monkeypatch.setattr(shutil, "which", lambda _: "/bin/false")
    assert run(oscillator(Polynomial(orders=(4,)))) == stack


@pytest.mark.parametrize("directions", [1, 3, 4, 7])
def test_rows_that_fill_their_blocks_or_do_not(directions: int) -> None:
    """Each derivative is the same whatever stands beside it in a row."""
    model = oscillator(Polynomial(size=1.0), Stribeck(0.3, 0.2, 0.1))
    p, u, x0 = point(model), inputs(model), np.array([0.11, -0.23])
    assert len(p) >= 7
    whole = run_record(model, p, u, STEP, x0, directions=range(len(p)))
    part = run_record(model, p, u, STEP, x0, directions=range(directions))
    np.testing.assert_allclose(part.dy, whole.dy[:, :, :directions], rtol=1e-9, atol=1e-12)
    last = run_record(model, p, u, STEP, x0, directions=[directions - 1], state_directions=True)
    np.testing.assert_allclose(last.dy[:, :, 0], whole.dy[:, :, directions - 1], rtol=1e-9)


def test_numbers_of_directions_share_a_kernel(compiled_files: Callable[[], list[str]]) -> None:
    """None, some in one block of a row, and in two."""
    model = oscillator(Polynomial(size=1.0), Stribeck(0.3, 0.2, 0.1))
    p, x0 = point(model), np.zeros(model.n_x)
    length = native.vector_length()
    for n in (0, 1, length - 1, length, length + 1):
        own = n - model.n_x if n >= length else n  # the others by the states
        run_record(
            model, p, inputs(model), STEP, x0, directions=range(own), state_directions=own < n
        )
        assert len(compiled_files()) == 2


def test_one_march_serves_all_and_equal_laws_share_their_code(
    compiled_files: Callable[[], list[str]],
) -> None:
    law, found = Polynomial(size=1.0), []
    for model in (oscillator(), longer(), oscillator(law), longer(law)):
        run_record(model, point(model), inputs(model), STEP, np.zeros(model.n_x))
        found.append(len(compiled_files()))
    assert found == [1, 1, 2, 2]


@pytest.mark.parametrize(
    ("macros", "length"),
    [("#define __AVX512F__ 1\n#define __AVX__ 1\n", 8), ("#define __AVX__ 1\n", 4), ("", 2)],
)
def test_a_row_fills_the_registers_that_there_are(
    macros: str, length: int, compiled_files: Callable[[], list[str]], monkeypatch: Any
) -> None:
    """Longer ones go through memory, see `bondsight bench rows`; each length gives the same."""
    model = oscillator(Polynomial(size=1.0), Stribeck(0.3, 0.2, 0.1))
    p, u, x0 = point(model), inputs(model), np.array([0.11, -0.23])
    here = run_record(model, p, u, STEP, x0, directions=range(7))
    monkeypatch.setattr(native, "_machine", lambda gcc: macros)
    kernel._runner.cache_clear()
    assert f"#define LANES {length}\n" in march_source(slopes=True)
    made = run_record(model, p, u, STEP, x0, directions=range(7))
    np.testing.assert_allclose(made.y, here.y, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(made.dy, here.dy, rtol=1e-9, atol=1e-12)


def test_a_library_of_another_processor_is_not_taken(
    compiled_files: Callable[[], list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    source = "double twice(double x) { return 2.0 * x; }"
    first = native.build(source)
    assert first is not None
    assert native.build(source) == first
    monkeypatch.setattr(native, "_machine", lambda gcc: "another")
    assert native.build(source) not in (None, first)


def test_values_too_large_to_compute_with_give_no_number() -> None:
    """A trial step of a fit may go there: it is told by the run, not by an exception."""
    model = oscillator(Polynomial(size=1.0))
    p = point(model)
    p[model.parameter_names.index("k")] = np.inf
    run = run_record(model, p, inputs(model), STEP, np.zeros(2), directions=(0, 1))
    assert np.isnan(run.y).any()
    assert run.dy.shape == (N, model.n_y, 2)
