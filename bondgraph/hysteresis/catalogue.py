"""The operators by their name in files. A new operator is entered here and gets its contract tests.

Only classes of this table are ever built from data; nothing in a file is evaluated.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bondgraph.hysteresis.composed.cascade import Cascade
from bondgraph.hysteresis.composed.parallel import Parallel
from bondgraph.hysteresis.creep.hysteresis_with_creep import HysteresisWithCreep
from bondgraph.hysteresis.creep.kelvin_voigt_creep import KelvinVoigtCreep
from bondgraph.hysteresis.creep.log_creep import LogCreep
from bondgraph.hysteresis.duhem.bouc_wen import BoucWen
from bondgraph.hysteresis.duhem.dahl import Dahl
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.hysteresis.invertible import Inverse
from bondgraph.hysteresis.operator import Operator
from bondgraph.hysteresis.plays.al_janaideh import AlJanaideh
from bondgraph.hysteresis.plays.ang import Ang, AngInverse
from bondgraph.hysteresis.plays.dead_zone import DeadZones
from bondgraph.hysteresis.plays.generalised import GeneralisedPrandtlIshlinskii
from bondgraph.hysteresis.plays.maxwell import MaxwellResistiveCapacitor
from bondgraph.hysteresis.plays.prandtl_ishlinskii import PrandtlIshlinskii
from bondgraph.hysteresis.preisach.krasnoselskii_pokrovskii import KrasnoselskiiPokrovskii
from bondgraph.hysteresis.preisach.preisach import Preisach
from bondgraph.hysteresis.rate.ang_rate_dependent import AngRateDependent
from bondgraph.hysteresis.rate.closed_form_inverse import RateDependentClosedFormInverse
from bondgraph.hysteresis.rate.rate_dependent import RateDependentPrandtlIshlinskii
from bondgraph.support.errors import UnusableInput
from bondgraph.support.typed_reader import Rules, chosen, read, record, require_object

OPERATORS: Mapping[str, type[Operator]] = {
    operator.kind: operator
    for operator in (
        PrandtlIshlinskii,
        DeadZones,
        Ang,
        AngInverse,
        AlJanaideh,
        GeneralisedPrandtlIshlinskii,
        MaxwellResistiveCapacitor,
        Preisach,
        KrasnoselskiiPokrovskii,
        BoucWen,
        Dahl,
        LogCreep,
        KelvinVoigtCreep,
        HysteresisWithCreep,
        RateDependentPrandtlIshlinskii,
        RateDependentClosedFormInverse,
        AngRateDependent,
        Cascade,
        Parallel,
        Inverse,
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
    try:
        return read_operator(Operator, data, "operator")
    except UnusableInput as error:
        raise BadParameter(str(error)) from None


def read_operator(wanted: Any, data: Any, place: str) -> Operator:
    """Read an operator of a class from plain data; see `bondgraph.support.typed_reader.Rules`.

    Raises
    ------
    UnusableInput
        As for `operator_from_dict`, or it is of another class.
    """
    given = dict(require_object(data, place, "an operator with its kind and parameters"))
    kind = given.pop("kind", None)
    operator = chosen(OPERATORS, kind, place, "operator kind")
    if not issubclass(operator, wanted):
        raise UnusableInput(f"{place}: {kind} is no {wanted.kind}")
    return record(operator, given, place, _RULES, operator.kind)


# the parameters of an operator may be expressions, those in a file are numbers
_RULES = Rules(
    {Any: lambda _, value, place: read(float, value, place), Operator: read_operator},
    complete=True,
)
