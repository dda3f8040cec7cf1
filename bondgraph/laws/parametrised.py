"""A law whose constants are read at run time: one kernel serves every recording."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import Bound, Name, least
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Parametrised(Law):
    """`inner` with the numbers in its fields `lifted` as fixed parameters.

    A diagnosis chooses thresholds and ranges anew for every recording; written into the equations
    they would ask for another kernel each time. Fields may hold one number or a tuple of numbers.

    Parameters
    ----------
    inner : Law
        A law that is solved by Newton's method (not `closed`).
    lifted : tuple of str
        Names of its fields.
    units : tuple of str
        Unit of each of these fields; none where they are not told.

    Raises
    ------
    UnusableInput
        If the law is solved in closed form or reads another signal, a field holds something
        else than numbers, or some fields have a unit and others none.
    UnknownName
        If the law has no such field.

    Examples
    --------
    >>> from bondgraph.laws import StopSum
    >>> law = Parametrised(StopSum((1e-3, 2e-3), 0.6), ("thresholds",))
    >>> [p.name for p in law.parameters("k")]
    ['h_1_k', 'h_2_k', 'thresholds_1_k', 'thresholds_2_k']
    """

    inner: Annotated[Law, Bound("a law that is not lifted itself", lambda v: v.name != "lifted")]
    lifted: Annotated[tuple[Name, ...], least(1)]
    units: tuple[str, ...] = ()
    name: ClassVar[str] = "lifted"

    def __post_init__(self) -> None:
        """Refuse fields that are no numbers, and laws that cannot be solved at other numbers."""
        if self.inner.closed:
            raise UnusableInput(
                f"{self.inner.name} is solved in closed form; its numbers stay in it"
            )
        if self.inner.watched:
            raise UnusableInput(
                f"{self.inner.name} reads {self.inner.watched} beside its argument; its numbers "
                "stay in it"
            )
        if self.units and len(self.units) != len(self.lifted):
            raise UnusableInput(
                f"{self.inner.name}: {len(self.lifted)} fields are lifted, {len(self.units)} units "
                "are given"
            )
        known = [f.name for f in fields(self.inner)]
        for name in self.lifted:
            require_known("field", f"the law {self.inner.name!r}", known, name)
            held = getattr(self.inner, name)
            for v in held if isinstance(held, tuple) else (held,):
                if isinstance(v, bool) or not isinstance(v, int | float):
                    raise UnusableInput(
                        f"field {name!r} of {self.inner.name} holds {v!r}; numbers can be lifted"
                    )

    @property
    def energy(self) -> str:  # type: ignore[override]
        """Claim of the law itself."""
        return self.inner.energy

    @property
    def structure(self) -> Hashable:
        """Without the values of the lifted fields."""
        kept = tuple(
            (f.name, getattr(self.inner, f.name))
            for f in fields(self.inner)
            if f.name not in (*self.lifted, *self.inner.starts)
        )
        return Parametrised, type(self.inner), kept, tuple(len(v) for v in self._values)

    @property
    def slope(self) -> float | None:
        """Slope of the law itself."""
        return self.inner.slope

    @property
    def signal_slope(self) -> float:
        """As the law itself."""
        return self.inner.signal_slope

    @property
    def timed(self) -> bool:
        """As the law itself."""
        return self.inner.timed

    @property
    def counts_time(self) -> bool:  # type: ignore[override]
        """As the law itself."""
        return self.inner.counts_time

    @property
    def n_memory(self) -> int:
        """As the law itself."""
        return self.inner.n_memory

    @property
    def _values(self) -> tuple[tuple[float, ...], ...]:
        found = (getattr(self.inner, n) for n in self.lifted)
        return tuple(v if isinstance(v, tuple) else (float(v),) for v in found)

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Parameters of the law, then its constants, fixed."""
        units = self.units or ("1",) * len(self.lifted)
        constants = [
            Parameter(f"{name}_{i}_{element}", v, unit, positive=False, fixed=True)
            for name, values, unit in zip(self.lifted, self._values, units, strict=True)
            for i, v in enumerate(values, start=1)
        ]
        return (*self.inner.parameters(element), *constants)

    def meaning(self, name: str) -> str:
        """As the law itself."""
        return self.inner.meaning(name)

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """As the law itself."""
        return self.inner.initial_memory(s)

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """As the law itself."""
        return self.inner.memory_sensitivity(s)

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Deviation with the constants of `p`."""
        law, own = self._at(p)
        return law.deviation(ops, s, memory, own)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Advance with the constants of `p`."""
        law, own = self._at(p)
        return law.advance(ops, s, memory, own)

    def _at(self, p: Sequence[Any]) -> tuple[Law, Sequence[Any]]:
        own = len(self.inner.parameters("x"))
        changes: dict[str, Any] = {}
        at = own
        for name, values in zip(self.lifted, self._values, strict=True):
            numbers = tuple(p[at : at + len(values)])
            at += len(values)
            changes[name] = numbers if isinstance(getattr(self.inner, name), tuple) else numbers[0]
        rest = p[at:]
        return replace(self.inner, **changes), (*p[:own], *rest)
