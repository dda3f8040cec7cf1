"""The seal of a trial: what is hashed before the run and checked after it.

Committed are the hash of the salted truths, the hash of every data file, the commit of the tool,
its sources, thresholds and options; and, apart from them, the proof's own sources and its design.
The salt stays in the sealed folder until the answers are in; without it the hash says nothing about
the truths, with it anybody can check that they were not changed. Where it is published before, so
that another machine can go on, only the committed tool is a seal: a line of ``NOTE.md`` beside the
commitment says since when, and the score repeats it.
"""

from __future__ import annotations

import hashlib
import json
import secrets
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput
from bondgraph.support.whole_file import write_atomically
from hardware.simulators.judging.truths import ExamTruth, truth_of
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.proof.trial.layout import Layout
from tests.proof.trial.truths import canonical

SCHEMA = "bondsight.commitment/2"
PACKAGES = ("bondsight", "bondgraph", "actuators", "identification", "hardware")
JUDGES = ("hardware/simulators/generator", "hardware/simulators/judging")
"""Folders of the packages that the diagnosis never loads: they belong to the proof."""
PROOF = ("tests/proof/trial", "tests/proof/exam", *JUDGES)
"""Folders of the proof itself: generator, run and score."""
DESIGN = Path(__file__).with_name("DESIGN.md")
HELD = ("trial", "quick")
"""Kinds that hold the tool to its sources, thresholds and options."""
WORDS = {
    "thresholds": "the thresholds",
    "options": "the options",
    "source_sha256": "the tool's sources",
}


def truths_hash(salt: str, truths: Sequence[Mapping[str, Any]]) -> str:
    """SHA-256 of the salt followed by the truths in canonical JSON.

    Examples
    --------
    >>> truths_hash("ab", [{"id": "r1"}]) == truths_hash("ab", [dict(id="r1")])
    True
    """
    return hashlib.sha256((salt + canonical(list(truths))).encode("ascii")).hexdigest()


def file_hash(path: Path) -> str:
    """SHA-256 of the bytes of a file."""
    with path.open("rb") as f:
        return hashlib.file_digest(f, "sha256").hexdigest()


def data_hashes(layout: Layout) -> dict[str, str]:
    """Hash of the public list and of every recording, by file name."""
    files = [layout.public, *sorted(layout.recordings.glob("*.npz"))]
    return {f.name: file_hash(f) for f in files}


def tool_commit() -> str:
    """Git commit of this source tree; ``+changed`` if files differ, ``unknown`` without git."""
    root = Path(__file__).resolve().parents[3]

    def git(*words: str) -> str | None:
        try:
            done = subprocess.run(
                ["git", *words], cwd=root, capture_output=True, text=True, timeout=30, check=True
            )
        except (OSError, subprocess.SubprocessError):
            return None
        return done.stdout.strip()

    head, changed = git("rev-parse", "HEAD"), git("status", "--porcelain", "--untracked-files=no")
    if head is None:
        return "unknown"
    return head + ("+changed" if changed else "")


def source_hash(folders: Sequence[str] = PACKAGES) -> str:
    """SHA-256 of the tool's sources: every Python and C file of its packages, by path.

    What lies in `JUDGES` counts only where it is asked for.

    The commit that holds a commitment cannot be named in it; the sources can.

    Parameters
    ----------
    folders : sequence of str
        Other ones than the tool's, such as `PROOF`.
    """
    root, found = Path(__file__).resolve().parents[3], hashlib.sha256()
    files = [
        f
        for name in folders
        for end in ("*.py", "*.c", "*.h")
        for f in root.glob(f"{name}/**/{end}")
        if name in JUDGES or not any(f.is_relative_to(root / j) for j in JUDGES)
    ]
    for file in sorted(files):
        found.update(f"{file.relative_to(root).as_posix()}\n{file_hash(file)}\n".encode())
    return found.hexdigest()


def commit(
    layout: Layout,
    truths: Sequence[Mapping[str, Any]],
    salt: str | None = None,
    kind: str = "trial",
) -> Path:
    """Seal the truths and write ``commitment.json``; returns its path.

    Parameters
    ----------
    truths : sequence of mapping
        Plain data, one a recording.
    salt : str, optional
        From the operating system if not given.
    kind : str
        One of `HELD` holds the tool to its sources, thresholds and options; others may be run
        while it is being developed.

    Raises
    ------
    UnusableInput
        The trial is committed already: a trial is drawn and run once.
    """
    if layout.commitment.exists():
        raise UnusableInput(
            f"{layout.commitment}: this trial is committed already; take another folder"
        )
    salt = secrets.token_hex(32) if salt is None else salt
    layout.truths.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(layout.truths, canonical(list(truths)) + "\n")
    write_atomically(layout.salt, salt + "\n")
    layout.salt.chmod(0o600)
    layout.truths.chmod(0o600)
    content = {
        "schema": SCHEMA,
        "kind": kind,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "truths_sha256": truths_hash(salt, truths),
        "recordings": len(truths),
        "data_sha256": data_hashes(layout),
        "tool_commit": tool_commit(),
        "proof_sha256": source_hash(PROOF),
        "design_sha256": file_hash(DESIGN) if DESIGN.is_file() else None,
        **settings(),
    }
    write_atomically(layout.commitment, json.dumps(content, indent=1) + "\n")
    return layout.commitment


