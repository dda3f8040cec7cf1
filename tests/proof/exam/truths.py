"""What was concealed in the recordings of an exam, read from its file."""

from __future__ import annotations

import json
from pathlib import Path

from bondgraph.support.errors import UnusableInput
from hardware.simulators.judging.truths import ExamTruth, truth_of


def read_exam_truths(path: Path) -> dict[str, ExamTruth]:
    """Read the truths of an exam by the id of their recording.

    Raises
    ------
    UnusableInput
        The file is missing or holds no truths of an exam.
    """
    if not path.is_file():
        raise UnusableInput(f"{path}: no exam here; run python -m tests.proof.exam generate first")
    try:
        found = [truth_of(row) for row in json.loads(path.read_text(encoding="utf-8"))]
    except (KeyError, TypeError, ValueError) as error:
        raise UnusableInput(f"{path}: no truths of an exam ({error!r})") from None
    return {t.id: t for t in found}
