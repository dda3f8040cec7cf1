"""Bouc-Wen oscillator, SIMULATED, as a linear resonator: truth known, no proof on real devices."""

from __future__ import annotations

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.signals.recording import Recording
from identification.datasets import LoadedRecording
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import boundary_split

__all__ = ["CASES", "linear_oscillator"]

PERIOD = 8192


def linear_oscillator() -> BondGraph:
    """Return ``m x'' + c x' + k x = F``: command ``F`` (N), reading ``x`` (m)."""
    with BondGraph("linear_oscillator") as g:
        body = One("body")
        Se("F", unit="N") >> body
        body >> I("m", 2.0, unit="kg")
        body >> R("c", 10.0, unit="N*s/m")
        body >> C("k", stiffness=1e5, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def _prepared(multisine: Recording) -> LoadedRecording:
    kept = multisine.slice(0, PERIOD)
    rule = "of the first period, two thirds train, the last third judges"
    return LoadedRecording(kept, boundary_split(kept, 2 * PERIOD // 3, rule))


_WHY = "a hysteretic force with a state of its own, by the definition of the benchmark"

CASES = (
    RealCase(
        name="bouc_wen_simulated",
        label="simulated",
        dataset="bouc_wen",
        parts=("train/multisine",),
        prepare=_prepared,
        model=linear_oscillator,
        truth=(
            Truth("hysteresis", ("k",), _WHY),
            Truth("presliding_friction", ("c",), f"{_WHY}; it yields as a contact does"),
        ),
        kinds=("memory",),
        comment="simulated by the integrator of the benchmark, with noise: no real device",
    ),
)  # fmt: skip
