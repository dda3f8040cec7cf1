"""Small DC motor with a permanent magnet, linear, without inductance."""

from __future__ import annotations

from bondgraph import GY, BondGraph, Df, I, One, R, Se
from bondgraph.signals.recording import Recording
from identification.datasets import LoadedRecording
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import boundary_split

__all__ = ["CASES", "permanent_magnet_motor"]


def permanent_magnet_motor() -> BondGraph:
    """Return ``R_a i + K w = u``, ``J w' = K i - b w``: command ``u`` (V), reading ``w`` (rad/s).

    Gain and time constant are all that shows, so resistance and inertia, of the size of such
    motors, are gauges; start values make 200 rad/s to a volt and 0.1 s.
    """
    with BondGraph("permanent_magnet_motor") as g:
        winding, shaft = One("winding"), One("shaft")
        Se("u", unit="V") >> winding
        winding >> R("R_a", 10.0, unit="ohm", fixed=True)
        winding >> GY("K", ratio=2e-3, unit="V*s/rad") >> shaft
        shaft >> I("J", 1e-7, unit="kg*m2", fixed=True)
        shaft >> R("b", 6e-7, unit="N*m*s/rad")
        shaft >> Df("w", unit="rad/s")
    return g


def _prepared(read: Recording) -> LoadedRecording:
    kept = read.slice(0, read.n - 1)  # the drive is switched off in the last sample
    rule = "the first two thirds of the levels train, the last third judges"
    return LoadedRecording(kept, boundary_split(kept, kept.n - kept.n // 3, rule))


_DRY = "the firmware measures the least duty at which the motor turns"
_WARM = "the motor warms up over about 50 s"
_CONCAVE = "speed over voltage is concave; drag and a bent source are look-alikes in one speed"


def _case(part: str, comment: str) -> RealCase:
    board = part.rpartition("/")[2]
    return RealCase(
        name=f"dc_motor_{board}",
        dataset="motoshield",
        parts=(part,),
        prepare=_prepared,
        model=permanent_magnet_motor,
        truth=(
            Truth("coulomb_friction", ("b",), _DRY),
            Truth("stribeck_friction", ("b",), f"{_DRY}; contains dry friction"),
            Truth("dead_zone", ("u",), f"{_DRY}; above it only the offset of the voltage shows"),
            Truth("quadratic_drag", ("b",), _CONCAVE),
            Truth("saturation", ("u",), _CONCAVE),
            Truth("nonlinear_ratio", ("K",), _CONCAVE),
            Truth("time_varying_parameter", ("b", "R_a"), _WARM),
            Truth("self_heating", ("b", "R_a"), f"{_WARM}; what a warm resistor does"),
        ),
        kinds=("dissipative", "command", "ratio", "time", "slow"),
        comment=(
            f"{comment}; one speed cannot tell a bent source from a bent load, so a set of "
            "look-alikes is honest. The unit of the pulse counter is declared"
        ),
    )


CASES = (
    _case("train/board1", "14 pulses a turn: one count is 22 rad/s"),
    _case("test/board2", "28 pulses a turn: one count is 11 rad/s"),
)
