"""The trial that was published: its seal holds, and its count is that of its score."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from bondgraph.support.errors import UnusableInput
from tests.proof.trial.opened import PUBLISHED, lines, opened


def test_the_published_answers_give_the_published_count() -> None:
    said = "\n".join(lines(opened(PUBLISHED)))
    score = (PUBLISHED / "RESULTS.md").read_text(encoding="utf-8")
    for what in ("wrong names", "wrong places"):
        (count,) = re.findall(rf"\| {what}, of the \w+ given \| (\d+/\d+) ", score)[:1]
        assert f"{what}: {count} " in said


def test_truths_that_were_touched_are_refused(tmp_path: Path) -> None:
    for name in ("truths.json.gz", "commitment.json", "answers.jsonl.gz"):
        shutil.copy(PUBLISHED / name, tmp_path)
    (tmp_path / "salt.txt").write_text("another", encoding="utf-8")
    with pytest.raises(UnusableInput, match="not the truths that were committed"):
        opened(tmp_path)
