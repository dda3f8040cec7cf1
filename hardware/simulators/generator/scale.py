"""Sizes at a place, taken from a run without the effect: what makes a strength of 1 "large"."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hardware.simulators.generator.native import Run
from hardware.simulators.generator.parameters import ALL_PLANTS

SOURCE_SLOT = 100
_MASSES: Mapping[str, Mapping[str, tuple[str, float]]] = {
    # the inertia that an element acts on, and its share: for stiffness against the sub-step
    "chain": {"b_1": ("m_1", 1), "b_2": ("m_1", 0.5), "b_3": ("m_2", 0.5)},
    "stack": {"b": ("m", 1)},
    "motor": {"b_1": ("J_1", 1), "b_s": ("J_2", 0.5), "b_2": ("J_2", 1)},
    "corner": {"b_t": ("m_u", 1), "b_s": ("m_u", 1)},
    "probe": {"b": ("m", 1)},
    "tanks": {},
    "cylinder": {"b": ("m", 1)},
    "servo": {"b_1": ("J_1", 1), "b_c": ("J_1", 0.5), "b_2": ("J_2", 1)},
    "oven": {},
    "frame": {"b_1": ("m_1", 1), "b_2": ("m_2", 0.7)},
    "press": {"b_1": ("m_1", 1), "b_2": ("m_2", 0.7)},
    "table": {"b_1": ("m_1", 1), "b_c": ("m_2", 0.7), "b_2": ("m_2", 1)},
    "speaker": {"b": ("m", 1)},
}


BESIDE: Mapping[tuple[str, str], str] = {
    **{("chain", f"k_{i}"): f"b_{i}" for i in (1, 2, 3)},
    ("stack", "k"): "b",
    ("motor", "k_s"): "b_s",
    ("corner", "k_t"): "b_t",
    ("corner", "k_s"): "b_s",
    ("probe", "k"): "b",
    ("servo", "k_c"): "b_c",
    **{(plant, f"k_{i}"): f"b_{i}" for plant in ("frame", "press") for i in (1, 2)},
    ("table", "k_c"): "b_c",
    ("speaker", "k"): "b",
}
"""Damper beside each spring, between the same two ends."""


@dataclass(frozen=True, slots=True)
class PlaceScale:
    """Sizes at a place.

    Parameters
    ----------
    slot : int
        Place in the C code.
    c : float
        Coefficient: stiffness or 1/C for storages, else the value itself.
    q, qr, f, fr : float
        Largest and rms displacement, largest and rms flow.
    force : float
        Usual effort at the place.
    mass : float
        Inertia that the place acts on.
    um, ur, rate : float
        Largest and rms command, and its fastest change per second.
    step, span : float
        Interval of the samples and length of the record, in s.
    partner : int
        Slot of the damper between the same two ends; -1 without one.
    """

    slot: int
    c: float
    q: float
    qr: float
    f: float
    fr: float
    force: float
    mass: float
    um: float
    ur: float
    rate: float
    step: float
    span: float
    partner: int = -1


def _force(plant: str, place: str, values: Mapping[str, float], run: Run) -> float:
    """Return the usual effort that a friction or a disturbance at the place competes with."""
    ur = float(np.std(run.command))
    seen = run.seen
    match plant:
        case "stack":
            return values["alpha"] * ur
        case "motor":
            torque = values["K_m"] * float(seen[0, 2])
            return torque if place in ("J_1", "b_1") else torque * values["n"]
        case "corner":
            return values["k_s"] * float(seen[3, 0])
        case "cylinder":
            return values["A"] * float(seen[0, 0]) / values["C_h"]
        case "table":
            return values["K_f"] * float(seen[0, 2])
        case "speaker":
            return values["Bl"] * float(seen[0, 2])
        case _:
            return ur


def scale_of(
    plant: str, place: str, values: Mapping[str, float], run: Run, samples: int
) -> PlaceScale:
    """Return the sizes at a place; for sources and sensors only the common ones are of use."""
    names = list(ALL_PLANTS[plant].nominal)
    step = ALL_PLANTS[plant].step
    slot = names.index(place) if place in names else SOURCE_SLOT
    row = run.seen[slot] if slot < len(run.seen) else np.ones(4)
    c = values.get(place, 1.0)
    if place.startswith("C_"):
        c = 1 / c
    inertia, share = _MASSES[plant].get(place, ("", 1.0))
    jumps = np.abs(np.diff(run.command))
    return PlaceScale(
        slot,
        c,
        float(row[1]),
        float(row[0]),
        float(row[3]),
        float(row[2]),
        _force(plant, place, values, run),
        share * values.get(inertia, 1.0),
        float(np.max(np.abs(run.command))),
        float(np.std(run.command)),
        float(np.max(jumps)) / step,
        step,
        samples * step,
        names.index(beside) if (beside := BESIDE.get((plant, place))) else -1,
    )
