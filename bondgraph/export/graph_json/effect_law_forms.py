"""Fields of the laws of springs, contacts, dampers, tanks and clocks, as files may hold them."""

from __future__ import annotations

from collections.abc import Mapping

from bondgraph.export.graph_json.json_fields import (
    FLAG,
    NON_NEGATIVE,
    NUMBER,
    POSITIVE,
    TEXT,
    Form,
    choice,
)
from bondgraph.laws import (
    Ageing,
    AsymmetricDamping,
    Backlash,
    Bilinear,
    ContactLoss,
    DahlFriction,
    EndStop,
    Law,
    NonlinearResistance,
    Odometer,
    Onset,
    Overflow,
    Periodic,
    SelfHeating,
    Tone,
)

__all__ = ["EFFECT_LAWS"]

_UNIT = {"unit": TEXT}
_FLOW_UNIT = {"flow_unit": TEXT} | _UNIT
_SLOPE_UNIT = {"slope_unit": TEXT} | _UNIT
_WAY_UNIT = {"way_unit": TEXT} | _UNIT
_SHARED = {"coefficient": TEXT, "stiffness": POSITIVE, "inverse": FLAG, "stiffness_unit": TEXT}

EFFECT_LAWS: tuple[tuple[type[Law], Mapping[str, Form]], ...] = (
    (Backlash, _SHARED | {"width": NON_NEGATIVE, "centre": NUMBER, "size": POSITIVE} | _UNIT),
    (Bilinear, {n: NUMBER for n in ("change", "knee", "slope_size", "size")} | _SLOPE_UNIT),
    (
        ContactLoss,
        _SHARED | {"depth": NUMBER, "size": POSITIVE, "edge": NUMBER, "side": NUMBER} | _UNIT,
    ),
    (
        EndStop,
        {
            "stiffness": POSITIVE,
            "low": NUMBER,
            "high": NUMBER,
            "sides": choice("both", "low", "high"),
            "size": POSITIVE,
        }
        | _SLOPE_UNIT,
    ),
    (Overflow, _SHARED | {"depth": NUMBER, "size": POSITIVE, "top": NUMBER} | _UNIT),
    (Periodic, {n: POSITIVE for n in ("period", "size", "reach")} | _WAY_UNIT),
    (Odometer, {}),
    (DahlFriction, {"force": POSITIVE, "way": POSITIVE} | _WAY_UNIT),
    (AsymmetricDamping, {"difference": NUMBER, "size": POSITIVE} | _UNIT),
    (NonlinearResistance, {"size": POSITIVE, "level": POSITIVE} | _FLOW_UNIT),
    (SelfHeating, {"rise": NUMBER, "tau": POSITIVE, "level": POSITIVE} | _FLOW_UNIT),
    (
        Tone,
        {"frequency": POSITIVE, "resolution": POSITIVE, "size": POSITIVE, "free_standing": FLAG}
        | _UNIT,
    ),
    (
        Onset,
        {
            "time": NUMBER,
            "width": POSITIVE,
            "margin": POSITIVE,
            "size": POSITIVE,
            "ramp": FLAG,
            "free_standing": FLAG,
        }
        | _UNIT,
    ),
    (Ageing, {"duration": POSITIVE, "size": POSITIVE} | _UNIT),
)
"""Each law with one form for every field of it."""
