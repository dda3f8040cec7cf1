"""The exported C: compiled without a warning, run as programs, compared with the simulation."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program
from bondgraph.export.c_code import c_code
from bondgraph.laws import Hysteretic, Law, QuadraticDrag
from tests.bondgraph.export.printed_models import (
    GRAPHS,
    NOW,
    TIME,
    VOLTAGE,
    A,
    X,
    Z,
    by_hand,
    cubic_loop,
    nonlinear_loop,
    programs,
    random_point,
)
from tests.bondgraph.hysteresis.examples import PI
from tests.settled import simulate

GCC = shutil.which("gcc")
pytestmark = pytest.mark.skipif(GCC is None, reason="no gcc")
FLAGS = "-std=c99 -pedantic -Wall -Wextra -Werror -O2".split()

# reads t x u p m h, writes status z dx y m_next
PROBE = """
#include <stdio.h>
#include "NAME.h"
static int row(double *v, int n) {
  while (n-- > 0)
    if (scanf("%lf", v++) != 1) return 0;
  return 1;
}
static void show(const double *v, int n) {
  while (n-- > 0) printf(" %.17g", *v++);
}
int main(void) {
  double t, h, x[NAME_SIZE_X], u[NAME_SIZE_U], p[NAME_SIZE_P], m[NAME_SIZE_M];
  double z[NAME_SIZE_Z], dx[NAME_SIZE_X], y[NAME_SIZE_Y], next[NAME_SIZE_M];
  while (row(&t, 1) && row(x, NAME_N_STATES) && row(u, NAME_N_INPUTS)
         && row(p, NAME_N_PARAMETERS) && row(m, NAME_N_MEMORY) && row(&h, 1)) {
    int status;
    NAME_start(NULL, z, NULL, NULL);
    status = NAME_rates(t, x, u, p, m, h, z, dx) | NAME_outputs(t, x, u, p, m, h, z, y)
      | NAME_advance(t, x, u, p, m, h, z, next);
    printf("%d", status);
    show(z, NAME_N_ALGEBRAIC); show(dx, NAME_N_STATES); show(y, NAME_N_OUTPUTS);
    show(next, NAME_N_MEMORY); printf("\\n");
  }
  return 0;
}
"""


def build(model: Program, folder: Path, main: str | None = None) -> Path:
    """Compile the export with its own example, or with another main program."""
    files = c_code(model)
    header, source, example = files
    if main is not None:
        files[example] = main.replace("NAME", header.removesuffix(".h"))
    for name, text in files.items():
        (folder / name).write_text(text, encoding="ascii")
    target = folder / "run"
    sources = [str(folder / source), str(folder / example)]
    done = subprocess.run([str(GCC), *FLAGS, *sources, "-o", str(target), "-lm"],
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    return target


def run(target: Path, rows: list[list[float]], *arguments: str) -> np.ndarray:
    text = "\n".join(" ".join(repr(float(v)) for v in row) for row in rows)
    done = subprocess.run([str(target), *arguments], input=text, capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    return np.array([[float(v) for v in line.split()] for line in done.stdout.splitlines()])


@pytest.mark.parametrize(("name", "worst"), [("linear", 2e-4), ("hysteretic", 2e-4),
                                             ("ang", 1e-12), ("al_janaideh", 1e-12)])  # fmt: skip
def test_the_example_follows_our_simulation_through_minor_loops(
    name: str, worst: float, tmp_path: Path
) -> None:
    graph = GRAPHS[name]()
    model = program(graph)
    found = run(build(model, tmp_path), np.column_stack([TIME, VOLTAGE]).tolist(), "4")
    expected = simulate(graph, TIME, {"V_in": VOLTAGE}, accuracy=1e-6)
    x = found[:, 1 + model.outputs.index("x")]
    np.testing.assert_allclose(found[:, 0], TIME)
    error = (x - expected["x"]) / float(np.ptp(expected["x"]))
    assert float(np.abs(error).max()) < worst
    assert float(np.sqrt(np.mean(error**2))) < 0.1 * worst
    if "i" in model.outputs:
        i = found[:, 1 + model.outputs.index("i")]
        rms = float(np.sqrt(np.mean((i - expected["i"]) ** 2)))
        assert rms < 5e-3 * float(np.ptp(expected["i"]))


def test_the_example_holds_its_inputs_where_it_is_told_to(tmp_path: Path) -> None:
    graph = GRAPHS["linear"]()
    model = program(graph)
    steps = np.repeat(VOLTAGE[::20], 20)[: TIME.size]
    target, rows = build(model, tmp_path), np.column_stack([TIME, steps]).tolist()
    expected = simulate(graph, TIME, {"V_in": steps}, accuracy=1e-6, hold="hold")["x"]
    at, size = 1 + model.outputs.index("x"), float(np.ptp(expected))
    held, straight = (run(target, rows, "64", *more)[:, at] for more in (("hold",), ()))
    assert float(np.abs(held - expected).max()) < 1e-3 * size
    assert float(np.abs(straight - expected).max()) > 1e-2 * size


@pytest.mark.parametrize("name", [*GRAPHS, "cubic"])
def test_functions_are_the_programs_at_random_points(name: str, tmp_path: Path) -> None:
    model = programs()[name]
    rows, expected = [], []
    for seed in range(30):
        given, z = random_point(model, seed)
        t, x, _, u, p, m, h = given
        rows.append([t, *x, *u, *p, *m, h])
        values = [*model.rhs(*given), model.advance(*given)]
        expected.append([0.0, *z, *(v for part in values for v in part.full().ravel())])
    found = run(build(model, tmp_path, PROBE), rows)
    scale = np.abs(np.array(expected)).max(axis=0)
    assert (np.abs(found - np.array(expected)) <= 1e-12 * scale).all()


def test_the_step_solves_an_algebraic_loop(tmp_path: Path) -> None:
    from tests.bondgraph.export.test_numpy_module import module

    time = np.linspace(0.0, 6.0, 61)
    drive = 3.0 * np.sin(2.0 * time)
    found = run(build(cubic_loop(), tmp_path), np.column_stack([time, drive]).tolist(), "3")
    expected = module(cubic_loop()).simulate(time, {"u": drive}, substeps=3)
    np.testing.assert_allclose(found[:, 1], expected["y"], rtol=0, atol=1e-12)


@pytest.mark.parametrize("law", [QuadraticDrag(0.7), Hysteretic(PI)], ids=["drag", "plays"])
def test_loops_of_the_engine_are_solved(law: Law, tmp_path: Path) -> None:
    time = np.linspace(0.0, 6.0, 301)
    drive = 3.0 * np.sin(3.0 * time) + np.sin(11.0 * time)
    graph = nonlinear_loop(law)
    model = program(graph)
    assert model.algebraic
    expected = simulate(graph, time, {"V": drive}, accuracy=1e-6)["i"]
    found = run(build(model, tmp_path), np.column_stack([time, drive]).tolist(), "2")[:, 1]
    assert float(np.abs(found - expected).max()) < 5e-5 * float(np.ptp(expected))


def test_time_of_the_model_counts_from_the_first_line(tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.0, 11)
    target = build(by_hand(A * NOW), tmp_path)
    for begin in (0.0, 5.0):
        found = run(target, np.column_stack([begin + time, 0 * time]).tolist())
        np.testing.assert_allclose(found[:, 0], begin + time)
        np.testing.assert_allclose(found[:, 1], time**2 / 2, atol=1e-12)


def test_no_solution_is_reported_and_changes_nothing(tmp_path: Path) -> None:
    model = by_hand(Z + A, (Z**2 + 1,), guess=(0.3,))
    main = """
