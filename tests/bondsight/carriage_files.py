"""A carriage as model file and recording, and what a refusal looks like."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from bondsight.cli.main import main

GOOD = """
from bondgraph import BondGraph, C, Dq, I, One, R, Se

def model():
    with BondGraph("carriage") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> R("d", 2.0, unit="N*s/m")
        v >> C("k", stiffness=200.0, unit="N/m")
        v >> Dq("x", unit="m")
    return g
"""
UNCONNECTED = """
from bondgraph import BondGraph, C, Dq, I, One, Se

def model():
    with BondGraph("apart") as g:
        v, w = One("v"), One("w")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        w >> C("k", stiffness=200.0, unit="N/m")
        w >> Dq("x", unit="m")
    return g
"""
CONFLICT = """
from bondgraph import BondGraph, Dq, I, One, Se, Sf

def model():
    with BondGraph("fight") as g:
        v = One("v")
        Sf("u", unit="m/s") >> v
        Sf("w", unit="m/s") >> v
        v >> I("m", 1.0, unit="kg")
        v >> Dq("x", unit="m")
    return g
"""
TYPO = GOOD.replace("    return g", '    g["kk"]\n    return g')
SENSORLESS = GOOD.replace('        v >> Dq("x", unit="m")\n', "")
MODEL_FILES: Mapping[str, tuple[str, str]] = {
    "unconnected": (UNCONNECTED, "bond them"),
    "conflict": (CONFLICT, "fight"),
    "typo": (TYPO, "Did you mean 'k'"),
    "value_error": ("def model():\n    raise ValueError('two\\nlines')\n", "ValueError"),
    "syntax_error": ("def model(:\n", "SyntaxError at line 1"),
    "exits": ("import sys\nsys.exit(3)\n", "SystemExit"),
    "exits_inside": ("def model():\n    raise SystemExit\n", "SystemExit"),
    "import_error": ("import no_such_package_here\n", "no_such_package_here"),
    "returns_none": ("def model():\n    return None\n", "NoneType"),
    "returns_class": (GOOD + "\nmodel = dict\n", "dict"),
    "no_factory": ("def modell():\n    pass\n", "Did you mean 'modell'"),
    "not_callable": ("model = 3\n", "no function 'model'"),
    "no_sensor": (SENSORLESS, "sensor"),
    "empty": ("", "no function 'model'"),
    "arguments": ("def model(a):\n    return a\n", "TypeError"),
}
ROWS = "\n".join(
    f"{0.01 * i:.2f},{np.sin(0.3 * i):.6f},{0.1 * np.sin(0.3 * i - 1):.6f}" for i in range(60)
)
HEAD = "t_s,F[N],x[mm]\n"


def table(folder: Path, text: str | bytes, name: str = "run.csv") -> Path:
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


def refused(capsys: pytest.CaptureFixture[str], out: Path | None, *arguments: str) -> str:
    """Run, check the form of the refusal, return its line."""
    more = () if out is None else ("--out", str(out))
    try:
        code = main([*arguments, *more])
    except SystemExit as stop:  # argparse
        code = int(str(stop.code))
    captured = capsys.readouterr()
    assert code == 2, captured
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("bondsight: ")
    assert "Traceback" not in lines[0]
    if out is not None and out.is_dir():
        assert not list(out.iterdir())
    return lines[0]


def carriage(n: int, kind: str) -> str:
    t = 0.01 * np.arange(n)
    rng = np.random.default_rng(3)
    force = np.sin(3 * t) if kind != "no_excitation" else np.zeros(n)
    x = np.full(n, 0.5) if kind == "constant" else 0.1 * np.sin(3 * t)
    if kind == "no_excitation":
        x = 1e-3 * rng.standard_normal(n)
    return HEAD + "\n".join(
        f"{a:.3f},{b!r},{c!r}" for a, b, c in zip(t, map(float, force), map(float, x), strict=True)
    )
