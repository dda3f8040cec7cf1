"""What ``make`` says while it sets up: one line before, and nothing of pip unless it fails."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# a make of its own, not one that the make of these tests calls
OWN = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")}
SETS_UP = "setting up the environment in {}: about two minutes the first time"


def made(asked: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(asked, cwd=ROOT, env=OWN, capture_output=True, text=True, check=True)


@pytest.mark.skipif(shutil.which("make") is None, reason="no make here")
@pytest.mark.parametrize("target", ["demo", "environment"])
def test_setting_up_is_announced(target: str, tmp_path: Path) -> None:
    venv = tmp_path / "venv"
    asked = ["make", "--dry-run", target, f"VENV={venv}"]
    done = made(asked)
    lines = done.stdout.splitlines()
    assert lines[0] == f'echo "{SETS_UP.format(venv)}"'
    installs = [line for line in lines if " -m pip install " in line]
    assert installs
    assert all(line.count("--quiet") == 2 for line in installs)
    assert not venv.exists()


@pytest.mark.skipif(shutil.which("make") is None, reason="no make here")
def test_only_the_line_is_printed(tmp_path: Path) -> None:
    """With a pip that says nothing, as it does when all is well."""
    venv = tmp_path / "venv"
    (venv / "bin").mkdir(parents=True)
    python = venv / "bin" / "python"
    python.write_text("#!/bin/sh\nexit 0\n")
    python.chmod(0o755)
    asked = ["make", "--no-print-directory", "environment", f"VENV={venv}"]
    first = made(asked)
    assert (first.stdout, first.stderr) == ("", "")
    (venv / ".test").unlink()
    again = made(asked)
    assert again.stdout == f"bringing the environment in {venv} up to date\n"