#include <stdio.h>
#include "NAME.h"
int main(void) {
  double x[] = {7.0}, z[] = {0.3}, u[] = {0.0}, p[] = {1.0}, m[1] = {0.0}, dx[1] = {5.0};
  int a = NAME_rates(0.0, x, u, p, m, 0.0, z, dx), b = NAME_step(0.0, 0.1, u, u, p, x, z, m);
  printf("%d %d %g %g %g", a == NAME_NO_CONVERGENCE, b == NAME_NO_CONVERGENCE, x[0], z[0], dx[0]);
  return 0;
}
"""
    assert run(build(model, tmp_path, main), [[0.0]]).tolist() == [[1, 1, 7, 0.3, 5]]


def test_memory_changes_only_when_the_step_is_accepted(tmp_path: Path) -> None:
    """A trial step thrown away leaves no trace: two half steps equal two half steps after it."""
    model = program(GRAPHS["hysteretic"]())
    main = """
#include <stdio.h>
#include <string.h>
#include "NAME.h"
int main(void) {
  double x[2][NAME_SIZE_X], z[NAME_SIZE_Z], p[NAME_SIZE_P], m[2][NAME_SIZE_M];
  double keep_x[NAME_SIZE_X], keep_m[NAME_SIZE_M], u[] = {0.0}, v[] = {60.0}, w[] = {10.0};
  int k;
  for (k = 0; k < 2; k++) {
    NAME_start(x[k], z, p, m[k]);
    if (NAME_step(0.0, 1e-3, u, v, p, x[k], z, m[k])) return 1;
    if (k) {
      memcpy(keep_x, x[k], sizeof keep_x);
      memcpy(keep_m, m[k], sizeof keep_m);
      if (NAME_step(1e-3, 1e-3, v, u, p, x[k], z, m[k])) return 1;
      memcpy(x[k], keep_x, sizeof keep_x);
      memcpy(m[k], keep_m, sizeof keep_m);
    }
    if (NAME_step(1e-3, 1e-3, v, w, p, x[k], z, m[k])) return 1;
  }
  printf("%d %d %d", memcmp(x[0], x[1], sizeof x[0]), memcmp(m[0], m[1], sizeof m[0]),
    m[0][NAME_MEMORY_C_nl_m0] != 0.0);
  return 0;
}
"""
    assert run(build(model, tmp_path, main), [[0.0]]).tolist() == [[0, 0, 1]]


def test_no_heap_and_no_global_variable(tmp_path: Path) -> None:
    nm = shutil.which("nm")
    if nm is None:
        pytest.skip("no nm")
    model = program(GRAPHS["hysteretic"]())
    build(model, tmp_path)
    source = tmp_path / "stack_bond_graph.c"
    subprocess.run([str(GCC), *FLAGS, "-c", str(source), "-o", str(tmp_path / "o.o")], check=True)
    listing = subprocess.run(
        [nm, str(tmp_path / "o.o")], capture_output=True, text=True, check=True
    )
    symbols = [line.split()[-2:] for line in listing.stdout.splitlines()]
    assert not [s for kind, s in symbols if kind in "BbDdC"]
    outside = {s for kind, s in symbols if kind == "U"}
    assert outside <= {"fmax", "fmin", "memcpy", "memset", "__stack_chk_fail",
                       "_GLOBAL_OFFSET_TABLE_"}, outside  # fmt: skip
    assert all(s.startswith("stack_bond_graph_") for kind, s in symbols if kind == "T")


def test_names_and_units_cannot_break_the_code(tmp_path: Path) -> None:
    model = by_hand(-sp.Symbol("class") * X, parameter="class", unit="*/ #error \\\n \u00e9 @ ??/",
                    name="2 motors\n@")  # fmt: skip
    files = c_code(model)
    name = next(iter(files)).removesuffix(".h")
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name)
    assert f"{name}_PARAMETER_class," in files[f"{name}.h"]
    build(model, tmp_path)
