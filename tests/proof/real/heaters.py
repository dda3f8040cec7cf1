"""Two heaters on a board as two heat stores with linear losses and a linear path between."""

from __future__ import annotations

from collections.abc import Callable

from bondgraph import TF, BondGraph, C, De, One, R, Sf, Zero
from bondgraph.signals.recording import Recording
from identification.datasets import LoadedRecording
from identification.datasets.public_set import changed
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import boundary_split

__all__ = ["CASES", "two_heaters"]

ROOM = 23.0
"""C; where the collapsing loop ends. That of each record shows as an offset of the readings."""


def two_heaters() -> BondGraph:
    """Return two heaters: shares of power ``Q1``, ``Q2``, readings ``T1``, ``T2`` above the room.

    ``C T1' = a_1 Q1 - T1 / R_1 - (T1 - T2) / R_12`` and the same for 2, with the course values of
    the device: 4 g of 500 J/(kg K), 12 cm2 with 10 W/(m2 K), 1 and 0.75 W. Flows are heat, efforts
    temperatures. The heat capacities are weighed: only ratios to them show.
    """
    with BondGraph("two_heaters") as g:
        stores = []
        for i, power in (("1", 1.0), ("2", 0.75)):
            watts = g.parameter(f"a_{i}", power, "W")
            heater = Zero(f"heater_{i}")
            Sf(f"Q{i}", unit="1") >> TF(f"power_{i}", ratio=watts) >> heater
            heater >> C(f"C_{i}", 2.0, unit="J/K", fixed=True)
            heater >> R(f"R_{i}", 83.0, unit="K/W")
            heater >> De(f"T{i}", unit="K")
            stores.append(heater)
        between = One("between")
        stores[0] >> between >> stores[1]
        between >> R("R_12", 200.0, unit="K/W")
    return g


def _prepared(stop: int | None, boundary: int, rule: str) -> Callable[[Recording], LoadedRecording]:
    def prepared(read: Recording) -> LoadedRecording:
        kept = read.slice(0, stop)
        channels = {k: v - ROOM if k[0] == "T" else v for k, v in kept.channels.items()}
        made = changed(kept, channels, kept.units, f"temperatures count from {ROOM:g} C")
        return LoadedRecording(made, boundary_split(made, boundary, rule))

    return prepared


_LAG = "the sensor is a part of its own, glued to the heater: 23 to 46 s"
_LAGS = (
    Truth("sensor_lag", ("T1", "T2"), _LAG),
    Truth("low_pass", ("Q1", "Q2"), f"{_LAG}; a lag before or behind a heater looks the same"),
)
_RADIATION = (
    Truth("nonlinear_resistance", ("R_1", "R_2", "R_12"), "radiation, also between the heaters"),
)
_WANDERS = "0.45 K of the same slow course in both readings: the room, the theme of the paper"
_ROOM = (
    Truth("external_disturbance", ("C_1", "C_2"), _WANDERS),
    Truth("sensor_drift", ("T1", "T2"), f"{_WANDERS}; slower than the heaters, it moves readings"),
)
_LAG_KINDS = ("sensing", "slow", "command")


def _case(
    name: str,
    part: str,
    prepare: Callable[[Recording], LoadedRecording],
    truth: tuple[Truth, ...],
    kinds: tuple[str, ...],
    comment: str,
) -> RealCase:
    return RealCase(
        name=f"heaters_{name}", dataset="tclab", parts=(part,), prepare=prepare,
        model=two_heaters, truth=truth, kinds=kinds, comment=comment,
    )  # fmt: skip


_THIRDS = _prepared(None, 3400, "the first two thirds train, the last third judges")

CASES = (
    _case(
        "setpoints", "train/closed_loop_setpoints", _THIRDS, (*_LAGS, *_RADIATION),
        (*_LAG_KINDS, "dissipative"),
        "steps of 5 K in closed loop, commands as recorded; too narrow for radiation to show",
    ),
    _case(
        "collapse", "test/closed_loop_collapse",
        _prepared(
            3000, 2000,
            "of the 3000 s before it rests, the first 2000 s train, the rest, cooling down, judges",
        ),
        (*_LAGS, *_RADIATION), (*_LAG_KINDS, "dissipative"),
        "60 C down to 25 C: wide enough for radiation",
    ),
    _case(
        "open_loop", "train/open_loop_prbs", _THIRDS, (*_LAGS, *_RADIATION, *_ROOM),
        (*_LAG_KINDS, "dissipative", "exogenous"),
        "what remains beside the lag is the room; one outlier of -5.6 K in T1 at 1789 s",
    ),
)  # fmt: skip
