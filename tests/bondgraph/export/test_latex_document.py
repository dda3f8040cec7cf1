"""Whole LaTeX files: typeset by matplotlib, read back by SymPy, compiled where TeX is installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sympy as sp
from matplotlib.mathtext import MathTextParser

from actuators.models.catalogue import MODELS
from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_ang
from bondgraph import BondGraph, C, Df, I, One, R, Se, Zero
from bondgraph.equations.codegen import program
from bondgraph.equations.program import Program, ProgramStep
from bondgraph.export.latex import pretty, tex, words
from bondgraph.export.latex_document import document
from bondgraph.export.latex_lines import broken, width
from tests.bondgraph.export.loop_program import cubic_loop

ENGINE = next((e for e in ("tectonic", "pdflatex", "lualatex") if shutil.which(e)), None)
NAMES = ["stack_bond_graph", "stack_lumped", "stack_ang", "ultrasonic_stage", "resonator"]
HOSTILE = "\\input{secret} %$#_&~^{}\n\\end{document}\x07 \u2126 \u6f22"


def chain() -> BondGraph:
    with BondGraph("chain") as g:
        last: Any = One("l0")
        _ = Se("V") >> last >> R("R_a", 1.0)
        for i in range(8):
            node, following = Zero(f"n{i}"), One(f"l{i + 1}")
            _ = last >> node >> C(f"C_{i}", 1e-6)
            _ = node >> following >> R(f"R_{i}", 1.0)
            last = following
        _ = last >> I("L_end", 1.0)
        _ = last >> Df("i_end", unit="A")
    return g


def hostile() -> Program:
    p = cubic_loop()
    a = sp.symbols("alpha_1:9 R_longname_1:9 C_xy_1:9", real=True)
    long = sum(v * sp.Symbol(f"q_{i}") / (1 + a[(i + 3) % 24]) for i, v in enumerate(a))
    hard = (long / sum(a) ** 2) * sp.sin(long) * (1 - long) - sp.Function("f_law")(long)
    return replace(
        p, name=HOSTILE, parameters=("k", "\u00fcnit_\u6f22"),
        units={"k": "\u00b5m\u00b2/\u00b0C %"},
        steps=(
            ProgramStep("e_long", long, None, HOSTILE),
            ProgramStep("\u03c4_\u03bb", -hard, None, ""),
        ),
        rates=(sp.Symbol("e_long", real=True),),
    )  # fmt: skip


def documents() -> dict[str, str]:
    found = {n: document(program(MODELS[n]())) for n in NAMES}
    return found | {
        "program": document(program(stack_bond_graph(sensors=("x", "i")))),
        "operator": document(program(stack_ang())),
        "loop": document(cubic_loop()),
        "chain": document(program(chain())),
        "hostile": document(hostile()),
    }


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    return documents()


def formulas(text: str) -> Iterator[str]:
    """Every line of the align environments and every inline formula, as one formula each."""
    for block in re.findall(r"\\begin\{align\*\}\n(.*?)\n\\end\{align\*\}", text, re.DOTALL):
        for row in block.split(" \\\\\n"):
            yield row.split(" && ")[0].replace("&", "")
    yield from re.findall(r"\\\((.*?)\\\)", text)


def test_matplotlib_sets_every_formula_and_no_line_is_wider_than_the_page(
    texts: dict[str, str],
) -> None:
    """As matplotlib measures them: 16 cm at 10 points, its own being 12."""
    parser = MathTextParser("path")
    page = 16.0 / 2.54 * 72
    count = 0
    for name, text in texts.items():
        for formula in formulas(text):
            # matplotlib has no brackets of chosen size
            plain = re.sub(r"\\[bB]ig[lr]([()])", r"\1", formula)
            count += 1
            assert 0 < parser.parse(f"${plain}$", dpi=72)[0] * 10 / 12 < page, (name, formula)
    assert count > 200


def test_documents_are_complete_and_closed(texts: dict[str, str]) -> None:
    for text in texts.values():
        assert text.isascii()
        assert text.startswith("\\documentclass[a4paper]{article}\n\\usepackage{amsmath}\n")
        assert text.count("\\end{document}") == 1
        assert text.endswith("\\end{document}\n")
        plain = re.sub(r"\\[{}]", "", text)
        assert plain.count("{") == plain.count("}")
        for opened in set(re.findall(r"\\begin\{(.*?)\}", text)):
            begun, ended = f"\\begin{{{opened}}}", f"\\end{{{opened}}}"
            assert text.count(begun) == text.count(ended)
        assert "\\input" not in text


@pytest.mark.skipif(ENGINE is None, reason="no TeX engine on the path")
def test_tex_compiles_them(texts: dict[str, str], tmp_path: Path) -> None:
    for name, text in texts.items():
        (tmp_path / f"{name}.tex").write_text(text, encoding="ascii")
        flags = [] if ENGINE == "tectonic" else ["-interaction=nonstopmode", "-halt-on-error"]
        run = subprocess.run(
            [str(ENGINE), *flags, f"{name}.tex"], cwd=tmp_path, capture_output=True, check=False
        )
        said = run.stdout.decode(errors="replace") + run.stderr.decode(errors="replace")
        assert run.returncode == 0, said[-2000:]
        assert (tmp_path / f"{name}.pdf").stat().st_size > 1000
        wide = [float(v) for v in re.findall(r"Overfull \\hbox \(([\d.]+)pt.*detected", said)]
        assert max(wide, default=0.0) < 12.0, name


def test_program_shows_laws_unknowns_and_values() -> None:
    text = document(program(stack_ang()))
    assert r"12 numbers of memory" in text
    assert r"\varphi_{D_{V_{in}}}{\left(" in text
    text = document(cubic_loop())
    assert "Algebraic equations, solved together" in text
    assert r"0 &= b z + k z^{3} - u - x" in text
    text = document(program(stack_bond_graph()))
    assert r"\(T\) & \texttt{T} & parameter & \(0.0327\) & m/C" in text
    assert r"\(C_{nl}\) & \texttt{C\_nl} & parameter & \(5.346 \times 10^{-10}\)" in text


def test_closed_forms_too_large_to_read_are_left_out() -> None:
    p = cubic_loop()
    x = sp.Symbol("x", real=True)
    steps, last = [], x
    for i in range(30):  # each doubles the one before
        steps.append(ProgramStep(f"s{i}", last * (1 + last), None, ""))
        last = sp.Symbol(f"s{i}", real=True)
    text = document(replace(p, steps=tuple(steps), rates=(last,), residuals=(last,)))
    assert re.search(r"Left out: \d{9,} operations", text)


def test_lines_mean_what_the_expression_means() -> None:
    pytest.importorskip("lark")
    from sympy.parsing.latex import parse_latex

    a, b, c, d, g, f = sp.symbols("a b c d g f", positive=True)
    total = a * b / (1 + c) - d * g + f
    for expression in (
        total * (a - b) / (c + d) ** 2,
        -total / (a + b + c + d) - (a - total) * g,
        (total + a) ** 3 - b,
        -(total**2) * a / b,
    ):
        lines = broken(expression, 10.0)
        assert len(lines) > 2
        text = re.sub(r"\\[bB]igl", r"\\left", " ".join(lines))
        text = re.sub(r"\\[bB]igr", r"\\right", text)
        # that parser needs every multiplication shown
        text = re.sub(r"(?<=[\w})]) (?=\w|\\left)", r" \\cdot ", text)
        read = parse_latex(text, backend="lark")
        at = dict(zip("abcdgf", (0.3, 1.7, 2.2, 0.9, 1.1, 3.4), strict=True))
        found = sp.N(read.subs({sp.Symbol(k): v for k, v in at.items()}))
        expected = sp.N(expression.subs({sp.Symbol(k, positive=True): v for k, v in at.items()}))
        assert float(found) == pytest.approx(float(expected), rel=1e-12), text


@pytest.mark.parametrize("limit", [12.0, 25.0, 60.0])
def test_lines_keep_the_limit(limit: float) -> None:
    names = sp.symbols("k_1:30", positive=True)
    expression = sum(u * v / (u + 1) for u, v in zip(names[1:], names[:-1], strict=True))
    for line in broken(expression / sum(names) * (names[0] - expression), limit):
        assert width(line) <= limit + 8.0


@pytest.mark.parametrize(
    ("text", "expected"),
    [("a b", 2.0), (r"\frac{a b c}{d}", 3.0), (r"q_{C_{n}}", 2.19), (r"\tau_{m}", 1.7)],
)
def test_width(text: str, expected: float) -> None:
    assert width(text) == pytest.approx(expected)


def test_names_and_words_are_never_obeyed() -> None:
    assert words("\\end{document}") == r"\textbackslash{}end\{document\}"
    assert words("a\nb\tc\x00d") == "a b c d"
    assert words("\u00b5m") == r"\ensuremath{\mu }m"
    assert pretty("\u03c4_1") == r"\tau _{1}"
    assert pretty("\u6f22") == r"\mathrm{u6F22}"
    assert tex(sp.sin(sp.Symbol("x"))) == r"\sin{\left(x \right)}"
