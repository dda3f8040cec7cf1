"""Draw an exam, make its recordings, list what the tool may know of each."""

from __future__ import annotations

from joblib import Parallel, delayed

from tests.proof.exam.cells import draw_exam
from tests.proof.exam.making import exam_record
from tests.proof.trial.generating import Progress, write_public
from tests.proof.trial.generator.case import Case
from tests.proof.trial.generator.writing import generate
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
    made = Parallel(n_jobs=jobs, return_as="generator_unordered")(
        delayed(_make)(case, layout) for case in cases
    )
    for done, name in enumerate(made, start=1):
        if progress is not None:
            progress(f"recording {name}", done / len(cases))
    generate(cases, layout.data, make=exam_record)  # all are there: this only lists them
    write_public(layout, [case.id for case in cases])
    return len(cases)


def _make(case: Case, layout: Layout) -> str:
    # the list of truths that this call writes is written anew at the end
    generate([case], layout.data, make=exam_record)
    return case.id
