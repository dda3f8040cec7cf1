"""Who may import whom; read from the sources, so that lazy imports count as well."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import bondgraph

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bondgraph", "actuators", "identification", "hardware", "bondsight")

# folder -> what it may import of the project beside itself; the longest fitting folder counts
ALLOWED: dict[str, set[str]] = {
    "bondgraph": set(),
    "actuators": {"bondgraph"},
    "identification": {"bondgraph", "actuators"},
    "hardware": {"bondgraph"},
    "bondsight": {"bondgraph", "actuators", "identification", "hardware"},
    # the virtual benches share nothing with the code they judge, the generator not even with them
    "hardware/simulators": set(),
    "hardware/simulators/generator": set(),
}
SEALED = ("hardware/simulators", "hardware/simulators/generator")

SOURCES = sorted(
    p.relative_to(ROOT).as_posix() for name in PACKAGES for p in (ROOT / name).rglob("*.py")
)


def rule_for(source: str) -> str:
    """Return the longest folder of `ALLOWED` that holds `source`."""
    return max((f for f in ALLOWED if source.startswith(f + "/")), key=len)


def imports(text: str, source: str) -> Iterator[tuple[int, str]]:
    """Yield line and absolute module of every import, relative ones resolved."""
    package = source.split("/")[:-1]
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            yield from ((node.lineno, f"{module}.{alias.name}") for alias in node.names)
        elif isinstance(node, ast.Call) and node.args:
            first = node.args[0]
            if called(node.func) in IMPORTERS and isinstance(first, ast.Constant):
                yield node.lineno, str(first.value)


IMPORTERS = ("__import__", "importlib.import_module", "import_module")


def called(function: ast.expr) -> str:
    """Return what is called, as it is written; empty where that is no name."""
    match function:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=ast.Name(id=name), attr=member):
            return f"{name}.{member}"
    return ""


def offences(text: str, source: str) -> list[str]:
    """Return one line for every import that the layering forbids."""
    folder = rule_for(source)
    found = []
    for line, module in imports(text, source):
        top = module.split(".")[0]
        if top not in (*PACKAGES, "tests"):
            continue
        inside = (
            module.startswith(folder.replace("/", "."))
            if folder in SEALED
            else top == source.split("/")[0]
        )
        if not inside and top not in ALLOWED[folder]:
            found.append(f"{source}:{line} imports {module}")
    return found


def text_of(source: str) -> str:
    """Return the text of a source."""
    return (ROOT / source).read_text(encoding="utf-8")


def may_offend(text: str, source: str) -> bool:
    """Return whether a source is worth parsing: it names a package that it may not import.

    Most do not, outside the examples of their docstrings. Sealed folders are always parsed.
    """
    folder = rule_for(source)
    if folder in SEALED:
        return True
    foreign = {*PACKAGES, "tests"} - ALLOWED[folder] - {source.split("/")[0]}
    named = re.compile(rf"\b(?:{'|'.join(sorted(foreign))})\b")
    return any(
        named.search(line)
        for line in text.splitlines()
        if not line.lstrip().startswith((">>>", "..."))
    )


def test_imports_stay_in_their_layer() -> None:
    assert len(SOURCES) > 1000
    asked = [source for source in SOURCES if may_offend(text_of(source), source)]
    assert [o for source in asked for o in offences(text_of(source), source)] == []


@pytest.mark.parametrize(
    ("source", "text", "caught"),
    [
        ("bondgraph/a.py", "from identification.estimation.single_record import fit", True),
        ("bondgraph/a.py", "def f():\n    import hardware.real", True),
        ("bondgraph/a.py", "import importlib\nimportlib.import_module('actuators')", True),
        ("bondgraph/a.py", "from . import b\nfrom bondgraph.c import d", False),
        ("bondgraph/laws/a.py", "from ..graph import BondGraph", False),
        ("actuators/a.py", "import bondgraph", False),
        ("actuators/a.py", "import hardware", True),
        ("identification/a.py", "import actuators, bondgraph.graph.bond_graph", False),
        ("identification/a.py", "import hardware.simulators", True),
        ("bondsight/cli/a.py", "import hardware.simulators", False),
        ("hardware/a.py", "import bondgraph\nimport hardware.simulators", False),
        ("hardware/a.py", "import identification", True),
        ("hardware/simulators/a.py", "from hardware.simulators.plant import p", False),
        ("hardware/simulators/a.py", "from .plant import p", False),
        ("hardware/simulators/a.py", "import bondgraph.graph.bond_graph", True),
        ("hardware/simulators/a.py", "from ..real import driver", True),
        ("hardware/a.py", "import tests.helpers", True),
        ("hardware/simulators/generator/a.py", "from bondgraph.laws import law", True),
        (
            "hardware/simulators/generator/a.py",
            "from identification.estimation.single_record import fit",
            True,
        ),
        ("hardware/simulators/generator/a.py", "from tests.proof.trial import layout", True),
        ("hardware/simulators/generator/a.py", "from hardware.simulators.plant import p", True),
        ("hardware/simulators/generator/a.py", "from .law import Law", False),
        ("hardware/simulators/judging/a.py", "import identification", True),
    ],
)
def test_the_rules_catch_what_they_should(source: str, text: str, caught: bool) -> None:
    assert bool(offences(text, source)) is caught
    assert may_offend(text, source) or not caught


# inside identification: what a folder may not know
BELOW = {
    "identification/report/": ("identification.report", "identification.statistics"),
    "identification/statistics/": ("identification.report.numbers", "identification.statistics"),
}


def uphill(text: str, source: str) -> list[str]:
    """Return what a folder at the bottom of identification, or judgement, may not import."""
    if not source.startswith((*BELOW, "identification/validation/")):
        return []
    found = []
    for line, module in imports(text, source):
        if not module.startswith("identification."):
            continue
        for folder, known in BELOW.items():
            if source.startswith(folder) and not module.startswith(known):
                found.append(f"{source}:{line} imports {module}")
        if source.startswith("identification/validation/") and "identification.diagnosis" in module:
            found.append(f"{source}:{line} imports {module}")
    return found


def test_report_and_statistics_lie_below_fits_and_diagnoses() -> None:
    inside = [s for s in SOURCES if s.startswith("identification/")]
    assert len(inside) > 300
    assert [o for source in inside for o in uphill(text_of(source), source)] == []


def test_an_import_uphill_is_caught() -> None:
    for folder in ("report", "statistics", "validation"):
        source = f"identification/{folder}/a.py"
        assert uphill(
            "def f():\n    from identification.diagnosis.search.candidates import Trial", source
        )
        assert not uphill("from identification.statistics.blocks import paired_z", source)


def test_this_checkout_is_tested() -> None:
    assert bondgraph.__file__ is not None
    assert Path(bondgraph.__file__).resolve() == ROOT / "bondgraph" / "__init__.py"


def test_nobody_asks_an_engine_for_its_class() -> None:
    asked = re.compile(r"isinstance\([^()]*,\s*\(?[^()]*\b(Exact|General)(Dynamics|Mode)\b")
    found = [
        f"{p.relative_to(ROOT)}"
        for package in PACKAGES
        for p in sorted((ROOT / package).rglob("*.py"))
        if asked.search(p.read_text(encoding="utf-8"))
    ]
    assert found == []
