"""Every notebook equals its script, which runs, and holds its outputs; `long` in fresh kernels."""

from __future__ import annotations

import os
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jupytext
import matplotlib
import matplotlib.pyplot as plt
import pytest
from nbclient import NotebookClient
from threadpoolctl import threadpool_limits

FOLDER = Path(__file__).resolve().parents[2] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def sources(notebook: Any) -> list[tuple[str, str]]:
    return [(c.cell_type, c.source.strip()) for c in notebook.cells]


def test_every_script_has_its_notebook() -> None:
    assert {p.stem for p in NOTEBOOKS} == {p.stem for p in FOLDER.glob("*.py")} != set()


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_script_and_notebook_are_the_same(path: Path) -> None:
    assert sources(jupytext.read(path)) == sources(jupytext.read(path.with_suffix(".py")))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_outputs_are_kept(path: Path) -> None:
    cells = [c for c in jupytext.read(path).cells if c.cell_type == "code"]
    assert all(c.execution_count for c in cells)
    assert any(c.outputs for c in cells)
    assert not [o for c in cells for o in c.outputs if o.output_type == "error"]


@pytest.fixture
def as_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Work in an empty folder, draw nothing, and leave nothing behind for the next test."""
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    # drawing is for readers; what is drawn is checked where the outputs are kept
    monkeypatch.setattr(plt, "show", lambda: plt.close("all"))
    environment = dict(os.environ)
    # notebooks limit the threads of BLAS for good
    with matplotlib.rc_context(), threadpool_limits():
        yield
    plt.close("all")
    os.environ.clear()
    os.environ.update(environment)


HEAVY = (
    "01_from_model_to_repaired_fit",
    "03_ultrasonic_actuator",
    "04_sketch_to_code",
    "06_identify_the_stack",
    "07_what_do_my_data_determine",
    "08_a_persons_proof",
    "09_a_bench_session",
    "11_the_thesis_in_one_hour",
)
"""What these show is tested part by part; as a whole they are for `make proofs`."""


@pytest.mark.slow
@pytest.mark.usefixtures("as_before")
@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.long] if p.stem in HEAVY else []) for p in NOTEBOOKS],
    ids=lambda p: p.stem,
)
def test_script_runs(path: Path) -> None:
    runpy.run_path(str(path.with_suffix(".py")))


@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_runs(path: Path, tmp_path: Path) -> None:
    notebook = jupytext.read(path)
    client = NotebookClient(
        notebook,
        timeout=300,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    )
    client.execute()
