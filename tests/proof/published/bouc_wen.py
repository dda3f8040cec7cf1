"""Bouc-Wen oscillator (simulated): fitted to a multisine, judged on both noise-free tests."""

from __future__ import annotations

from typing import Any

from bondgraph.signals.recording import Recording
from identification.datasets.public_set import Protocol
from identification.estimation import Estimation
from tests.proof.published.models.bouc_wen import bouc_wen
from tests.proof.published.outcome import Compared, Outcome, Reached, split_hash
from tests.proof.published.staging import Progress, channels, free_run_error, scaled, settled, stage

TARGET = 7.5e-6
"""Largest error on either test, m."""

BETA = 1e3
"""The benchmark's beta; only its products with gamma and delta can be seen."""

PUBLISHED = {
    "m": ("m", 2.0, "kg"),
    "c": ("c", 10.0, "N*s/m"),
    "slope_h": ("k", 5e4, "N/m"),
    "growth_h": ("alpha", 5e4, "N/m"),
    "beta_h": ("gamma", 0.8, "1"),
    "gamma_h": ("delta", -1.1, "1"),
}
"""Names of the model -> name, value and unit of the benchmark."""

FIRST = 3000  # samples of the first stage
PERIOD = 8192


def fit(train: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit six parameters from rest; the force has no offset, nor has the reading."""
    graph = bouc_wen()
    names = tuple(PUBLISHED)
    options: dict[str, Any] = {
        "hold": "band-limited",
        "n_sub": 8,
        "initial": {"p_m": 0.0, "q_h": 0.0},
    }
    first = train.slice(0, min(FIRST, train.n))
    made = stage(graph, [first], names, progress=scaled(progress, 0.0, 0.3), **options)
    return stage(graph, [train], names, made.values, progress=scaled(progress, 0.3, 0.9), **options)


def run(parts: Protocol, share: float, progress: Progress | None) -> Outcome:
    """Run the protocol; parameters as `tests.proof.published.catalogue.run_protocol`."""
    train = parts.train[0].slice(0, round(share * parts.train[0].n))
    made = fit(train, progress=progress)
    tests = parts.tests
    twice = settled(tests["multisine"])
    errors = (
        Reached("multisine", free_run_error(made, twice, "x", skip=PERIOD), "m", TARGET),
        Reached("sinesweep", free_run_error(made, tests["sinesweep"], "x"), "m", TARGET),
    )
    scale = {"beta_h": BETA, "gamma_h": BETA}
    compared = tuple(
        Compared(n, made.values[own] / scale.get(own, 1.0), unit, value)
        for own, (n, value, unit) in PUBLISHED.items()
    )
    return Outcome(
        "bouc_wen", parts.about.title, bool(parts.official) and share == 1.0,
        "train: five periods of a multisine with noise, from rest; test: one settled period of "
        "another (the second pass of its repetition is scored) and a sweep from rest",
        split_hash(("train", channels(train)), *(("test", channels(r)) for r in tests.values())),
        0, errors, compared, values=made.values,
        notes=(
            f"simulated data; beta = {BETA:g} is not identifiable and is set",
            "published (table of Iacob et al.): best of state-space networks 7.53e-6 m",
        ),
    )  # fmt: skip
