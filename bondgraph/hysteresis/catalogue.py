"""The operators by their name in files. A new operator is entered here and gets its contract tests.

Only classes of this table are ever built from data; nothing in a file is evaluated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, cast

from bondgraph.hysteresis.composed.cascade import Cascade
from bondgraph.hysteresis.composed.parallel import Parallel
from bondgraph.hysteresis.creep.hysteresis_with_creep import (
    HysteresisWithCreep,
    HysteresisWithCreepInverse,
)
from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.creep.kelvin_voigt_inverse import KelvinVoigtCreepInverse
from bondgraph.hysteresis.creep.log_creep import LogCreep
from bondgraph.hysteresis.duhem.asymmetric_bouc_wen import AsymmetricBoucWen
from bondgraph.hysteresis.duhem.bouc_wen import BoucWen
from bondgraph.hysteresis.duhem.dahl import Dahl
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.operator import Operator
from bondgraph.hysteresis.plays.al_janaideh import AlJanaideh
from bondgraph.hysteresis.plays.ang import Ang, AngInverse
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.generalised import GeneralisedPrandtlIshlinskii
from bondgraph.hysteresis.plays.generalised_inverse import GeneralisedInverse
from bondgraph.hysteresis.plays.maxwell import MaxwellResistiveCapacitor
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.hysteresis.preisach.krasnoselskii_pokrovskii import KrasnoselskiiPokrovskii
from bondgraph.hysteresis.preisach.preisach import Preisach
from bondgraph.hysteresis.rate.ang_rate_dependent import AngRateDependent
from bondgraph.hysteresis.rate.ang_rate_dependent_inverse import AngRateDependentInverse
from bondgraph.hysteresis.rate.rate_dependent import RateDependentPrandtlIshlinskii
from bondgraph.hysteresis.rate.rate_dependent_inverse import (
    RateDependentClosedFormInverse,
    RateDependentInverse,
)

__all__ = ["OPERATORS", "operator_from_dict"]

OPERATORS: Mapping[str, type[Operator]] = {
    operator.kind: operator
    for operator in (
        PrandtlIshlinskii,
        DeadZones,
        Ang,
        AngInverse,
        AlJanaideh,
        GeneralisedPrandtlIshlinskii,
        GeneralisedInverse,
        MaxwellResistiveCapacitor,
        Preisach,
        KrasnoselskiiPokrovskii,
        BoucWen,
        AsymmetricBoucWen,
        Dahl,
        LogCreep,
        KelvinVoigtCreep,
        KelvinVoigtCreepInverse,
        HysteresisWithCreep,
        HysteresisWithCreepInverse,
        RateDependentPrandtlIshlinskii,
        RateDependentInverse,
        RateDependentClosedFormInverse,
        AngRateDependent,
        AngRateDependentInverse,
        Cascade,
        Parallel,
    )
}


def operator_from_dict(data: Mapping[str, Any]) -> Operator:
    """Rebuild any operator from `Operator.to_dict`.

    Parameters
    ----------
    data : mapping
        ``kind`` and the parameters of that kind; an operator inside is again such a mapping.

    Returns
    -------
    Operator
        Of the named kind.

    Raises
    ------
    BadParameter
        If the kind is unknown, or a parameter is missing, unknown or out of its domain.

    Examples
    --------
    >>> operator_from_dict({"kind": "dead_zone", "thresholds": [0], "weights": [2]}).linear_slope
    2.0
    """
    kind = data.get("kind")
    if not isinstance(kind, str) or kind not in OPERATORS:
        raise BadParameter(f"unknown operator kind {kind!r}; known: {', '.join(OPERATORS)}")
    operator = OPERATORS[kind]
    known = {f.name for f in fields(cast(Any, operator))}
    given = set(data) - {"kind"}
    if known != given:
        raise BadParameter(
            f"{kind} needs exactly the parameters {sorted(known)}; missing "
            f"{sorted(known - given)}, unknown {sorted(given - known)}"
        )
    values = {name: _decode(f"{kind}.{name}", data[name]) for name in known}
    return cast(Operator, cast(Any, operator)(**values))


def _decode(name: str, value: Any) -> Any:
    if isinstance(value, Mapping):
        return operator_from_dict(value)
    if isinstance(value, list):
        for i, entry in enumerate(value):
            _require_number(f"{name}[{i}]", entry)
        return tuple(value)
    _require_number(name, value)
    return value


def _require_number(name: str, value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadParameter(f"{name} = {value!r} must be a number")
