"""Recordings that the tool was diagnosed with while it was built: they prove less."""

from __future__ import annotations

from dataclasses import replace

from actuators.models.textbook import mass_with_viscous_friction, resonator, thermal_lag
from actuators.stack.bond_graph import stack_bond_graph
from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.split import whole
from identification.datasets import LoadedRecording
from tests.proof.real.case import Published, RealCase, Truth
from tests.proof.real.preparing import boundary_split, in_pieces, thinned

__all__ = ["CASES"]

BEFORE, AFTER = 12_000, 8_000
"""Samples of the Silverbox kept on both sides of its boundary."""
PIECE = 250
"""Samples of a stretch of the EMPS: 0.5 s."""


def _piezo(recording: Recording, split: Split) -> LoadedRecording:
    return _thinned(5, recording.select({"V_in": "V", "x": "x"}), split)


def _emps(recording: Recording, split: Split) -> LoadedRecording:
    """Nothing holds the carriage: what a free run of the whole record shows is its drift."""
    return in_pieces(thinned(recording, 2), PIECE)


def _silverbox(recording: Recording, split: Split) -> LoadedRecording:
    boundary = whole(split.test).start
    kept = recording.slice(boundary - BEFORE, boundary + AFTER)
    rule = f"the official boundary; {BEFORE} samples before it train, {AFTER} after it judge"
    return LoadedRecording(kept, boundary_split(kept, BEFORE, rule))


def _thinned(factor: int, recording: Recording, split: Split) -> LoadedRecording:
    """Thin a recording and move its split along."""

    def moved(part: slice) -> slice:
        return slice((part.start or 0) // factor, part.stop // factor)

    return LoadedRecording(
        thinned(recording, factor),
        replace(
            split, train=moved(whole(split.train)), test=moved(whole(split.test)),
            rest=None if split.rest is None else moved(split.rest),
            score_from=split.score_from // factor,
        ),
    )  # fmt: skip


_STACK = ("C_nl", "V_in", "R_e", "T_1", "T_2", "k", "m", "R_nl", "x")
_DEAD_TIME = "dead time of two to three samples"

CASES = (
    RealCase(
        name="piezo_sine",
        label="seen before",
        dataset="piezo_actuator",
        parts=("sine",),
        prepare=_piezo,
        model=stack_bond_graph,
        truth=(
            Truth(
                "hysteresis", _STACK,
                "plays leave 0.6 % of the swing, any static curve 13.5 %; one amplitude and one "
                "frequency do not show where",
            ),
        ),
        kinds=("memory",),
        published=Published(
            0.5, "% of range", "Prandtl-Ishlinskii or asymmetric Bouc-Wen operators, quasi-static",
            "order of magnitude for other actuators",
        ),
    ),
    RealCase(
        name="emps",
        label="seen before",
        dataset="emps",
        parts=("record",),
        prepare=_emps,
        model=mass_with_viscous_friction,
        truth=(
            Truth("coulomb_friction", ("F_v",), "Coulomb friction and a constant offset"),
            Truth("stribeck_friction", ("F_v",), "contains Coulomb friction"),
        ),
        kinds=("dissipative",),
        published=Published(
            0.452, "mm", "dynoNet; linear models 5.53 mm",
            "other record (pulses), free run instead of stretches of 0.5 s",
        ),
        comment=(
            "the offset of the force is a nuisance; closed loop, and nothing holds the carriage: "
            "stretches of 0.5 s, each from a state of its own, are compared"
        ),
    ),
    RealCase(
        name="silverbox",
        label="seen before",
        dataset="silverbox",
        parts=("multisine",),
        prepare=_silverbox,
        model=resonator,
        truth=(Truth("nonlinear_stiffness", ("k",), "cubic spring, small even part"),),
        kinds=("restoring",),
        official=True,
        published=Published(
            0.301, "mV", "GP-NARX; linear models 6.96 mV",
            "same boundary, but over all 21 688 test samples",
        ),
    ),
    RealCase(
        name="hair_dryer",
        label="seen before",
        dataset="hair_dryer",
        parts=("record",),
        prepare=LoadedRecording,
        model=thermal_lag,
        truth=(
            Truth("delay", ("u", "y"), _DEAD_TIME),
            Truth("low_pass", ("u",), "a second lag beside the dead time"),
            Truth("sensor_lag", ("y",), "a second lag beside the dead time"),
            Truth("added_mode", ("C_th", "R_th", "u", "y"), "a second lag beside the dead time"),
        ),
        kinds=("command", "sensing", "slow", "mode"),
    ),
)  # fmt: skip
