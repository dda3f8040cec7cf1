"""The front door among strangers: other packages called tests, threads, terminals, wrong names."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import bondsight
from bondgraph.support import lazy
from bondsight.cli.main import main

ROOT = Path(bondsight.__file__).resolve().parents[1]
THREADS = """
import sys, threading
sys.setswitchinterval(1e-6)
import bondsight
from bondsight.cli.main import main
names = bondsight.__all__[:]
wrong, gate = [], threading.Barrier(len(names))
def ask(name):
    gate.wait()
    try:
        getattr(bondsight, name)
    except BaseException as error:
        wrong.append(f"{name}: {error!r}")
asked = [threading.Thread(target=ask, args=(name,)) for name in names]
[t.start() for t in asked]
[t.join() for t in asked]
print(wrong)
"""


def run(arguments: list[str], folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **variables},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("words", [("effects", "backlash"), ("conformance", "--help")])
def test_a_package_tests_of_the_user_is_not_taken_for_ours(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "__init__.py").write_text("")
    done = run(["-m", "bondsight", *words], tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


def test_another_package_tests_in_use_is_said(tmp_path: Path) -> None:
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "__init__.py").write_text("")
    program = "import sys, tests; from bondsight.cli.main import main; sys.exit(main(['blind']))"
    done = run(["-c", program], tmp_path)
    assert done.returncode == 2
    assert "another package called tests" in done.stderr
    assert done.stderr.count("\n") == 1


def test_many_threads_may_ask_at_once(tmp_path: Path) -> None:
    assert run(["-c", THREADS], tmp_path).stdout.strip() == "[]"


def test_a_library_that_stumbles_over_another_import_is_asked_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[str] = []

    def stumbling(name: str) -> object:
        asked.append(name)
        if len(asked) == 1:
            raise RuntimeError("dictionary changed size during iteration")
        return name

    monkeypatch.setattr(lazy, "import_module", stumbling)
    found: object = lazy._loaded("plain")
    assert found == "plain"
    assert asked == ["plain", "plain"]


def test_a_terminal_without_greek_ends_nothing(tmp_path: Path) -> None:
    program = "from bondsight.cli.main import main; main(['effects', 'creep']); print('\u03bc')"
    done = run(["-c", program], tmp_path, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stdout[-2:]) == (0, "?\n")


def test_a_wrong_name_gets_the_nearest() -> None:
    with pytest.raises(AttributeError, match="Did you mean 'diagnose'"):
        getattr(bondsight, "diagnos")  # noqa: B009
    assert "attach" not in dir(bondsight)


def test_without_a_verb_the_help_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    said = capsys.readouterr().out
    assert all(
        verb in said for verb in ("diagnose", "blind", "conformance", "coverage", "published")
    )
