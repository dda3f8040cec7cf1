"""Run every command of ``commands.toml`` with one checkout and keep what it says.

    python tests/proof/unchanged/record.py --checkout . --out FOLDER

Goes on where it was stopped. Each command gets a folder of its own with ``result.json`` (command
lines, exit codes, seconds), the texts it printed, and the files it is told to keep: no recording,
no figure of a signal. Names of temporary folders, of the checkout and of the recordings are
replaced by words in braces.
"""

from __future__ import annotations

import argparse
import hashlib
import html.parser
import itertools
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from recipes import make  # type: ignore[import-not-found]

HERE = Path(__file__).resolve().parent
BROUGHT = ("models.py", "positioner.py", "script_simulate.py", "script_estimate.py",
           "script_diagnose.py")  # fmt: skip
RECORDINGS = "BONDSIGHT_RECORDINGS"


@dataclass(frozen=True)
class Command:
    """One entry of the list with its braces filled."""

    name: str
    run: tuple[tuple[str, ...], ...]
    make: tuple[str, ...]
    keep: tuple[str, ...]


@dataclass(frozen=True)
class Bench:
    """What runs the commands: an interpreter, a checkout, the module of the user interface."""

    python: str
    checkout: Path
    module: str
    vocabulary: Path
    timeout: float

    def line(self, words: Sequence[str]) -> list[str]:
        """Return the command line of one entry of `run`."""
        if words[0] == "python":
            return [self.python, *words[1:]]
        return [self.python, "-m", self.module, *words]

    def environment(self) -> dict[str, str]:
        """Return the environment: this checkout first, one thread, no new files beside it."""
        kept = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        return {
            **kept, **one, "PYTHONPATH": str(self.checkout), "PYTHONDONTWRITEBYTECODE": "1",
            "PYTHONHASHSEED": "0", "COLUMNS": "100", "TERM": "dumb", "NO_COLOR": "1",
            "MPLBACKEND": "agg",
        }  # fmt: skip


def commands(path: Path = HERE / "commands.toml") -> tuple[Command, ...]:
    """Return all commands of the list, sorted by name."""
    found = []
    for entry in tomllib.loads(path.read_text(encoding="utf-8"))["command"]:
        each = entry.get("each", {})
        for values in itertools.product(*each.values()):
            words = dict(zip(each, values, strict=True))
            found.append(
                Command(
                    _filled(entry["name"], words).replace(":", "_"),
                    tuple(tuple(_filled(w, words) for w in line) for line in entry["run"]),
                    tuple(_filled(n, words) for n in entry.get("make", ())),
                    tuple(entry.get("keep", ())),
                )
            )
    names = [c.name for c in found]
    if doubled := {n for n in names if names.count(n) > 1}:
        raise SystemExit(f"{path.name}: {', '.join(sorted(doubled))}: twice; give other names")
    return tuple(sorted(found, key=lambda c: c.name))


def _filled(text: str, words: Mapping[str, str]) -> str:
    for name, value in words.items():
        text = text.replace(f"{{{name}}}", value)
    return text


def record(command: Command, bench: Bench, out: Path) -> dict[str, Any]:
    """Run one command in a fresh folder; its results appear in `out` whole or not at all."""
    with tempfile.TemporaryDirectory(prefix="unchanged-") as fresh:
        folder = Path(fresh).resolve()
        for name in BROUGHT:
            shutil.copy(HERE / name, folder / name)
        shutil.copy(bench.vocabulary, folder / "vocabulary.py")
        inputs = {p.name: _digest(p) for p in (make(n, folder) for n in command.make)}
        half = out / f".{command.name}"
        shutil.rmtree(half, ignore_errors=True)
        half.mkdir(parents=True)
        hidden = _hidden(folder, bench)
        steps = [
            _step(k, line, bench, folder, half, hidden) for k, line in enumerate(command.run, 1)
        ]
        kept = _keep(command.keep, folder, half / "files", hidden)
    result = {
        "name": command.name,
        "inputs": inputs,
        "steps": steps,
        "kept": kept,
        "seconds": round(sum(s["seconds"] for s in steps), 2),
        "processor_seconds": round(sum(s["processor_seconds"] for s in steps), 2),
    }
    _write(half / "result.json", json.dumps(result, indent=1) + "\n")
    half.rename(out / command.name)
    return result


