"""Wiener-Hammerstein circuit: official parts, free-run simulation of the last 78,800 samples."""

from __future__ import annotations

from typing import Any

from bondgraph.signals.recording import Recording
from identification.datasets.public_set import Protocol
from identification.estimation import Estimation, Nuisances
from tests.proof.published.models.wiener_hammerstein import wiener_hammerstein
from tests.proof.published.outcome import Outcome, Reached, split_hash
from tests.proof.published.staging import Progress, channels, free_run_error, scaled, stage

TARGET = 0.30
"""Largest error, mV."""

FIRST = 12_000  # samples of the first stage
NO_DIODE = 1e3  # V; a knee that no signal reaches
DIODE = ("V_k_D", "V_T_D", "R_d_D")
OPTIONS: dict[str, Any] = {
    "hold": "band-limited",
    "n_sub": 4,
    "skip": 200,  # samples in which the transient of the start dies out
    "nuisances": Nuisances(lags=False),
}


def fit(train: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit both filters, the diode network and the reading's offset at once, from ideal filters."""
    graph = wiener_hammerstein()
    names = tuple(n for n, p in graph.parameters.items() if not p.fixed)
    first = train.slice(0, min(FIRST, train.n))
    made = stage(graph, [first], names, progress=scaled(progress, 0.0, 0.2), **OPTIONS)
    return stage(graph, [train], names, made.values, progress=scaled(progress, 0.2, 1.0), **OPTIONS)


def fit_linear(train: Recording, *, progress: Progress | None = None) -> Estimation:
    """Fit the same filters without the diode; its leak resistor carries the gain."""
    graph = wiener_hammerstein()
    names = tuple(n for n, p in graph.parameters.items() if not p.fixed and n not in DIODE)
    return stage(graph, [train], names, {DIODE[0]: NO_DIODE}, progress=progress, **OPTIONS)


def run(parts: Protocol, share: float, progress: Progress | None) -> Outcome:
    """Run the protocol; parameters as `tests.proof.published.catalogue.run_protocol`."""
    train = parts.train[0].slice(0, round(share * parts.train[0].n))
    (test,), init = parts.tests.values(), parts.init
    made = fit(train, progress=scaled(progress, 0.0, 0.7))
    # a linear model gains nothing from more samples: its error is not noise
    linear = fit_linear(
        train.slice(0, min(2 * FIRST, train.n)), progress=scaled(progress, 0.7, 0.9)
    )
    error, without = (
        1e3 * free_run_error(m, test, "y", state=init, skip=init) for m in (made, linear)
    )
    return Outcome(
        "wiener_hammerstein", parts.about.title, bool(parts.official) and share == 1.0,
        "train: samples 5200 to 105199; test: 105200 to 183999, its initial state fitted to its "
        "init samples",
        split_hash(("train", channels(train)), ("test", channels(test))),
        init,
        (
            Reached("last 78,800 samples", error, "mV", TARGET),
            Reached("last 78,800 samples, linear", without, "mV"),
        ),
        values=made.values,
        notes=(
            f"{len(made.free)} parameters, band-limited input",
            "published (third-party tables): linear 43.4 mV, DT-SUBNET (Beintema 2021) 0.241 mV",
        ),
    )  # fmt: skip
