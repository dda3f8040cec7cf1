"""What the tool said about the recordings of an exam or a trial, read from their files."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from bondgraph.support.errors import UnusableInput
from hardware.simulators.judging.claims import ExamAnswer, exam_answer_of

Kept = TypeVar("Kept")


def read_exam_answers(folder: Path) -> dict[str, ExamAnswer]:
    """Read every answer of a folder by the id of its recording.

    Raises
    ------
    UnusableInput
        The folder is missing or a file is damaged.
    """
    if not folder.is_dir():
        raise UnusableInput(f"{folder}: no answers here; run python -m tests.proof.exam run first")
    return read_each(folder, exam_answer_of)


def read_each(folder: Path, read: Callable[[Mapping[str, Any]], Kept]) -> dict[str, Kept]:
    """Read every file of a folder by the id that stands in it.

    Raises
    ------
    UnusableInput
        A file is damaged.
    """
    found = {}
    for path in sorted(folder.glob("*.json")):
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            found[str(content["id"])] = read(content)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise UnusableInput(f"{path}: no answer ({error!r}); remove it and run again") from None
    return found
