"""The repaired model of a diagnosis under the published protocol of its recording."""

from __future__ import annotations

from bondgraph.signals.recording import Split
from identification.datasets import protocol
from identification.diagnosis.diagnose import Diagnosis
from identification.estimation import estimate
from tests.proof.published.staging import free_run_error

__all__ = ["official_errors"]

SKIP = 300
"""Samples at the start of the training part in which the transient of the start dies out."""
STEPS = 30


def official_errors(
    found: Diagnosis, dataset: str, folder: str | None = None
) -> dict[str, dict[str, float]]:
    """Fit the repaired model to the published training part, and run it over the published tests.

    The diagnosis made structure and start values, from far fewer samples. The runs are free; the
    initial state of a test is fitted to its first samples, which do not count, by the protocol.

    Parameters
    ----------
    dataset : str
        In `identification.datasets.SETS`.
    folder : str, optional
        Of the recordings; that of the environment if not given.

    Returns
    -------
    dict of str to dict of str to float
        Root mean square error by sensor of each test, SI; nothing where nothing was repaired.
    """
    if found.repaired is None:
        return {}
    parts = protocol(dataset, folder)
    rule = f"all but the first {SKIP} samples train"
    splits = [Split(slice(SKIP, r.n), slice(r.n, r.n), rule) for r in parts.train]
    study = found.study.changed(
        recordings=parts.train, splits=splits, n_sub=found.repaired.problem.n_sub, noise="white"
    )
    made = estimate(study, max_iterations=STEPS)
    init = parts.init
    return {
        name: {s: free_run_error(made, r, s, state=init, skip=init) for s in made.sensors()}
        for name, r in parts.tests.items()
    }
