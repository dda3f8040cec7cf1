"""Silverbox: official parts, free-run simulation of multisine and arrow."""

from __future__ import annotations

from typing import Any

from bondgraph.signals.recording import Recording
from identification.datasets.public_set import Protocol
from identification.estimation import Estimation, Nuisances
from tests.proof.published.models.silverbox import silverbox
from tests.proof.published.outcome import Outcome, Reached, split_hash
from tests.proof.published.staging import Progress, channels, free_run_error, scaled, stage

TARGETS = {"multisine": 0.30, "arrow_full": 0.40, "arrow_no_extrapolation": 0.27}
"""Largest errors, mV."""

LINEAR = ("m", "d", "k")
BENT = ("a_2_N", "a_3_N", "tau")
FIRST = 9000  # samples of the first stages
OPTIONS: dict[str, Any] = {
    "hold": "band-limited",
    "n_sub": 8,
    "skip": 300,  # samples in which the transient of the start dies out
    "nuisances": Nuisances(lags=False),
}


def fit(train: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit six parameters and the reading's offset: linear, then bent, then on all samples."""
    graph, first = silverbox(), train.slice(0, min(FIRST, train.n))
    made = fit_linear(first, progress=scaled(progress, 0.0, 0.1))
    for record, part in ((first, (0.1, 0.4)), (train, (0.4, 1.0))):
        made = stage(
            graph, [record], (*LINEAR, *BENT), made.values, progress=scaled(progress, *part),
            **OPTIONS,
        )  # fmt: skip
    return made


def fit_linear(train: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit mass, damping, stiffness and the reading's offset without the bent feedback."""
    straight = dict.fromkeys(BENT, 0.0)
    return stage(silverbox(), [train], LINEAR, straight, progress=progress, **OPTIONS)


def run(parts: Protocol, share: float, progress: Progress | None) -> Outcome:
    """Run the protocol; parameters as `tests.proof.published.catalogue.run_protocol`."""
    train = parts.train[0].slice(0, round(share * parts.train[0].n))
    init, tests = parts.init, parts.tests
    made = fit(train, progress=scaled(progress, 0.0, 0.8))
    linear = fit_linear(train, progress=scaled(progress, 0.8, 0.95))

    def error(result: Estimation, test: Recording) -> float:
        return 1e3 * free_run_error(result, test, "y", state=init, skip=init)

    errors = [Reached(n, error(made, r), "mV", TARGETS[n]) for n, r in tests.items()]
    errors += [Reached(f"{n}, linear", error(linear, r), "mV") for n, r in tests.items()]
    return Outcome(
        "silverbox", parts.about.title, bool(parts.official) and share == 1.0,
        "train: first 75 % of the multisines; test: their last 25 %, the arrow, the arrow's first "
        "32000 samples; the initial state of a test is fitted to its init samples",
        split_hash(("train", channels(train)), *(("test", channels(r)) for r in tests.values())),
        init, tuple(errors), values=made.values,
        notes=(
            f"{len(made.free)} parameters, band-limited input",
            "published (third-party tables): linear 6.96 / 14.4 / 6.58, DT-SUBNET (Beintema 2021) "
            "0.36 / 1.4 / 0.32, GP-NARX 0.301 / 0.60 / 0.259 mV",
            "the form of the damping is known from earlier work on this record, tests included",
        ),
    )  # fmt: skip
