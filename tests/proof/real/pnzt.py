"""PNZT ceramic disc as a linear capacitor, and as a linear piezo actuator."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from actuators.stack.bond_graph import stack_bond_graph
from bondgraph import BondGraph, C, Dq, One, R, Se
from bondgraph.signals.recording import Recording
from identification.datasets import LoadedRecording
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import boundary_split

__all__ = ["CASES", "linear_capacitor", "linear_disc"]

THICKNESS = 0.8e-3
"""m; of the disc, from the headers of its files."""


def linear_disc() -> BondGraph:
    """Return the linear piezo stack with the numbers of the disc: ``V_in`` to ``x``.

    60 mm2 by 0.8 mm of soft ceramic: 1.6 nF, 0.4 nm/V, 60 GPa. Resonance and electrical time
    constant lie far above the sampling.
    """
    stack = stack_bond_graph(
        capacitance=1.6e-9, transducer=0.25, stiffness=4.5e9, mass=1.2e-4, damping=15.0,
        resistance=1e3, length=THICKNESS,
    )  # fmt: skip
    return stack.with_element("V_in", measured=True)


def linear_capacitor() -> BondGraph:
    """Return ``P = C V`` for each area: measured ``V_in`` (V), reading ``P`` (C/m2).

    27 uF/m2 is the small-signal polarisation of the disc; the amplifier charges it through a
    resistance that makes 1 ms, far below what the records resolve, and is not fitted.
    """
    with BondGraph("linear_capacitor") as g:
        disc = One("disc")
        Se("V_in", unit="V", measured=True) >> disc
        disc >> R("R_e", 37.0, unit="ohm*m2", fixed=True)
        disc >> C("C_p", 2.7e-5, unit="F/m2")
        disc >> Dq("P", unit="C/m2")
    return g


def _prepared(channel: str, boundary: int, rule: str, read: Recording) -> LoadedRecording:
    read = read.select({"V_in": "V", channel: channel})
    return LoadedRecording(read, boundary_split(read, boundary, rule))


_LOOP = ("loop01_0p1Hz_1400V", 267, "the first two thirds of the loop train, the last judges")
_HOLDS = (
    "record2_60s", 2204, "the first three holds train; the fourth hold and the rest after it judge",
)  # fmt: skip
_DISC = ("V_in", "R_e", "T_1", "C_nl", "T_2", "k", "R_nl", "m", "x")
_CAPACITOR = ("V_in", "R_e", "C_p", "P")
_SWITCHING = "polarisation switches: loops with memory, and rates from 0.01 to 1 Hz change them"
_DELAYED = "hundreds of nm per decade of time while the voltage is held"
_BUTTERFLY = Truth(
    "nonlinear_ratio", ("T_1", "T_2"), "switching reverses the sign of the piezo coefficient"
)


def _case(name: str, record: tuple[str, int, str], channel: str, comment: str) -> RealCase:
    part, boundary, rule = record
    disc = channel == "x"
    model: Callable[[], BondGraph] = linear_disc if disc else linear_capacitor
    places = _DISC if disc else _CAPACITOR
    truth = [Truth("hysteresis", places, _SWITCHING), Truth("creep", places, _DELAYED)]
    return RealCase(
        name=name,
        dataset="pnzt_creep",
        parts=(f"test/{part}",),
        prepare=partial(_prepared, channel, boundary, rule),
        model=model,
        truth=(*truth, _BUTTERFLY) if disc else tuple(truth),
        kinds=("memory", "slow", "ratio") if disc else ("memory", "slow"),
        comment=comment,
    )


CASES = (
    _case(
        "pnzt_loop_displacement", _LOOP, "x",
        "one butterfly loop of 401 samples: a monotone hysteresis cannot give it, so unknown in "
        "the family of memory is honest",
    ),
    _case("pnzt_loop_polarisation", _LOOP, "P", "one ferroelectric loop of 401 samples"),
    _case(
        "pnzt_holds_displacement", _HOLDS, "x",
        "switching and creep at once; the amplifier rests at 72 V",
    ),
    _case("pnzt_holds_polarisation", _HOLDS, "P", "switching and creep at once"),
)  # fmt: skip
