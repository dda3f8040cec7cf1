"""Several laws at one element: each sees the same argument, their deviations add up."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, final

from bondgraph.graph.parameter import Parameter
from bondgraph.laws.law import Law
from bondgraph.support.bounds import least
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import Ops


@final
@dataclass(frozen=True)
class LawSum(Law):
    """``deviation_1 + deviation_2 + ...`` beside the element's one slope.

    A ferroelectric is pinned walls (`StopSum`) in a potential (`Polynomial`).

    Parameters
    ----------
    parts : tuple of Law
        Laws that are solved by Newton's method, without a slope of their own.

    Raises
    ------
    UnusableInput
        If a part is no law, jumps, counts time, has a slope of its own or reads another signal,
        or two share a parameter.

    Examples
    --------
    >>> from bondgraph.laws import Polynomial, StopSum
    >>> law = LawSum((StopSum((1e-3,), 0.6), Polynomial(half=2e-3)))
    >>> [p.name for p in law.parameters("k")]
    ['h_1_k', 'a_2_k', 'a_3_k']
    """

    parts: Annotated[tuple[Law, ...], least(1)]
    name: ClassVar[str] = "sum"

    def __post_init__(self) -> None:
        """Refuse parts that cannot share a solution."""
        for law in self.parts:
            if not isinstance(law, Law):
                raise UnusableInput(f"a sum of laws cannot hold {law!r}, which is no law")
            if law.closed or law.set_valued or law.counts_time or law.slope is not None:
                raise UnusableInput(
                    f"a sum of laws cannot hold {law.name!r}, which jumps, counts time or has a "
                    "slope of its own; give it an element of its own on the same junction"
                )
            if law.watched:
                raise UnusableInput(
                    f"a sum of laws cannot hold {law.name!r}, which reads {law.watched} beside its "
                    "argument; give it an element of its own on the same junction"
                )
        known = [q.name for law in self.parts for q in _parameters(law)]
        if twice := sorted({n[:-2] for n in known if known.count(n) > 1}):
            raise UnusableInput(f"two laws of a sum have parameters {', '.join(twice)}; join them")

    def meaning(self, name: str) -> str:
        """As the first part that knows it."""
        return next((said for law in self.parts if (said := law.meaning(name))), "")

    @property
    def energy(self) -> str:  # type: ignore[override]
        """Dissipates if a part does and no part is a mere signal; stores if all do."""
        claims = {law.energy for law in self.parts}
        return "signal" if "signal" in claims else min(claims)

    @property
    def structure(self) -> Hashable:
        """Those of the parts."""
        return LawSum, tuple(law.structure for law in self.parts)

    @property
    def timed(self) -> bool:
        """Whether time matters to a part."""
        return any(law.timed for law in self.parts)

    @property
    def n_memory(self) -> int:
        """Memory of all parts."""
        return sum(law.n_memory for law in self.parts)

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Those of all parts."""
        return tuple(q for law in self.parts for q in law.parameters(element))

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Every part at rest at `s`."""
        return tuple(m for law in self.parts for m in law.initial_memory(s))

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """As the parts."""
        return tuple(m for law in self.parts for m in law.memory_sensitivity(s))

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Every part after `s`."""
        return tuple(v for law, m, q in self._each(memory, p) for v in law.advance(ops, s, m, q))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Sum of the parts."""
        return sum(law.deviation(ops, s, m, q) for law, m, q in self._each(memory, p))

    def _each(
        self, memory: Sequence[Any], p: Sequence[Any]
    ) -> Iterator[tuple[Law, Sequence[Any], Sequence[Any]]]:
        """Parts with their own memory and parameters; the time step ends those of timed ones."""
        m, q, step = 0, 0, tuple(p[-1:]) if self.timed else ()
        for law in self.parts:
            n, k = law.n_memory, len(law.parameters("x"))
            yield law, memory[m : m + n], (*p[q : q + k], *(step if law.timed else ()))
            m, q = m + n, q + k


def _parameters(law: Law) -> tuple[Parameter, ...]:
    try:
        return law.parameters("x")
    except TypeError:
        raise UnusableInput(
            f"a sum of laws cannot hold {law!r}: a field is not of its type; see its parameters"
        ) from None
