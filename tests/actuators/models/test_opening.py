"""A model that cannot be loaded says where it failed, in one line."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from actuators.models.opening import load_model
from bondgraph.support.errors import GraphError, UnusableInput


def refused(text: str) -> str:
    with pytest.raises(UnusableInput) as found:
        load_model(text)
    assert "\n" not in str(found.value)
    return str(found.value)


def written(folder: Path, text: str, name: str = "mine.py") -> str:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


@pytest.mark.parametrize("folder", ["plain", "identification", "actuators"])
def test_the_place_is_that_of_the_model_wherever_it_lies(tmp_path: Path, folder: str) -> None:
    text = "def model():\n    return 1 / 0\n"
    assert "ZeroDivisionError at mine.py line 2: " in refused(written(tmp_path / folder, text))
    assert "SyntaxError at line 1: " in refused(written(tmp_path / folder, "def model(:\n"))
    missing = refused(written(tmp_path / folder, "\nimport no_such_package\n"))
    assert "ModuleNotFoundError at mine.py line 2: " in missing


def test_a_factory_that_needs_an_argument_has_no_wrong_place(tmp_path: Path) -> None:
    file = written(tmp_path, "def model(k):\n    return k\n")
    said = refused(file)
    assert said.startswith(f"model {file} raised TypeError: model() missing 1 required")
    assert "opening.py" not in said


@pytest.mark.parametrize("words", ["-784.8, unit='N'", "value=-784.8"])
@pytest.mark.parametrize(("kind", "said"), [("Se", "effort is MSe"), ("Sf", "flow is MSf")])
def test_a_constant_source_is_proposed(tmp_path: Path, kind: str, words: str, said: str) -> None:
    text = f"from bondsight import {kind}\ndef model():\n    return {kind}('weight', {words})\n"
    line = refused(written(tmp_path, text))
    assert "TypeError at mine.py line 3: " in line
    assert line.endswith(f"a constant {said}(name, value, unit=...)")


def test_one_of_several_models_of_a_file_is_taken_by_its_name(tmp_path: Path) -> None:
    text = (
        "from bondsight import BondGraph, C, One, R, Se\n"
        "def spring():\n"
        "    with BondGraph('spring') as g:\n"
        "        Se('F') >> One('j') >> C('k', stiffness=1.0)\n"
        "        g['j'] >> R('d', 1.0)\n"
        "    return g\n"
        "made = spring()\n"
    )
    file = written(tmp_path, text)
    assert {load_model(f"{file}:{name}").name for name in ("spring", "made")} == {"spring"}
    said = refused(f"{file}:sprung")
    assert "no function 'sprung'" in said
    assert "Did you mean 'spring'? Known: spring, made" in said


def test_what_is_no_model_file_is_said(tmp_path: Path) -> None:
    for text in (str(tmp_path), written(tmp_path, "m = 1", "model.txt"), "."):
        assert refused(text).startswith(f"model {text} is neither a .py nor a .json file")


def test_a_module_that_does_not_exist_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert refused("no_such.part:thing") == "no module 'no_such'; check the name"
    assert refused("json.part:thing") == "no module 'json.part'; check the name"
    monkeypatch.chdir(tmp_path)
    written(tmp_path, "import no_such_package\n", "lacks_another.py")
    said = refused("lacks_another:thing")
    assert "lacks_another raised ModuleNotFoundError at lacks_another.py line 1: " in said


PARTS = """
from __future__ import annotations
from dataclasses import dataclass
from typing import ClassVar
from bondsight import C, I, Se, R
from bondgraph.laws import Law

@dataclass(frozen=True)
class Bent(Law):
    name: ClassVar[str] = "bent"
    def deviation(self, ops, s, memory, p):
        return SIZE * s**3

SIZE = 2.0
"""
MODEL = """
from bondsight import BondGraph, C, I, One, R, Se
import {parts}

def model():
    import {parts} as again  # when it is called, too
    with BondGraph("mine") as g:
        v = One("v")
        Se("F") >> v >> I("m", {parts}.SIZE)
        v >> C("k", stiffness=again.SIZE, law=again.Bent())
        v >> R("d", 1.0)
    return g
