"""Laws that depend on a signal of another port beside their own argument."""

from __future__ import annotations

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self, final, get_args

from bondgraph.laws.law import Law
from bondgraph.support.bounds import Signal
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import Ops


@dataclass(frozen=True)
class Gauge(Law):
    """No output whatever the argument: it stands behind a law that watches this signal."""

    name: ClassVar[str] = "gauge"

    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Nothing."""
        return 0.0 * s

    def solve(
        self, s_free: Any, gain: Any, memory: Sequence[Any], p: Sequence[Any], w_last: Any
    ) -> Any:
        """Nothing."""
        return 0.0 * s_free


@dataclass(frozen=True)
class WatchingLaw(Law, ABC):
    """A law that reads the signal named by its field `beside`, say ``q_k`` or ``e_k``; abstract.

    The signal at the end of a step is continued as a line from the last two accepted ones, so that
    the law stays one of its own argument. The error is of second order in the step.

    Raises
    ------
    UnusableInput
        `beside` is no name of a signal.
    """

    follows: ClassVar[tuple[bool, ...]] = (False, False)
    """The watched signal one step ago and now; whoever runs the law fills them in."""

    def __post_init__(self) -> None:
        """Refuse what no signal is called."""
        (bound,) = get_args(Signal)[1:]
        if not isinstance(self.watched, str) or not bound.holds(self.watched):
            raise UnusableInput(
                f"{self.name}: beside={self.watched!r} names no signal; give one such as 'q_k'"
            )

    @property
    def watched(self) -> str:
        """Name of the signal."""
        return getattr(self, "beside")  # type: ignore[no-any-return]  # noqa: B009

    @final
    def watching(self, signal: str) -> Self:
        """Return the law with another signal beside its argument."""
        return replace(self, **{"beside": signal})

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Leave the memory to whoever runs the law."""
        return tuple(memory)

    def seen(self, memory: Sequence[Any]) -> Any:
        """Return the watched signal at the end of the step."""
        return 2.0 * memory[1] - memory[0]
