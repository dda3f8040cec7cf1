"""Draw an exam, make its recordings, list what the tool may know of each."""

from __future__ import annotations

from hardware.simulators.generator.making_exam import exam_record
from tests.proof.exam.cells import draw_exam
from tests.proof.trial.generating import Progress, make_all
from tests.proof.trial.layout import Layout


def generate_exam(
    layout: Layout,
    *,
    count: int,
    seed: int = 0,
    jobs: int = -1,
    progress: Progress | None = None,
) -> int:
    """Draw and make an exam; recordings that are there are kept. Returns how many it has."""
    cases = draw_exam(seed, count)
    make_all(cases, layout, exam_record, jobs, progress)
    return len(cases)
