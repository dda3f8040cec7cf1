"""The nouns of a bond graph: sources, resistors, storages, transducers, junctions, sensors."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeAlias, TypeVar

import sympy as sp

from bondgraph.graph import building
from bondgraph.graph.given import require_drive, require_law
from bondgraph.signals.units import read_unit
from bondgraph.support.bounds import Name, Positive, one_of, whole
from bondgraph.support.errors import GraphError
from bondgraph.support.spelled import spelled

if TYPE_CHECKING:
    from bondgraph.graph.drives import Drive
    from bondgraph.laws.law import Law

# a number, the name of a declared parameter, or a SymPy expression (untyped) of such
Value: TypeAlias = float | int | str | Any
_Other = TypeVar("_Other", bound="Element")


@dataclass(frozen=True, eq=True)
class Element:
    """A named node of the graph.

    ``a >> b`` inside ``with BondGraph(...)`` draws a bond whose half arrow points at ``b`` and
    has the value ``b``, so that chains read from left to right.
    """

    name: Name

    kind: ClassVar[str] = ""
    n_ports: ClassVar[int | None] = 1
    numbers: ClassVar[tuple[str, ...]] = ("value", "stiffness", "ratio")
    """Fields that hold a `Value`."""

    def __post_init__(self) -> None:
        """Refuse names that cannot be addresses; join the graph that is being built."""
        if not isinstance(self.name, str):
            raise GraphError(_no_name(self))
        if not self.name.isidentifier() or self.name.startswith("_"):
            raise GraphError(
                f"element name {self.name!r} is not an identifier: it is the address of the "
                "element in equations and verdicts; use letters, digits and underscores, "
                "a letter first"
            )
        for field_name in self.numbers:
            value: Any = getattr(self, field_name, None)
            if value is None or type(value) in (float, str):
                continue  # the usual case, without asking SymPy's classes
            if type(value).__module__ == "numpy" and getattr(value, "ndim", 1) == 0:
                value = value.item()
                object.__setattr__(self, field_name, value)
            plain = isinstance(value, int | float | str | sp.Expr)
            if not plain or isinstance(value, bool):
                raise GraphError(
                    f"{self.name}: {field_name} = {value!r} is no number, no name of a parameter "
                    "and no expression of parameters; give one of them"
                )
        self._convert()
        building.join(self)

    def _convert(self) -> None:
        """Bring the element's own numbers to SI."""

    def __rshift__(self, other: _Other) -> _Other:
        """Bond `self` to `other`, half arrow at `other`."""
        building.bond(self, other)
        return other


@dataclass(frozen=True)
class Junction(Element):
    """A power-conserving junction; abstract."""

    n_ports: ClassVar[int | None] = None


@spelled
@dataclass(frozen=True)
class Zero(Junction):
    """Common effort: one effort, the flows sum to zero.

    Examples
    --------
    >>> def low_pass():
    ...     with BondGraph("filter") as g:
    ...         loop, node = One("loop"), Zero("node")
    ...         Se("U", unit="V") >> loop >> R("r", 1e3, unit="ohm")
    ...         loop >> node >> C("c", 1e-6, unit="F")
    ...         node >> De("u", unit="V")
    ...     return g
    >>> equations(low_pass()).transfer_function("U", "u")
    1/(c*r*s + 1)
    """

    kind: ClassVar[str] = "0"


@spelled
@dataclass(frozen=True)
class One(Junction):
    """Common flow: one flow, the efforts sum to zero.

    Examples
    --------
    >>> def swinging():
    ...     with BondGraph("mass on a spring") as g:
    ...         body = One("body")
    ...         Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
    ...         body >> C("k", stiffness=2e3, unit="N/m")
    ...         body >> Dq("x", unit="m")
    ...     return g
    >>> swinging().neighbour("m")
    'body'
    """

    kind: ClassVar[str] = "1"


