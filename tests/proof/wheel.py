"""The wheel alone: built, installed in an empty environment, the README and the verbs tried there.

Runs by ``make wheel``. Needs an index of packages for the dependencies.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import venv
import zipfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {"bondsight", "bondgraph", "actuators", "identification", "hardware"}
GENERATOR = "hardware/simulators/generator/c/"
DATA = ("hardware/simulators/generator/prepared/tanks_1.npz", "bondgraph/simulation/march.c")
VERBS: tuple[tuple[str, ...], ...] = (
    ("--help",),
    ("check", "stack_bond_graph"),
    ("equations", "stack_bond_graph", "--format", "closed"),
    ("export", "stack_bond_graph", "--format", "numpy"),
    ("effects", "backlash"),
    ("recordings",),
    ("thesis",),
    ("models", "motor"),
    ("demo", "--seed", "7"),
)
ABSENT = ("blind", "published", "conformance", "coverage", "real", "bench")
RUN_README = """
import re, sys
text = open(sys.argv[1], encoding="utf-8").read()
names = {"__name__": "readme"}
for i, block in enumerate(re.findall(r"^```python\\n(.*?)^```", text, re.M | re.S), start=1):
    exec(compile(block, f"README.md, block {i}", "exec"), names)
"""


def run(command: Iterable[str | Path], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command in `folder` without this checkout on its path."""
    return subprocess.run(
        [str(c) for c in command], cwd=folder, capture_output=True, text=True, check=False
    )


def must(command: Iterable[str | Path], folder: Path) -> str:
    """Run a command that has to succeed; returns what it printed."""
    done = run(command, folder)
    if done.returncode:
        raise SystemExit(f"{command}: exit {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def contents(wheel: Path) -> set[str]:
    """Return the top-level names of a wheel, beside its own information."""
    with zipfile.ZipFile(wheel) as archive:
        tops = {name.split("/")[0] for name in archive.namelist()}
    return {t for t in tops if not t.endswith(".dist-info")}


def c_sources(wheel: Path) -> set[str]:
    """Return the names of the C files and headers of the generator that a wheel holds."""
    with zipfile.ZipFile(wheel) as archive:
        return {
            n for n in archive.namelist() if n.startswith(GENERATOR) and n.endswith((".c", ".h"))
        }


def main() -> int:
    """Build, install, try; returns 0, or ends with what failed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        must(
            [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, ROOT], ROOT
        )
        (wheel,) = folder.glob("*.whl")
        assert contents(wheel) == PACKAGES, contents(wheel)
        own = {p.relative_to(ROOT).as_posix() for p in (ROOT / GENERATOR).glob("*.[ch]")}
        assert c_sources(wheel) == own != set(), c_sources(wheel)
        with zipfile.ZipFile(wheel) as archive:
            assert set(DATA) <= set(archive.namelist())
        venv.create(folder / "env", with_pip=True)
        python, command = folder / "env/bin/python", folder / "env/bin/bondsight"
        must([python, "-m", "pip", "install", "--quiet", f"{wheel}[data]"], folder)
        must([python, "-c", RUN_README, ROOT / "README.md"], folder)
        print("README: every block of Python runs")
        for verb in VERBS:
            must([command, *verb], folder)
            print(f"bondsight {' '.join(verb)}: runs")
        for absent in ABSENT:
            done = run([command, absent], folder)
            line = done.stderr.strip()
            assert done.returncode == 2, (absent, done)
            assert "checkout" in line, (absent, line)
            assert "\n" not in line, (absent, line)
            print(line)
    return 0


if __name__ == "__main__":
    sys.exit(main())
