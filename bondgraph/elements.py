"""The nouns of a bond graph: sources, resistors, storages, transducers, junctions, sensors."""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, TypeVar

import sympy as sp

from bondgraph import building
from bondgraph.errors import GraphError

if TYPE_CHECKING:
    from bondgraph.drives import Drive
    from bondgraph.laws.law import Law

# a number, the name of a declared parameter, or a SymPy expression (untyped) of such
Value: TypeAlias = float | int | str | Any
_Other = TypeVar("_Other", bound="Element")


@dataclass(frozen=True, slots=True)
class Parameter:
    """A named number with a unit.

    Parameters
    ----------
    name : str
        Address of the parameter in equations, fits and verdicts.
    value : float
        Nominal value, SI.
    unit : str
        SI unit, printed only.
    positive : bool
        Physics forbids zero and negative values.
    lower, upper : float or None
        Bounds for identification.
    scale : float or None
        Typical size, used to condition fits; the nominal value when not given.
    fixed : bool
        Known well enough not to be fitted (a gauge, a counted number, a weighed mass).
    source : str
        Where the number comes from.
    spread : float or None
        The true value lies within this factor of `value` (data sheet, drawing, weighing); fits
        stay inside, so that a wrong structure cannot hide behind absurd parameters.
    """

    name: str
    value: float
    unit: str = "1"
    positive: bool = True
    lower: float | None = None
    upper: float | None = None
    scale: float | None = None
    fixed: bool = False
    source: str = ""
    spread: float | None = None

    @property
    def symbol(self) -> sp.Symbol:
        """The SymPy symbol of this parameter."""
        return symbol(self.name, positive=self.positive)


def symbol(name: str, *, positive: bool = False) -> sp.Symbol:
    """Return the one symbol Bondsight uses for `name`."""
    return sp.Symbol(name, positive=True) if positive else sp.Symbol(name, real=True)


@dataclass(frozen=True, eq=True)
class Element(ABC):
    """A named node of the graph.

    ``a >> b`` inside ``with BondGraph(...)`` draws a bond whose half arrow points at ``b`` and
    has the value ``b``, so that chains read from left to right.
    """

    name: str

    kind: ClassVar[str] = ""
    n_ports: ClassVar[int | None] = 1

    def __post_init__(self) -> None:
        """Refuse names that cannot be addresses; join the graph that is being built."""
        if not self.name.isidentifier() or self.name.startswith("_"):
            raise GraphError(
                f"element name {self.name!r} is not an identifier: it is the address of the "
                "element in equations and verdicts; use letters, digits and underscores, "
                "a letter first"
            )
        building.join(self)

    def __rshift__(self, other: _Other) -> _Other:
        """Bond `self` to `other`, half arrow at `other`."""
        building.bond(self, other)
        return other


@dataclass(frozen=True)
class Junction(Element, ABC):
    """A power-conserving junction; abstract."""

    n_ports: ClassVar[int | None] = None


@dataclass(frozen=True)
class Zero(Junction):
    """Common effort: one effort, the flows sum to zero."""

    kind: ClassVar[str] = "0"


@dataclass(frozen=True)
class One(Junction):
    """Common flow: one flow, the efforts sum to zero."""

    kind: ClassVar[str] = "1"


@dataclass(frozen=True)
class Source(Element, ABC):
    """An input; abstract.

    `drive` describes what lies between the recorded command and the port (a lag, a limit);
    `offset` names a constant added to the command.
    """

    unit: str = ""
    drive: Drive | None = None
    offset: str | None = None


@dataclass(frozen=True)
class Se(Source):
    """Effort source."""

    kind: ClassVar[str] = "Se"


@dataclass(frozen=True)
class Sf(Source):
    """Flow source."""

    kind: ClassVar[str] = "Sf"


@dataclass(frozen=True)
class Valued(Element, ABC):
    """An element with one linear coefficient and, if wanted, a law; abstract.

    `value` is a number (it becomes the parameter `name`), the name of a declared parameter, or a
    SymPy expression of declared parameters.
    """

    value: Value | None = None
    unit: str = ""
    law: Law | None = field(default=None, kw_only=True)
    fixed: bool = field(default=False, kw_only=True)
    spread: float | None = field(default=None, kw_only=True)
    source: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class R(Valued):
    """Resistor ``e = R f`` (or a law ``e = law(f)``)."""

    kind: ClassVar[str] = "R"


@dataclass(frozen=True)
class C(Valued):
    """Storage of displacement ``e = q / C``; give ``stiffness=`` for springs, ``e = k q``."""

    stiffness: Value | None = field(default=None, kw_only=True)
    kind: ClassVar[str] = "C"


@dataclass(frozen=True)
class I(Valued):
    """Storage of momentum ``f = p / I``."""

    kind: ClassVar[str] = "I"


@dataclass(frozen=True)
class TwoPort(Element, ABC):
    """A power-conserving two-port with a ratio; abstract."""

    ratio: Value = 1.0
    unit: str = ""
    n_ports: ClassVar[int | None] = 2
    fixed: bool = field(default=False, kw_only=True)
    spread: float | None = field(default=None, kw_only=True)
    source: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class TF(TwoPort):
    """Transformer, half arrows through: ``e_in = n e_out``, ``f_out = n f_in``."""

    kind: ClassVar[str] = "TF"


@dataclass(frozen=True)
class GY(TwoPort):
    """Gyrator, half arrows through: ``e_in = r f_out``, ``e_out = r f_in``."""

    kind: ClassVar[str] = "GY"


@dataclass(frozen=True)
class Sensor(Element, ABC):
    """A power-free tap whose reading is an output of the model; abstract."""

    unit: str = ""
    law: Law | None = field(default=None, kw_only=True)
    lag: str | None = field(default=None, kw_only=True)
    delay: str | None = field(default=None, kw_only=True)
    drift: tuple[str, ...] = field(default=(), kw_only=True)


@dataclass(frozen=True)
class De(Sensor):
    """Reads the effort of a 0-junction."""

    kind: ClassVar[str] = "De"


@dataclass(frozen=True)
class Df(Sensor):
    """Reads the flow of a 1-junction."""

    kind: ClassVar[str] = "Df"


@dataclass(frozen=True)
class Dq(Sensor):
    """Reads the displacement (integral of the flow) of a 1-junction."""

    kind: ClassVar[str] = "Dq"


def names(elements: Iterable[Element]) -> tuple[str, ...]:
    """Return the names, in order."""
    return tuple(e.name for e in elements)
