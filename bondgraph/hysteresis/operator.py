"""What every operator with memory offers, whatever its mathematics.

An operator is frozen; its memory is a plain tuple that the caller carries along. Within a step
`Operator.value` is evaluated from the memory of the last accepted step; once the step is accepted
`Operator.advance` gives the next memory. Both assume that the input moved monotonically since then,
so a simulation has to accept a step at every turning point.

Sizes: N samples, n_memory states.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, ClassVar, Literal, Self, TypeAlias, cast, final

from numpy.typing import ArrayLike

from bondgraph.hysteresis.checks import finite_record, memory_states, numbers, require_finite
from bondgraph.hysteresis.errors import BadInput, BadMemory, BadParameter
from bondgraph.support.ops import NUMPY, Expression, FloatArray, Ops

Memory: TypeAlias = tuple[Expression, ...]
"""The states of an operator, shape (n_memory,); floats, arrays of one shape, or expressions."""


class Operator(ABC):
    """An operator with explicit memory.

    Subclasses are final frozen dataclasses whose fields are numbers, tuples of numbers or other
    operators (each number may be an expression); they implement the underscored methods and
    are entered in `catalogue.OPERATORS`. `timed`, `wipes_out`, `congruent` and
    `passive_port` are claims that the contract tests check.

    Examples
    --------
    >>> from bondgraph.hysteresis import PrandtlIshlinskii
    >>> operator = PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5))
    >>> output, memory = operator.run([0.0, 2.0, 1.0, 2.0])
    >>> [round(float(v), 3) for v in output]
    [0.0, 2.5, 1.5, 2.5]
    """

    __slots__ = ()

    kind: ClassVar[str]
    """Name in files and in `catalogue.OPERATORS`."""

    flows: ClassVar[bool] = False
    """Whether the memory obeys a differential equation in time, see `bondgraph.laws.Law.flows`."""

    @property
    def timed(self) -> bool:
        """Whether time matters (creep, rate dependence); then every call needs its `step`."""
        return False

    @property
    def wipes_out(self) -> bool:
        """Whether a minor excursion that returns to its turning point leaves no trace."""
        return not self.timed

    @property
    def congruent(self) -> bool:
        """Whether minor loops between the same turning points have the same shape."""
        return not self.timed

    @property
    @abstractmethod
    def n_memory(self) -> int:
        """Number of memory states."""

    @property
    @abstractmethod
    def linear_slope(self) -> Expression:
        """Slope right after a reversal, where no hysteron moves; output per input.

        For an operator with a bent output stage, the slope there at output 0 of the inner stage.
        """

    @abstractmethod
    def _initial(self, ops: Ops, x0: Expression, states: Memory | None) -> Memory:
        """Return an admissible memory at ``x0``; ``states = None`` asks for the virgin one."""

    @abstractmethod
    def _value(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Expression:
        """Return the output at ``x``, ``step`` seconds after the memory."""

    @abstractmethod
    def _advance(self, ops: Ops, x: Expression, memory: Memory, step: Expression) -> Memory:
        """Return the memory at ``x``, ``step`` seconds after the memory given."""

    def _record(self, x: FloatArray, memory: Memory, step: float) -> tuple[FloatArray, Memory]:
        """Return the output over a checked record, shape (N,), and the last memory."""
        # The compiled record needs CasADi, which is slow to import.
        from bondgraph.hysteresis.compiled import compiled_record

        return compiled_record(self, x, memory, step)

    def _energy(
        self, ops: Ops, x: Expression, memory: Memory, step: Expression
    ) -> tuple[Expression, Expression] | None:
        """Return stored energy at ``x`` and energy lost on the way there, or None if unknown."""
        return None

    @property
    def passive_port(self) -> Literal["input", "output"] | None:
        """Which side must be the effort for the operator to be passive, or None if neither.

        ``"input"``: the work is the integral of x dy (a field that makes a displacement);
        ``"output"``: the integral of y dx (a displacement that makes a force). Only with such a
        claim may the operator be the law of a storage without creating energy.
        """
        return None

    @final
    def initial_memory(
        self,
        x0: Expression = 0.0,
        states: Sequence[Expression] | None = None,
        *,
        ops: Ops = NUMPY,
    ) -> Memory:
        """Return the memory to start from at input ``x0``.

        Parameters
        ----------
        x0 : expression, optional
            First input, unit of the input.
        states : sequence of expression, optional
            Wanted states, shape (n_memory,), unit of the input. They are moved to the nearest
            states that some input history can produce. Default: virgin, i.e. as if the input had
            come straight from 0.
        ops : Ops, optional
            Back end of ``x0`` and ``states``.

        Returns
        -------
        tuple of expression
            Shape (n_memory,), unit of the input.

        Raises
        ------
        BadMemory
            If ``states`` has the wrong length or is not finite.
        BadInput
            If ``x0`` is not finite.
        """
        if ops is NUMPY:
            require_finite("x0", x0)
        given = None if states is None else self._states(states)
        return self._states(self._initial(ops, x0, given))

    @final
    def value(
        self, ops: Ops, x: Expression, memory: Sequence[Expression], step: Expression = 0.0
    ) -> Expression:
        """Return the output at ``x``, reached monotonically from the memory's step.

        Parameters
        ----------
        ops : Ops
            Back end of ``x``, ``memory`` and any symbolic parameters.
        x : expression
            Input, scalar or array, unit of the input.
        memory : sequence of expression
            Memory of the last accepted step, shape (n_memory,); it is not changed.
        step : expression, optional
            Time since that step, s; only a timed operator uses it.

        Returns
        -------
        expression
            Output, shape of ``x``, unit of the output.

        Raises
        ------
        BadMemory
            If the memory is not one of this operator.
        """
        return self._value(ops, x, self._states(memory), step)

    @final
    def advance(
        self, ops: Ops, x: Expression, memory: Sequence[Expression], step: Expression = 0.0
    ) -> Memory:
        """Return the memory after an accepted step that ended at ``x``; arguments as of `value`.

        Returns
        -------
        tuple of expression
            New memory, shape (n_memory,).

        Raises
        ------
        BadMemory
            If the memory is not one of this operator.
        BadInput
            If ``x`` is a number that is not finite: it would spoil the memory for good.
        """
        if ops is NUMPY:
            require_finite("x", x)
        return self._states(self._advance(ops, x, self._states(memory), step))

    @final
    def run(
        self,
        x: ArrayLike,
        memory: Sequence[Expression] | None = None,
        *,
        step: float | None = None,
    ) -> tuple[FloatArray, Memory]:
        """Return the output over a whole record and the memory after it.

        Parameters
        ----------
        x : array
            Input, shape (N,), N >= 1, unit of the input.
        memory : sequence of float, optional
            Memory before the first sample, shape (n_memory,). Default: virgin at ``x[0]``.
        step : float, optional
            Time between samples, s, also before the first one; a timed operator needs it.

        Returns
        -------
        array
            Output, shape (N,), unit of the output.
        tuple of float
            Memory after the last sample, shape (n_memory,).

        Raises
        ------
        BadInput
            If the record is empty, not one-dimensional or not finite (names the first sample), or
            a timed operator is given no step.
        BadMemory
            If the memory is not one of this operator.
        BadParameter
            If a parameter is symbolic.
        """
        record = finite_record(x)
        seconds = self._seconds(step)
        start = self._initial(NUMPY, float(record[0]), None) if memory is None else memory
        states = self._states(start)
        self._json_states(states)
        output, after = self._record(record, states, seconds)
        return output, self._states(after)

    @final
    def stored_energy(
        self, ops: Ops, x: Expression, memory: Sequence[Expression], step: Expression = 0.0
    ) -> Expression:
        """Return the energy stored at ``x``; arguments and errors of memories as of `value`.

        Returns
        -------
        expression
            Unit of the input times unit of the output, for the work at `passive_port`.

        Raises
        ------
        BadParameter
            If no energy function is known for these parameters.
        """
        return self._known_energy(ops, x, memory, step)[0]

    @final
    def dissipated_energy(
        self, ops: Ops, x: Expression, memory: Sequence[Expression], step: Expression = 0.0
    ) -> Expression:
        """Return the energy lost on the monotone way from the memory's step to ``x``.

        The work at `passive_port` is the rise of `stored_energy` plus this, which is never
        negative. All else is as in `stored_energy`.
        """
        return self._known_energy(ops, x, memory, step)[1]

    def _known_energy(
        self, ops: Ops, x: Expression, memory: Sequence[Expression], step: Expression
    ) -> tuple[Expression, Expression]:
        found = self._energy(ops, x, self._states(memory), step)
        if found is None or self.passive_port is None:
            raise BadParameter(
                f"{self.kind} with these parameters has no energy function that makes it passive; "
                "integrate effort times displacement over a record instead"
            )
        return found

    def _seconds(self, step: float | None) -> float:
        if not self.timed:
            return 0.0
        if step is None or not math.isfinite(step) or step <= 0.0:
            raise BadInput(
                f"{self.kind} depends on time: give step, the time between samples, as a positive "
                f"number of seconds, not {step}"
            )
        return float(step)

    @final
    def to_dict(self) -> dict[str, Any]:
        """Return kind and parameters as plain JSON data.

        Raises
        ------
        BadParameter
            If a parameter is symbolic.
        """
        data = {f.name: _encode(f.name, getattr(self, f.name)) for f in fields(cast(Any, self))}
        return {"kind": self.kind, **data}

    @classmethod
    @final
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Rebuild an operator from `to_dict`.

        Raises
        ------
        BadParameter
            If the kind is another one, or a parameter is missing, unknown or out of its domain.
        """
        # The catalogue knows every subclass, so this base cannot import it at the top.
        from bondgraph.hysteresis.catalogue import operator_from_dict

        operator = operator_from_dict(data)
        if not isinstance(operator, cls):
            raise BadParameter(f"the data hold a {operator.kind}, not a {cls.__name__}")
        return operator

    @final
    def memory_to_dict(self, memory: Sequence[Expression]) -> dict[str, Any]:
        """Return a memory as plain JSON data, with the kind it belongs to.

        Raises
        ------
        BadMemory
            If the memory is not one of this operator, or is not made of single numbers.
        """
        return {"kind": self.kind, "states": self._json_states(self._states(memory))}

    @final
    def memory_from_dict(self, data: Mapping[str, Any]) -> Memory:
        """Rebuild a memory from `memory_to_dict`.

        Raises
        ------
        BadMemory
            If it belongs to another kind, or has the wrong length or a state that is no number.
        """
        if data.get("kind") != self.kind:
            raise BadMemory(f"the memory is one of {data.get('kind')!r}, not of {self.kind!r}")
        if not isinstance(data.get("states"), list):
            raise BadMemory("the memory data need a list 'states'")
        states = self._states(data["states"])
        return tuple(self._json_states(states))

    def _states(self, memory: Sequence[Expression]) -> Memory:
        return memory_states(self.kind, self.n_memory, memory)

    def _json_states(self, states: Memory) -> list[float]:
        for i, state in enumerate(states):
            if not isinstance(state, float):
                raise BadMemory(f"memory[{i}] = {state!r} of {self.kind} is not a single number")
        return list(states)


def _encode(name: str, value: Any) -> Any:
    if isinstance(value, Operator):
        return value.to_dict()
    if isinstance(value, int):
        return value
    if isinstance(value, tuple):
        return numbers(name, value)
    return numbers(name, (value,))[0]