def _step(
    number: int, words: Sequence[str], bench: Bench, folder: Path, half: Path,
    hidden: Mapping[str, str],
) -> dict[str, Any]:  # fmt: skip
    recordings = os.environ.get(RECORDINGS, "")
    line = bench.line([w.replace("{recordings}", recordings) for w in words])
    begin, before = time.perf_counter(), _processor()
    try:
        done = subprocess.run(
            line, cwd=folder, env=bench.environment(), stdin=subprocess.DEVNULL,
            capture_output=True, timeout=bench.timeout, check=False,
        )  # fmt: skip
        code, printed, said = str(done.returncode), done.stdout, done.stderr
    except subprocess.TimeoutExpired as late:
        code, printed, said = "too late", late.stdout or b"", late.stderr or b""
    seconds = time.perf_counter() - begin
    used = _processor() - before
    for name, text in ((f"{number}.out.txt", printed), (f"{number}.err.txt", said)):
        _write(half / name, _replaced(text.decode("utf-8", "replace"), hidden))
    took = {"seconds": round(seconds, 2), "processor_seconds": round(used, 2)}
    return {"words": list(words), "exit": code, **took}


def _processor() -> float:
    """Return the processor time of all processes that have ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def _keep(
    patterns: Sequence[str], folder: Path, target: Path, hidden: Mapping[str, str]
) -> list[str]:
    files = sorted({p for pattern in patterns for p in folder.glob(pattern) if p.is_file()})
    for path in files:
        for name, data in _texts(path):
            place = target / path.relative_to(folder) / name if name else target / path.relative_to(
                folder
            )  # fmt: skip
            text = _text_of(place.name, data)
            _write(place, _replaced(text, hidden))
    return [p.relative_to(folder).as_posix() for p in files]


def _texts(path: Path) -> Iterator[tuple[str, bytes]]:
    """Yield the file, or the members of an archive, by name within it."""
    if not zipfile.is_zipfile(path):
        yield "", path.read_bytes()
        return
    with zipfile.ZipFile(path) as archive:
        for name in sorted(archive.namelist()):
            if not name.endswith("/"):
                yield name, archive.read(name)


def _text_of(name: str, data: bytes) -> str:
    """Return a text as it is, of a page its visible words, of anything else that it is there."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        return "(not a text)\n"
    if "\0" in text:
        return "(not a text)\n"
    return visible(text) if name.endswith(".html") else text


class _Visible(html.parser.HTMLParser):
    hidden = ("style", "script", "svg", "canvas")
    lines = ("p", "div", "li", "tr", "h1", "h2", "h3", "h4", "section", "table", "br", "summary")

    def __init__(self) -> None:
        super().__init__()
        self.depth = 0
        self.parts: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.depth += tag in self.hidden
        self.parts.append("\n" if tag in self.lines else " ")

    def handle_endtag(self, tag: str) -> None:
        self.depth -= tag in self.hidden
        self.parts.append("\n" if tag in self.lines else " ")

    def handle_data(self, data: str) -> None:
        if not self.depth:
            self.parts.append(data)


def visible(page: str) -> str:
    """Return the words of a page without styles and figures, a line for each block."""
    parser = _Visible()
    parser.feed(page)
    lines = (" ".join(line.split()) for line in "".join(parser.parts).splitlines())
    return "\n".join(line for line in lines if line) + "\n"


def _hidden(folder: Path, bench: Bench) -> dict[str, str]:
    """Return what stands for paths of this machine, longest path first."""
    paths = {
        str(folder): "{folder}",
        str(bench.checkout): "{checkout}",
        os.environ.get(RECORDINGS, ""): "{recordings}",
        bench.python: "{python}",
        str(Path.home()): "{home}",
    }
    return {p: paths[p] for p in sorted(paths, key=len, reverse=True) if len(p) > 1}


