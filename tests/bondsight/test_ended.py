"""SIGTERM ends a search as Ctrl-C does; what was set before is set again."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from bondsight.cli.main import main
from bondsight.cli.output import INTERRUPTED, ended_like_ctrl_c
from tests.bondsight.carriage_files import GOOD


def test_the_handler_is_there_and_gone_again() -> None:
    if threading.current_thread() is not threading.main_thread():
        pytest.skip("signals come to the main thread only")
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), ended_like_ctrl_c():
        signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) == before


def test_another_thread_sets_no_handler() -> None:
    before = signal.getsignal(signal.SIGTERM)
    seen = []

    def work() -> None:
        with ended_like_ctrl_c():
            seen.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


@pytest.mark.parametrize(
    ("words", "work"),
    [
        (("demo", "--seed", "3"), "bondsight.cli.demonstration.demo"),
        (("identifiability", "motor"), "actuators.models.opening.load_model"),
        (("fit", "r.csv", "--model", "motor"), "actuators.models.opening.load_model"),
    ],
)
def test_every_verb_that_hands_out_work_ends_like_ctrl_c(
    words: tuple[str, ...], work: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Else its processes are left alone, and warn of what they leak when they end."""
    if threading.current_thread() is not threading.main_thread():
        pytest.skip("signals come to the main thread only")
    monkeypatch.chdir(tmp_path)
    before = signal.signal(signal.SIGTERM, lambda *_: pytest.fail("not ended"))
    monkeypatch.setattr(work, lambda *_: signal.raise_signal(signal.SIGTERM))
    try:
        assert main(words) == INTERRUPTED
    finally:
        signal.signal(signal.SIGTERM, before)


def test_a_batch_system_ends_a_diagnosis_in_words(tmp_path: Path) -> None:
    (tmp_path / "m.py").write_text(GOOD, encoding="utf-8")
    t = np.arange(6000) * 2e-3
    rng = np.random.default_rng(1)
    rows = np.column_stack([t, np.sin(9.0 * t) + np.sin(40 * t), 1e-3 * rng.standard_normal(6000)])
    head = "t [s],F [N],x [m]"
    np.savetxt(tmp_path / "r.csv", rows, delimiter=",", header=head, comments="")
    words = ["diagnose", "r.csv", "--model", "m.py", "--out", "out", "--jobs", "2"]
    running = subprocess.Popen(
        [sys.executable, "-m", "bondsight", *words], cwd=tmp_path, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )  # fmt: skip
    patience = time.monotonic() + 120
    while not (tmp_path / "out").exists() and time.monotonic() < patience:
        time.sleep(0.1)  # the folder is made when the search begins
    time.sleep(1.0)
    running.terminate()
    _, said = running.communicate(timeout=120)
    assert running.returncode in (0, 130), said  # 0 where all was found by then
    if running.returncode:
        assert re.search(r"bondsight: .*(stopped|nothing was written)", said)
    assert "resource_tracker" not in said
    assert "Traceback" not in said
