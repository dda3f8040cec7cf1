"""PNZT ceramic disc as a linear capacitor, and as a linear piezo: loops and holds used together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from bondgraph import TF, BondGraph, C, Dq, One, R, Se
from bondgraph.signals.recording import Recording, Split
from identification.datasets import LoadedRecording
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import apart, noted

__all__ = ["CASES", "linear_capacitor", "linear_disc"]


def linear_capacitor() -> BondGraph:
    """Return ``P = C V`` for each area: measured ``V_in`` (V), reading ``P`` (C/m2).

    27 uF/m2 is the small-signal polarisation of the disc (60 mm2 by 0.8 mm, from the headers of
    its files); the amplifier charges it through a resistance that makes 1 ms, far below what the
    records resolve, and is not fitted.
    """
    with BondGraph("linear_capacitor") as g:
        disc = One("disc")
        Se("V_in", unit="V", measured=True) >> disc
        disc >> R("R_e", 37.0, unit="ohm*m2", fixed=True)
        disc >> C("C_p", 2.7e-5, unit="F/m2")
        disc >> Dq("P", unit="C/m2")
    return g


def linear_disc() -> BondGraph:
    """Return the linear piezo ``x = T P`` of the same capacitor: reads ``P`` and ``x`` (m).

    The disc is free; soft ceramic gives 0.4 nm/V. Resonance lies far above the sampling, so that
    only a damper, in Pa s/m, takes the force of its face.
    """
    g = linear_capacitor()
    g = g.with_branch("disc", [TF("T_1", 1.5e-5, unit="m3/C"), One("face")])
    g = g.with_branch("face", [R("R_nl", 1.0, unit="Pa*s/m", fixed=True)])
    return g.with_branch("face", [Dq("x", unit="m")])


def _settled(loop: Recording) -> Recording:
    """Return a loop after a copy of itself: the analyser sends each loop a like pulse before it."""
    channels = {k: np.concatenate([v[:-1], v]) for k, v in loop.channels.items()}
    made = replace(
        loop, time=loop.dt * np.arange(2 * loop.n - 1, dtype=np.float64), channels=channels
    )
    return noted(made, "a copy of the loop settles what it remembers, and is not scored")


def _together(
    rule: str, names: Mapping[str, str], settling: bool, *records: Recording
) -> LoadedRecording:
    """Records of one rate, each from a state of its own; the last one judges."""
    kept = [_settled(r) if settling else r for r in records]
    whole, split = apart("pnzt", 1, rule, names)(*kept)
    if not settling:
        return LoadedRecording(whole, split)
    ends = (*whole.meta["breaks"], whole.n)
    *train, test = (slice(e - r.n, e) for e, r in zip(ends, records, strict=True))
    return LoadedRecording(whole, Split(tuple(train), (test,), rule, score_from=records[0].n - 1))


_LOOPS = (
    "loop03_1Hz_800V", "loop04_1Hz_1000V", "loop06_1Hz_1400V", "loop05_1Hz_1200V",
)  # fmt: skip
_HOLDS = ("record1_60s", "record2_60s")
_CAPACITOR = ("V_in", "R_e", "C_p", "P")
_DISC = (*_CAPACITOR, "T_1", "R_nl", "x")
_SWITCHING = "polarisation switches: loops with memory, and rates from 0.01 to 1 Hz change them"
_DELAYED = "hundreds of nm per decade of time while the voltage is held"
_BUTTERFLY = Truth(
    "nonlinear_ratio", ("T_1",), "switching reverses the sign of the piezo coefficient"
)
_DRIFT = "the integrated current falls by 0.3 uC/cm2 a second for 1350 s at rest"


def _case(name: str, disc: bool, comment: str) -> RealCase:
    loops = "loops" in name
    places = _DISC if disc else _CAPACITOR
    truth = [Truth("hysteresis", places, _SWITCHING), Truth("creep", places, _DELAYED)]
    truth += [_BUTTERFLY] if disc else []
    if not loops:
        truth += [Truth("sensor_drift", ("P",), _DRIFT), Truth("leakage", ("C_p",), _DRIFT)]
    rule = (
        "loops of 800, 1000 and 1400 V train, that of 1200 V judges"
        if loops
        else "holds of 2 s train, those of 10 s and the rest after them judge"
    )
    records = _LOOPS if loops else _HOLDS
    names = {"V_in": "V", "P": "P"} | ({"x": "x"} if disc else {})
    judged = ("record2_60s", *_LOOPS)
    return RealCase(
        name=name,
        dataset="pnzt_creep",
        parts=tuple(f"{'test' if r in judged else 'train'}/{r}" for r in records),
        prepare=partial(_together, rule, names, loops),
        model=linear_disc if disc else linear_capacitor,
        truth=tuple(truth),
        kinds=("memory", "slow", "ratio") if disc else ("memory", "slow"),
        comment=comment,
    )


CASES = (
    _case(
        "pnzt_loops_disc", True,
        "polarisation and displacement of one switching disc at 1 Hz: memory and a ratio at once",
    ),
    _case("pnzt_loops_polarisation", False, "four ferroelectric loops of 1 Hz, one of them judges"),
    _case(
        "pnzt_holds_disc", True,
        "switching, creep, a drifting integrator and a ratio at once; the amplifier rests at 72 V",
    ),
    _case("pnzt_holds_polarisation", False, "switching, creep and drift of the integrator at once"),
)  # fmt: skip