def _replaced(text: str, hidden: Mapping[str, str]) -> str:
    for path, word in hidden.items():
        text = text.replace(path, word)
    return text


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8", newline="\n")


def _require_checkout(bench: Bench) -> None:
    """Refuse to record another checkout than the one that is named."""
    code = f"import importlib.util as u; print(u.find_spec({bench.module!r}).origin)"
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [bench.python, "-c", code], cwd=folder, env=bench.environment(), capture_output=True,
            text=True, check=False,
        )  # fmt: skip
    origin = done.stdout.strip()
    if done.returncode or not Path(origin).is_relative_to(bench.checkout):
        found = origin or done.stderr.strip().splitlines()[-1]
        raise SystemExit(f"{bench.module} is not of {bench.checkout}: {found}; give --module")


def _about(bench: Bench, out: Path) -> None:
    head = subprocess.run(
        ["git", "-C", str(bench.checkout), "rev-parse", "HEAD"], capture_output=True, text=True,
        check=False,
    ).stdout.strip()  # fmt: skip
    about = {"commit": head, "module": bench.module}
    path = out / "about.json"
    if path.is_file() and json.loads(path.read_text(encoding="utf-8")) != about:
        raise SystemExit(f"{out} holds results of another commit or module; give another --out")
    _write(path, json.dumps(about, indent=1) + "\n")


def main() -> int:
    """Record; returns 1 if a command took too long."""
    p = argparse.ArgumentParser(description="keep what every command says, to compare it later")
    p.add_argument("--out", type=Path, required=True, help="folder of the results")
    p.add_argument("--checkout", type=Path, default=HERE.parents[2], help="default: this one")
    p.add_argument("--python", default=sys.executable, help="default: this one")
    p.add_argument("--module", default="bondsight")
    p.add_argument("--vocabulary", type=Path, default=HERE / "vocabulary.py",
                   help="names by import path, of that checkout")  # fmt: skip
    p.add_argument(
        "--only", nargs="+", default=(), metavar="NAME", help="names or their beginnings"
    )
    p.add_argument("--timeout", type=float, default=900.0, help="seconds for each command line")
    p.add_argument("--list", action="store_true", help="print the commands and run none")
    options = p.parse_args()
    chosen = [c for c in commands() if not options.only or c.name.startswith(tuple(options.only))]
    if options.list:
        for c in chosen:
            print(c.name, *(" ".join(line) for line in c.run), sep="\n    ")
        return 0
    if not Path(os.environ.get(RECORDINGS, "")).is_dir() or not os.environ.get(RECORDINGS):
        raise SystemExit(f"{RECORDINGS} is not a folder; set it to the folder of the recordings")
    out = options.out.resolve()
    bench = Bench(
        options.python, options.checkout.resolve(), options.module, options.vocabulary.resolve(),
        options.timeout,
    )  # fmt: skip
    _require_checkout(bench)
    _about(bench, out)
    late, total = 0, 0.0
    for k, command in enumerate(chosen, 1):
        if (out / command.name / "result.json").is_file():
            continue
        made = record(command, bench, out)
        codes = " ".join(s["exit"] for s in made["steps"])
        late += "too late" in codes
        total += made["processor_seconds"]
        lack = " KEPT NOTHING" if command.keep and not made["kept"] else ""
        print(
            f"{k:3d}/{len(chosen)} {command.name:40s} exit {codes:16s} {made['seconds']:6.1f} s, "
            f"processor {made['processor_seconds']:6.1f} s, sum {total:6.0f} s{lack}",
            flush=True,
        )
    print(f"{len(chosen)} commands recorded in {out}" + (f"; {late} too late" if late else ""))
    return int(late > 0)


if __name__ == "__main__":
    sys.exit(main())
