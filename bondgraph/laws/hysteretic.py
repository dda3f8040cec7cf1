"""Any operator of `bondgraph.hysteresis` as the law of an element."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

from bondgraph.graph.parameter import Parameter
from bondgraph.hysteresis import Operator
from bondgraph.laws.law import Law
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.ops import CASADI, Ops

if TYPE_CHECKING:
    import casadi as ca


@dataclass(frozen=True)
class Hysteretic(Law):
    """Any operator with memory as the whole law of an element.

    In a storage the argument is the displacement and the output the effort; in a resistor flow and
    effort; in a drive or a sensor the signal before and after.

    Parameters
    ----------
    operator : Operator
        Its numbers are constants of the model, unless they are named in `free`.
    free : str or sequence of str
        Numbers that are parameters of the model: ``"beta"``, ``"weights"`` (all of them),
        ``"weights[3]"``, of an operator inside by the names of the fields on the way,
        ``"play.weights"``, ``"hysteresis.weights"`` of a `HysteresisWithCreep`. They are called
        ``beta_NAME``, ``weights_3_NAME`` and ``play_weights_3_NAME`` after the element, a number of
        one letter ``al_janaideh_q_NAME``.

    Raises
    ------
    UnknownName
        If the operator has no such number.
    UnusableInput
        If `free` is no name at all.
    BadParameter
        If the number may not move (a first threshold, which is zero).

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> law = Hysteretic(PrandtlIshlinskii((0.0, 1e-3), (1.5e3, 5e2)))
    >>> [p.name for p in law.parameters("k")]
    []
    """

    operator: Operator
    free: tuple[str, ...] = ()
    name: ClassVar[str] = "operator"

    def __post_init__(self) -> None:
        """Check the free numbers."""
        named: Any = self.free
        named = (named,) if isinstance(named, str) else named
        if isinstance(named, bool) or not all(isinstance(n, str) for n in named):
            known = ", ".join(list(_numbers(self.operator, ()))[:4])
            raise UnusableInput(
                f"operator {self.operator.kind}: free = {self.free!r} names no number; "
                f"give names, such as {known}"
            )
        object.__setattr__(self, "free", tuple(named))
        places = self._places()
        if places:  # numbers that may not move are refused here, not in the middle of a run
            import casadi as ca

            self._at([ca.SX.sym(f"p{i}") for i in range(len(places))])

    @property
    def energy(self) -> str:  # type: ignore[override]
        """``dissipates`` if the operator is passive with its output as effort, else ``signal``.

        A sum of plays lags and, as a store, would give energy: use its inverse there.
        """
        return "dissipates" if self.operator.passive_port == "output" else "signal"

    @property
    def timed(self) -> bool:
        """Of the operator."""
        return self.operator.timed

    @property
    def flows(self) -> bool:  # type: ignore[override]
        """Of the operator."""
        return self.operator.flows

    @property
    def slope(self) -> float:
        """The operator's reference slope."""
        return float(self.operator.linear_slope)

    @property
    def signal_slope(self) -> float:
        """The same: what comes out of a drive or a sensor is the operator."""
        return self.slope

    @property
    def n_memory(self) -> int:
        """Memory of the operator."""
        return self.operator.n_memory

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Return the free numbers of the operator."""
        found = []
        for path, i in self._places():
            value = _inside(self.operator, path)
            sizes = [abs(v) for v in value] if isinstance(value, tuple) else [abs(value)]
            number = float(value if i is None else value[i])
            # q_NAME is the charge of a store already
            head = (self.operator.kind,) if len(path[0]) == 1 else ()
            label = "_".join((*head, *path, *([] if i is None else [str(i)]), element))
            found.append(Parameter(label, number, positive=False, scale=float(max(sizes)) or 1.0))
        return tuple(found)

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Return the operator's own initial memory at `s`."""
        return tuple(float(v) for v in self.operator.initial_memory(s))

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Return the derivative of the operator's initial memory at `s`."""
        return initial_slope(self.operator, s)

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Memory of the operator at `s`."""
        operator, step = self._at(p)
        return tuple(operator.advance(ops, s, tuple(memory), *step))

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Operator less its reference slope."""
        operator, step = self._at(p)
        return operator.value(ops, s, tuple(memory), *step) - self.slope * s

    def operator_at(self, p: Sequence[Any]) -> Operator:
        """Return the operator with its free numbers, the parameters of the law, at `p`."""
        return self._at(p)[0]

    def _places(self) -> tuple[Place, ...]:
        """Where each free number stands."""
        known = _numbers(self.operator, ())
        found: list[Place] = []
        for wanted in self.free:
            require_known("number", f"operator {self.operator.kind}", known, wanted)
            found += [place for place in known[wanted] if place not in found]
        return tuple(found)

    def _at(self, p: Sequence[Any]) -> tuple[Operator, tuple[Any, ...]]:
        """Return the operator with its free numbers in place, and the time step if it takes one."""
        places = self._places()
        made = _with_numbers(self.operator, dict(zip(places, p, strict=False)))
        return made, tuple(p[len(places) :])


Place = tuple[tuple[str, ...], int | None]
"""Fields on the way to a number of an operator, and its position in a tuple."""


def _inside(operator: Operator, path: tuple[str, ...]) -> Any:
    value: Any = operator
    for name in path:
        value = getattr(value, name)
    return value


def _numbers(operator: Operator, above: tuple[str, ...]) -> dict[str, tuple[Place, ...]]:
    """Return the places of all numbers by what they are called, those of operators inside too."""
    known: dict[str, tuple[Place, ...]] = {}
    for f in fields(operator):  # type: ignore[arg-type]
        value, path = getattr(operator, f.name), (*above, f.name)
        name = ".".join(path)
        if isinstance(value, Operator):
            known |= _numbers(value, path)
        elif isinstance(value, tuple) and value and isinstance(value[0], int | float):
            known[name] = tuple((path, i) for i in range(len(value)))
            known |= {f"{name}[{i}]": ((path, i),) for i in range(len(value))}
        elif isinstance(value, int | float) and not isinstance(value, bool):
            known[name] = ((path, None),)
    return known


def _with_numbers(operator: Operator, values: Mapping[Place, Any]) -> Operator:
    """Return the operator with other numbers at some places."""
    changed: dict[str, Any] = {}
    inner: dict[str, dict[Place, Any]] = {}
    for ((field, *rest), i), value in values.items():
        if rest:
            inner.setdefault(field, {})[(tuple(rest), i)] = value
        elif i is None:
            changed[field] = value
        else:
            entries = changed.setdefault(field, list(getattr(operator, field)))
            entries[i] = value
    made = {k: tuple(v) if isinstance(v, list) else v for k, v in changed.items()}
    made |= {k: _with_numbers(getattr(operator, k), v) for k, v in inner.items()}
    return replace(operator, **made) if made else operator  # type: ignore[type-var]


def initial_slope(operator: Operator, s: float) -> tuple[float, ...]:
    """Return the derivative of a virgin memory by the first input, shape (n_memory,)."""
    if not operator.n_memory:
        return ()
    return tuple(float(v) for v in _virgin_slope(operator)(s).full().ravel())


@lru_cache(maxsize=64)
def _virgin_slope(operator: Operator) -> ca.Function:
    import casadi as ca

    x = ca.SX.sym("x")
    memory = ca.vertcat(*operator.initial_memory(x, ops=CASADI))
    return ca.Function("slope", [x], [ca.densify(ca.jacobian(memory, x))])