"""


def loads(text: str) -> float:
    """Load a model that leaves nothing behind; returns its mass."""
    path, finders, modules = list(sys.path), list(sys.meta_path), set(sys.modules)
    graph = load_model(text)
    assert (sys.path, sys.meta_path) == (path, finders)
    assert not {n for n in sys.modules if "parts" in n or "bondsight_model" in n} - modules
    assert graph.check() == ()
    return graph.parameters["m"].value


def test_a_model_imports_what_lies_beside_it(tmp_path: Path) -> None:
    """Each the file of its own folder, whichever was loaded before, however often."""
    one, other = tmp_path / "one", tmp_path / "other"
    for folder, size in ((one, "2.0"), (other, "3.0")):
        written(folder, PARTS.replace("2.0", size), "my_parts.py")
        written(folder, MODEL.format(parts="my_parts"))
    assert [loads(str(f / "mine.py")) for f in (one, other, one)] == [2.0, 3.0, 2.0]
    written(one, PARTS.replace("2.0", "4.125"), "my_parts.py")
    assert loads(str(one / "mine.py")) == 4.125


def test_a_package_beside_it_and_what_that_imports(tmp_path: Path) -> None:
    inner = tmp_path / "my_parts"
    written(inner, "from my_parts.springs import *\nfrom .springs import SIZE\n", "__init__.py")
    written(inner, PARTS + "import deeper_parts\n", "springs.py")
    written(tmp_path, "THERE = True\n", "deeper_parts.py")
    assert loads(written(tmp_path, MODEL.format(parts="my_parts"))) == 2.0


def test_a_fault_beside_it_is_found_there_and_leaves_nothing(tmp_path: Path) -> None:
    written(tmp_path, "\nSIZE = 1 / 0\n", "my_parts.py")
    finders = list(sys.meta_path)
    said = refused(written(tmp_path, MODEL.format(parts="my_parts")))
    assert "raised ZeroDivisionError at my_parts.py line 2: " in said
    assert sys.meta_path == finders
    assert "my_parts" not in sys.modules


def test_a_name_that_the_front_door_lacks_is_found(tmp_path: Path) -> None:
    said = refused(written(tmp_path, "from bondsight import Da\n"))
    assert said.endswith("; mend the model: from bondgraph import Da")
    said = refused(written(tmp_path, "from bondsight import Nowhere\n"))
    assert said.endswith("; mend the model")


def test_a_package_that_is_missing_is_named(tmp_path: Path) -> None:
    said = refused(written(tmp_path, "import not_there.at_all\n"))
    assert said.endswith("No module named 'not_there'; mend the model, or pip install not_there")


@pytest.mark.parametrize("name", ["statistics", "networkx", "sys"])
def test_a_name_that_is_installed_too_is_refused(tmp_path: Path, name: str) -> None:
    written(tmp_path, PARTS, f"{name}.py")
    said = refused(written(tmp_path, MODEL.format(parts=name)))
    assert f"mine.py imports {name}, which is {name}.py beside it and an installed module" in said
    assert said.endswith("; rename the one beside it")
    beside = written(tmp_path, f"from {name} import SIZE\n", "my_parts.py")
    assert beside
    said = refused(written(tmp_path, MODEL.format(parts="my_parts")))
    assert f"my_parts.py imports {name}, which is {name}.py beside it" in said


def test_what_nobody_imports_may_have_any_name(tmp_path: Path) -> None:
    """The libraries go on with their own."""
    for name in ("statistics.py", "colorsys.py", "numpy.py"):
        written(tmp_path, "raise RuntimeError('not this one')\n", name)
    written(tmp_path, PARTS + "from scipy import signal\n", "my_parts.py")
    assert loads(written(tmp_path, MODEL.format(parts="my_parts"))) == 2.0


def test_annotations_that_are_text_are_read(tmp_path: Path) -> None:
    """Dataclasses look them up in the module of the model."""
    own = MODEL.format(parts="json").replace("json.SIZE", "SIZE").replace("again.", "")
    assert loads(written(tmp_path, PARTS + own)) == 2.0


def test_a_refusal_of_an_element_names_the_line_of_the_model(tmp_path: Path) -> None:
    text = "from bondgraph import R\ndef model():\n    return R(2.0, 'Ra', unit='ohm')\n"
    with pytest.raises(GraphError, match=r"swapped: write R\('Ra', 2.0, ...\)") as stop:
        load_model(written(tmp_path, text))
    assert stop.value.__notes__ == ["at mine.py line 3"]
    plain = text.replace("R(2.0, 'Ra', ", "R(2.0, ")
    with pytest.raises(GraphError, match=r'write R\("name", 2.0, ...\)'):
        load_model(written(tmp_path, plain))
