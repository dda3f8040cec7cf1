"""Sensors: what is read of a graph, and how a bench reads it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from bondgraph.graph.elements import Element, Value
from bondgraph.graph.given import require_law
from bondgraph.support.bounds import Name
from bondgraph.support.spelled import spelled

if TYPE_CHECKING:
    from bondgraph.laws.law import Law


@dataclass(frozen=True)
class Sensor(Element):
    """A power-free tap whose reading is an output of the model; abstract.

    What is read passes, in this order, a first-order `lag` (s), second-order dynamics with
    `natural_frequency` (rad/s) and `damping_ratio`, a `law` that bends it, a factor `gain`, an
    `offset` that is added, coefficients of powers of time that are added (`drift`), and rounding
    to the multiples of `resolution`. A number is a known parameter, ``gain_x`` of a sensor ``x``,
    which fits hold unless it is freed. `delay` names a dead time (s), `clock` the ratio error of
    the clock that samples it (reading number n is taken at ``(1 + clock) t_n``).
    """

    channel: ClassVar[tuple[str, ...]] = (
        "lag", "natural_frequency", "damping_ratio", "gain", "offset", "resolution",
    )  # fmt: skip
    numbers: ClassVar[tuple[str, ...]] = ("value", *channel)

    unit: str = ""
    law: Law | None = field(default=None, kw_only=True)
    lag: Value | None = field(default=None, kw_only=True)
    delay: Name | None = field(default=None, kw_only=True)
    clock: Name | None = field(default=None, kw_only=True)
    gain: Value | None = field(default=None, kw_only=True)
    drift: tuple[Name, ...] = field(default=(), kw_only=True)
    natural_frequency: Value | None = field(default=None, kw_only=True)
    damping_ratio: Value | None = field(default=None, kw_only=True)
    offset: Value | None = field(default=None, kw_only=True)
    resolution: Value | None = field(default=None, kw_only=True)

    def _convert(self) -> None:
        require_law(f"{self.name} ({self.kind})", self.law)


@spelled
@dataclass(frozen=True)
class De(Sensor):
    """Reads the effort of a 0-junction.

    Examples
    --------
    >>> De("u", unit="V", resolution=1e-3).resolution
    0.001
    """

    kind: ClassVar[str] = "De"


@spelled
@dataclass(frozen=True)
class Df(Sensor):
    """Reads the flow of a 1-junction.

    Examples
    --------
    >>> Df("v", unit="m/s", lag=1e-3).lag  # first-order lag of the sensor, s
    0.001
    """

    kind: ClassVar[str] = "Df"


@spelled
@dataclass(frozen=True)
class Dq(Sensor):
    """Reads the displacement (integral of the flow) of a 1-junction.

    Examples
    --------
    >>> Dq("x", unit="m", gain=1.02).gain
    1.02
    """

    kind: ClassVar[str] = "Dq"


@spelled
@dataclass(frozen=True)
class Da(Sensor):
    """Reads the rate of a junction's common variable.

    The acceleration at a 1-junction, the rate of the effort at a 0-junction; derived from the
    equations, never from differences.

    Examples
    --------
    >>> def shaken():
    ...     with BondGraph("shaker") as g:
    ...         body = One("body")
    ...         Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
    ...         body >> R("d", 4.0, unit="N*s/m")
    ...         body >> Da("a", unit="m/s2")
    ...     return g
    >>> equations(shaken()).outputs
    ((F - d*p_m/m)/m,)
    """

    kind: ClassVar[str] = "Da"


@spelled
@dataclass(frozen=True)
class Reading(Sensor):
    """Reads any signal of the graph, or what an expression makes of several; it has no bond.

    `value` is a SymPy expression of signals (`effort`, `flow`, `displacement`, `momentum` of
    `bondgraph.graph.modulation`) and of declared parameters: the force in a spring, the difference
    of two pressures, a power.

    Examples
    --------
    >>> from bondgraph import displacement, effort
    >>> Reading("force", effort("k"), unit="N").value  # of a spring, wherever it hangs
    e_k
    >>> Reading("gap", displacement("k1") - displacement("k2"), unit="m").value
    q_k1 - q_k2
    """

    kind: ClassVar[str] = "Reading"

    unit: str = field(default="", kw_only=True)
    value: Value | None = None
