"""``bondsight acquire --simulated`` killed: the bench that it started goes with it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from hardware.simulators.control import ask
from tests.patience import HANGS

pytestmark = [
    pytest.mark.skipif(shutil.which("gcc") is None, reason="the stub library is C code"),
    pytest.mark.skipif(os.name != "posix", reason="a parent's end is told on POSIX"),
]


def soon(condition: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return condition()


def serves(address: str) -> bool:
    try:
        ask(address, "NOW")
    except ConnectionError:
        return False
    return True


@pytest.mark.long
def test_no_bench_is_left_behind(tmp_path: Path) -> None:
    program = subprocess.Popen(
        [sys.executable, "-m", "bondsight", "acquire", "--simulated",
         "--effect", "none", "--seed", "3", "--quiet", "--out", str(tmp_path / "out")],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )  # fmt: skip
    try:
        name = "bondsight-bench-*/ready.json"
        assert soon(lambda: any(tmp_path.glob(name)) or program.poll() is not None, HANGS)
        (ready,) = tmp_path.glob(name)
        told = json.loads(ready.read_text())
        address = told["addresses"]["control"]
        assert serves(address)
        assert told["pid"] != program.pid
    finally:
        program.kill()
        program.wait()
    assert soon(lambda: not ready.exists(), HANGS)
    assert not serves(address)