@dataclass(frozen=True)
class Source(Element):
    """An input; abstract.

    `drive` describes what lies between the recorded command and the port (a lag, a limit); `gain`
    is a factor on the command, `offset` a constant added to it (values, as for a `Sensor`).
    `measured` says that the recorded values are no command but a measurement of what acts at the
    port: nothing lies between them and the plant. `given` says what is recorded of it: its
    ``"value"``, its ``"rate"`` (the acceleration of a base that moves) or its ``"integral"`` (the
    displacement of it).
    """

    channel: ClassVar[tuple[str, ...]] = ("gain", "offset")
    numbers: ClassVar[tuple[str, ...]] = ("value", *channel)

    unit: str = ""
    drive: Drive | None = field(default=None, kw_only=True)
    offset: Value | None = field(default=None, kw_only=True)
    measured: bool = field(default=False, kw_only=True)
    given: Annotated[str, one_of("value", "rate", "integral")] = field(
        default="value", kw_only=True
    )
    gain: Value | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Refuse a drive that is none, such as the bare law of one."""
        super().__post_init__()
        require_drive(f"{self.name} ({self.kind})", self.drive)


@spelled
@dataclass(frozen=True)
class Se(Source):
    """Effort source.

    Examples
    --------
    >>> Se("F", unit="N", gain=2.0, offset=0.1).name
    'F'
    """

    kind: ClassVar[str] = "Se"


@spelled
@dataclass(frozen=True)
class Sf(Source):
    """Flow source.

    Examples
    --------
    >>> Sf("base", unit="m/s^2", given="rate").given  # its acceleration is recorded
    'rate'
    """

    kind: ClassVar[str] = "Sf"


@dataclass(frozen=True)
class Modulated(Source):
    """A source whose value is a signal of the graph; abstract.

    `value` is a SymPy expression of signals (`effort`, `flow`, `displacement`, `momentum`,
    `external`, `TIME` of `bondgraph.graph.modulation`) and of declared parameters; it stands in
    second place, as that of R, I and C.
    """

    unit: str = field(default="", kw_only=True)
    value: Value | None = 0.0


@spelled
@dataclass(frozen=True)
class MSe(Modulated):
    """Effort source modulated by a signal.

    Examples
    --------
    >>> from bondgraph import flow
    >>> MSe("weight", 9.81 * flow("body") ** 2, unit="N").value
    9.81*f_body**2
    """

    kind: ClassVar[str] = "MSe"


@spelled
@dataclass(frozen=True)
class MSf(Modulated):
    """Flow source modulated by a signal.

    Examples
    --------
    >>> from bondgraph import effort
    >>> MSf("leak", 1e-9 * effort("tank"), unit="m3/s").value
    1.0e-9*e_tank
    """

    kind: ClassVar[str] = "MSf"


@dataclass(frozen=True)
class Valued(Element):
    """An element with one linear coefficient and, if wanted, a law; abstract.

    `value` is a number (it becomes the parameter `name`), the name of a declared parameter, or a
    SymPy expression of declared parameters. A number is brought to SI with its `unit`; numbers of
    laws are SI. A law adds to the value; one with a slope of its own (a table, an operator) is
    whole and stands without a value.

    Examples
    --------
    >>> I("m", 250.0, unit="g")
    I(name='m', value=0.25, unit='kg', law=None, fixed=False, spread=None, source='')
    """

    value: Value | None = None
    unit: str = ""
    law: Law | None = field(default=None, kw_only=True)
    fixed: bool = field(default=False, kw_only=True)
    spread: Positive | None = field(default=None, kw_only=True)
    source: str = field(default="", kw_only=True)

    def _convert(self) -> None:
        require_law(f"{self.name} ({self.kind})", self.law)
        if self.law is None:
            _to_si(self, "value", "stiffness")


@spelled
@dataclass(frozen=True)
class R(Valued):
    """Resistor ``e = R f`` (or a law ``e = law(f)``).

    Examples
    --------
    >>> R("d", 4.0, unit="N*s/mm").value  # SI
    4000.0
    """

    kind: ClassVar[str] = "R"


@spelled
@dataclass(frozen=True)
class C(Valued):
    """Storage of displacement ``e = q / C``; give ``stiffness=`` for springs, ``e = k q``.

    Examples
    --------
    >>> C("k", stiffness=2.0, unit="N/mm").stiffness
    2000.0
    >>> C("c", 2.0, unit="mF").value
    0.002
    """

    stiffness: Value | None = field(default=None, kw_only=True)
    kind: ClassVar[str] = "C"


@spelled
@dataclass(frozen=True)
class I(Valued):
    """Storage of momentum ``f = p / I``.

    Examples
    --------
    >>> I("m", 500.0, unit="g").value
    0.5
    """

    kind: ClassVar[str] = "I"


@dataclass(frozen=True)
class TwoPort(Element):
    """A power-conserving two-port with a ratio; abstract."""

    ratio: Value = 1.0
    unit: str = ""
    n_ports: ClassVar[int | None] = 2
    fixed: bool = field(default=False, kw_only=True)
    spread: Positive | None = field(default=None, kw_only=True)
    source: str = field(default="", kw_only=True)

    def _convert(self) -> None:
        _to_si(self, "ratio")


@spelled
@dataclass(frozen=True)
class TF(TwoPort):
    """Transformer, half arrows through: ``e_in = n e_out``, ``f_out = n f_in``.

    In ``a >> TF("n", ratio=n) >> b`` the ratio is the effort at ``a`` over the effort at ``b``,
    which is the flow at ``b`` over the flow at ``a``: a cylinder of area A, from its pressure to
    its rod, has ``ratio=1/A`` (1/m^2); from the rod to the pressure it has ``ratio=A`` (m^2).

    Examples
    --------
    >>> area = 1e-3
    >>> def press():
    ...     with BondGraph("cylinder") as g:
    ...         oil, rod = Zero("oil"), One("rod")
    ...         Se("p", unit="Pa") >> oil >> TF("area", ratio=1 / area, unit="1/m2") >> rod
    ...         rod >> R("d", 50.0, unit="N*s/m")
    ...         rod >> Df("v", unit="m/s")
    ...     return g
    >>> press().check()
    ()
    >>> round(float(simulate(press(), t, {"p": 1e5 + 0 * t})["v"][-1]), 6)  # p A / d, m/s
    2.0
    """

    kind: ClassVar[str] = "TF"


@spelled
@dataclass(frozen=True)
class GY(TwoPort):
    """Gyrator, half arrows through: ``e_in = r f_out``, ``e_out = r f_in``.

    The ratio is the effort on either side over the flow on the other: a motor's constant in
    ``circuit >> GY("K", ratio=K) >> shaft`` is V s/rad, which is N m/A.

    Examples
    --------
    >>> def motor():
    ...     with BondGraph("motor") as g:
    ...         coil, shaft = One("coil"), One("shaft")
    ...         Se("U", unit="V") >> coil >> R("r", 2.0, unit="ohm")
    ...         coil >> GY("K", ratio=0.05, unit="V*s/rad") >> shaft >> I("J", 1e-4, unit="kg*m2")
    ...         shaft >> Df("w", unit="rad/s")
    ...     return g
    >>> equations(motor()).transfer_function("U", "w")
    K/(J*r*s + K**2)
    """

    kind: ClassVar[str] = "GY"


@spelled
@dataclass(frozen=True)
class MTF(TF):
    """Transformer whose `ratio` is an expression of signals and parameters.

    Examples
    --------
    >>> import sympy as sp
    >>> from bondgraph import displacement
    >>> MTF("crank", ratio=0.1 * sp.cos(displacement("angle"))).ratio
    0.1*cos(q_angle)
    """

    kind: ClassVar[str] = "MTF"


@spelled
@dataclass(frozen=True)
class MGY(GY):
    """Gyrator whose `ratio` is an expression of signals and parameters.

    Examples
    --------
    >>> from bondgraph import flow
    >>> MGY("field", ratio=0.05 * flow("exciter")).ratio
    0.05*f_exciter
    """

    kind: ClassVar[str] = "MGY"


@dataclass(frozen=True)
class Multiport(Element):
    """An element with several power ports, numbered by the order of their bonds; abstract.

    All half arrows point into it. `units` are the effort units of the ports, if they are to be
    checked.
    """

    n_ports: ClassVar[int | None] = None
    units: tuple[str, ...] = field(default=(), kw_only=True)
    ports: Annotated[int, whole(1, 1000)] = field(default=2, kw_only=True)


@dataclass(frozen=True)
class Field(Multiport):
    """A multiport with one constitutive relation for all ports; abstract.

    Give `law` as one expression a port, or, for a store, its `energy`, from which the law follows.
    Expressions use the port variables ``q1, q2, ..`` (C), ``p1, ..`` (I) or ``f1, ..`` (R), see
    `bondgraph.graph.modulation.port_variables`, and declared parameters. `matrix` gives a linear
    law ``output = matrix @ port variables``.
    """

    law: tuple[Value, ...] = field(default=(), kw_only=True)
    matrix: tuple[tuple[Value, ...], ...] = field(default=(), kw_only=True)
    letter: ClassVar[str] = ""


@spelled
@dataclass(frozen=True)
class CField(Field):
    """Multiport C: efforts are the gradient of the `energy` of the displacements.

    Examples
    --------
    >>> from bondgraph.graph.modulation import port_variables
    >>> q1, q2 = port_variables("q", 2)
    >>> CField("plate", energy=q1**2 * (1e-6 + q2) / 2).energy
    q1**2*(q2 + 1.0e-6)/2
    """

    energy: Value | None = field(default=None, kw_only=True)
    kind: ClassVar[str] = "CF"
    letter: ClassVar[str] = "q"


@spelled
@dataclass(frozen=True)
class IField(Field):
    """Multiport I: flows are the gradient of the `energy` of the momenta.

    Examples
    --------
    >>> IField("coils", matrix=((2.0, -0.5), (-0.5, 1.0))).matrix
    ((2.0, -0.5), (-0.5, 1.0))
    """

    energy: Value | None = field(default=None, kw_only=True)
    kind: ClassVar[str] = "IF"
    letter: ClassVar[str] = "p"


@spelled
@dataclass(frozen=True)
class RField(Field):
    """Multiport R: efforts from flows.

    Examples
    --------
    >>> RField("conductor", matrix=((1.0, 0.2), (0.2, 1.0))).ports
    2
    """

    kind: ClassVar[str] = "RF"
    letter: ClassVar[str] = "f"


@spelled
@dataclass(frozen=True)
class RE(TwoPort):
    """Chemical reaction by mass action: ``f = k (exp(A_in) - exp(A_out))`` through both ports.

    Efforts are affinities over ``R T``; `ratio` is the rate constant ``k`` (Oster, Perelson and
    Katchalsky, Q. Rev. Biophys. 6 (1973) 1). It destroys free energy: ``(e_in - e_out) f >= 0``.

    Examples
    --------
    >>> def reacting():
    ...     with BondGraph("isomers") as g:
    ...         a, b = Zero("a"), Zero("b")
    ...         a >> C("store_a", 1.0)
    ...         a >> RE("k", 0.3) >> b >> C("store_b", 1.0)
    ...     return g
    >>> equations(reacting()).rates
    (-k*(exp(q_store_a/store_a) - exp(q_store_b/store_b)), k*(exp(q_store_a/store_a) - ...
    """

    kind: ClassVar[str] = "RE"


@spelled
@dataclass(frozen=True)
class RS(TwoPort):
    """Resistor with its heat: ``e = R f`` at the port the half arrow enters, heat out of the other.

    `ratio` is the resistance. The outgoing flow is the heat flow ``e f`` (``heat="energy"``, the
    pseudo thermal domain) or the entropy flow ``e f / T`` (``heat="entropy"``).

    Examples
    --------
    >>> def heater():
    ...     with BondGraph("heater") as g:
    ...         wire, part = One("wire"), Zero("part")
    ...         Se("U", unit="V") >> wire >> RS("r", 10.0, unit="ohm") >> part
    ...         part >> C("c", 50.0, unit="J/K")
    ...         part >> De("T", unit="K")
    ...     return g
    >>> equations(heater()).rates
    (U**2/r,)
    """

    heat: Annotated[str, one_of("energy", "entropy")] = field(default="energy", kw_only=True)
    kind: ClassVar[str] = "RS"


@dataclass(frozen=True)
class Switched(Junction):
    """A junction that a controller, or its own signals, turn off; abstract.

    On, it is its junction; off, it isolates. Equations belong to one mode: `on` here, or
    `bondgraph.simulation.modes.resolve.in_mode`. Switching keeps states; a mode that would need an
    impulse is refused.
    """

    on: bool = True


@spelled
@dataclass(frozen=True)
class X0(Switched):
    """Switched 0-junction: off, every bond has zero effort.

    Examples
    --------
    >>> X0("valve", on=False).on
    False
    """

    kind: ClassVar[str] = "X0"


@spelled
@dataclass(frozen=True)
class X1(Switched):
    """Switched 1-junction: off, every bond has zero flow.

    Examples
    --------
    >>> X1("clutch").on
    True
    """

    kind: ClassVar[str] = "X1"


def common_variable(junction: Element) -> str:
    """Return ``"f"`` for a 1-junction, ``"e"`` for a 0-junction: what its bonds share."""
    return "f" if isinstance(junction, One | X1) else "e"


def _no_name(element: Element) -> str:
    """Return what is wrong with an element whose name is no text."""
    kind, given = type(element).__name__, [getattr(element, n, None) for n in element.numbers]
    named = [v for v in given if isinstance(v, str)]
    start = f"{kind}({element.name!r}, ...): the name comes first and is a text"
    if not named:
        return f'{start}; write {kind}("name", {element.name!r}, ...)'
    turned = f"{kind}({named[0]!r}, {element.name!r}, ...)"
    return f"{start}; name and value look swapped: write {turned}"


def _to_si(element: Element, *fields: str) -> None:
    """Convert the plain numbers of an element and its unit; what cannot be read waits for check."""
    held = {n: getattr(element, n, None) for n in fields}
    unit = read_unit(getattr(element, "unit", ""))
    plain = all(v is None or isinstance(v, int | float) for v in held.values())
    if plain and unit is not None and not unit.is_si:
        for n, v in held.items():
            if v is not None:
                object.__setattr__(element, n, v * unit.scale)
        object.__setattr__(element, "unit", unit.si)


def names(elements: Iterable[Element]) -> tuple[str, ...]:
    """Return the names, in order."""
    return tuple(e.name for e in elements)