def plain(data: Any) -> Any:
    """Return numbers, texts and lists; whatever else an option holds is written as its text."""
    if isinstance(data, Mapping):
        return {str(k): plain(v) for k, v in data.items()}
    if isinstance(data, list | tuple | set | frozenset):
        return [plain(v) for v in data]
    if data is None or isinstance(data, bool | int | float | str):
        return data
    return str(data)


def settings() -> dict[str, Any]:
    """Return what the tool is held to, by its name in a commitment; `WORDS` say it."""
    return {
        "thresholds": plain(asdict(Thresholds())),
        "options": plain(asdict(DiagnosisOptions())),
        "source_sha256": source_hash(),
    }


def verify(layout: Layout) -> None:
    """Check that the data are those of the commitment; of one of `HELD` also the tool.

    Raises
    ------
    UnusableInput
        One line that names what was changed.
    """
    content = read_commitment(layout)
    now = data_hashes(layout)
    then = content["data_sha256"]
    changed = sorted(n for n in then.keys() | now.keys() if then.get(n) != now.get(n))
    if changed:
        raise UnusableInput(
            f"{layout.folder}: {len(changed)} files differ from the commitment, first {changed[0]}"
        )
    if content["kind"] not in HELD:
        return
    for name, value in settings().items():
        if content[name] != value:
            raise UnusableInput(
                f"{layout.folder}: {WORDS[name]} differ from the commitment; a changed tool needs "
                "a new trial"
            )


def reveal(layout: Layout, *, complete: Sequence[str] | None = None) -> dict[str, ExamTruth]:
    """Open the seal, check the hash, publish truths and salt beside the answers.

    Parameters
    ----------
    complete : sequence of str, optional
        Ids that must have an answer before the seal may be opened; by default every recording.

    Raises
    ------
    UnusableInput
        Answers are missing, or the truths are not those that were committed.
    """
    content = read_commitment(layout)
    if layout.revealed.exists():
        opened = json.loads(layout.revealed.read_text(encoding="utf-8"))
        salt, rows = str(opened["salt"]), opened["truths"]
    else:
        if not layout.truths.exists() or not layout.salt.exists():
            raise UnusableInput(f"{layout.truths}: the sealed truths are not here")
        salt = layout.salt.read_text(encoding="ascii").strip()
        rows = json.loads(layout.truths.read_text(encoding="utf-8"))
    if truths_hash(salt, rows) != content["truths_sha256"]:
        raise UnusableInput(f"{layout.folder}: the truths are not those that were committed")
    wanted = [str(r["id"]) for r in rows] if complete is None else complete
    missing = [i for i in wanted if not (layout.answers / f"{i}.json").exists()]
    if missing:
        raise UnusableInput(
            f"{layout.folder}: {len(missing)} of {len(wanted)} recordings have no answer, first "
            f"{missing[0]}; run bondsight blind run before the seal is opened"
        )
    if not layout.revealed.exists():
        text = json.dumps({"salt": salt, "truths": rows}, indent=1)
        write_atomically(layout.revealed, text + "\n")
    return {t.id: t for t in map(truth_of, rows)}


def changed_since(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what of proof and tool is not as it was committed: the score says so."""
    now = {
        "the proof's sources": ("proof_sha256", source_hash(PROOF)),
        "the design": ("design_sha256", file_hash(DESIGN) if DESIGN.is_file() else None),
        **{WORDS[key]: (key, value) for key, value in settings().items()},
    }
    return tuple(what for what, (key, value) in now.items() if content.get(key) != value)


def with_note(layout: Layout) -> dict[str, Any]:
    """Read what was committed, and since when its salt is public, if a line says so."""
    told = layout.note.read_text(encoding="utf-8") if layout.note.is_file() else ""
    lines = [line.strip() for line in told.splitlines() if "salt" in line.casefold()]
    return read_commitment(layout) | {"salt_public": " ".join(lines)}


def read_commitment(layout: Layout) -> dict[str, Any]:
    """Read what was committed.

    Raises
    ------
    UnusableInput
        Nothing was.
    """
    path = layout.commitment
    if not path.is_file():
        raise UnusableInput(f"{path}: the trial is not committed; run bondsight blind generate")
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content
