"""Write the score of a trial: Markdown, JSON, a table of every recording, figures."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import Any

from bondgraph.support.whole_file import write_atomically
from tests.proof.trial.figures import figures
from tests.proof.trial.scoring import Score, plain, rows
from tests.proof.trial.summary import summary


def publish(score: Score, commitment: Mapping[str, Any], folder: Path) -> Path:
    """Write everything into `folder`; returns the path of ``RESULTS.md``."""
    made = rows(score)
    text = StringIO()
    if made:
        writer = csv.DictWriter(text, list(made[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(made)
    write_atomically(folder / "trials.csv", text.getvalue())
    write_atomically(folder / "score.json", json.dumps(plain(score), indent=1) + "\n")
    for name, svg in figures(score).items():
        write_atomically(folder / name, svg)
    target = folder / "RESULTS.md"
    write_atomically(target, summary(score, commitment))
    return target
