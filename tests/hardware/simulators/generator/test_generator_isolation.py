"""The generator must not know the tool: in its sources, and in what a run of it loads."""

from __future__ import annotations

import ast
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import hardware.simulators.generator as generator

HOME = Path(generator.__file__).parent
OWN = "hardware.simulators.generator"
FREE = {"numpy", "scipy", *sys.stdlib_module_names}


def foreign(text: str) -> list[str]:
    """Return what a source imports beside the standard library, numpy, scipy and the package."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = ["." * node.level + (node.module or "")]
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith(
            ("import_module", "__import__", "exec", "eval")
        ):
            names = ["call " + ast.unparse(node)]
        else:
            continue
        found += [
            n
            for n in names
            if n != OWN and not n.startswith(OWN + ".") and n.split(".")[0] not in FREE
        ]
    return found


@pytest.mark.parametrize("path", sorted(HOME.rglob("*.py")), ids=lambda p: p.name)
def test_sources_import_nothing_of_the_project(path: Path) -> None:
    assert foreign(path.read_text()) == []


@pytest.mark.parametrize(
    "text",
    [
        "import bondgraph",
        "from identification.diagnosis import search",
        "from tests.proof.trial import run",
        "from hardware.simulators.plant import PlantParameters",
        "from .. import run",
        "import importlib; importlib.import_module('bondgraph')",
    ],
)
def test_the_check_finds_an_offence(text: str) -> None:
    assert foreign(text)


def test_c_code_includes_nothing_of_the_project() -> None:
    for path in (HOME / "c").iterdir():
        included = [x.split()[1] for x in path.read_text().splitlines() if x.startswith("#include")]
        assert set(included) <= {"<math.h>", "<string.h>", '"laws.h"', '"plants.h"'}, path.name


RUN = """
import json, sys
from hardware.simulators.generator import draw, generate, load_case, seal
cases = sorted(draw("reduced", 3), key=lambda c: c.samples)[:3]
truths = generate(cases, sys.argv[1])
load_case(sys.argv[1], cases[0].id)
seal(truths, "salt")
tops = ("bondsight", "bondgraph", "actuators", "hardware", "identification", "tests")
print(json.dumps(sorted(m for m in sys.modules if m.split(".")[0] in tops)))
"""


def test_a_run_loads_nothing_of_the_project(tmp_path: Path) -> None:
    alone = tmp_path / "hardware" / "simulators"
    shutil.copytree(HOME, alone / HOME.name)
    for door in (alone, alone.parent):
        (door / "__init__.py").touch()  # the project's own doors load more
    made = subprocess.run(
        [sys.executable, "-c", RUN, str(tmp_path)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = json.loads(made.stdout)
    assert OWN + ".making" in loaded
    others = [m for m in loaded if not (m == OWN or m.startswith(OWN + "."))]
    assert others == ["hardware", "hardware.simulators"]
