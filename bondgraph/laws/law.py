"""What every constitutive law is: a linear slope plus a deviation, with explicit memory."""

from __future__ import annotations

import inspect
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, final

from bondgraph.laws.iteration import Iteration
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import Ops

if TYPE_CHECKING:
    from bondgraph.graph.parameter import Parameter

NEWTON_STEPS = 6
CALLED_FROM = 8


@dataclass(frozen=True)
class Law(ABC):
    """A scalar law ``output = slope * s + deviation(s, memory; p)``; abstract.

    `s` is the displacement for a storage, the flow for a resistor, the command for a drive and
    the true value for a sensor. Keeping the linear slope apart lets the integrator treat the
    stiff linear part exactly; only the deviation is interpolated.

    `energy` is the claim the contract test checks: ``stores`` (a function of `s` alone in a
    storage), ``dissipates`` (never returns more than it took) or ``signal`` (no power port).

    Examples
    --------
    >>> from bondgraph.laws import Coulomb
    >>> law = Coulomb(0.8)
    >>> law.energy, [p.name for p in law.parameters("d")]
    ('dissipates', ['F_c_d'])
    """

    name: ClassVar[str] = ""
    energy: ClassVar[str] = "signal"
    set_valued: ClassVar[bool] = False
    """The deviation jumps and is held at its end value over a step: a line would ring."""
    slides_level: ClassVar[bool] = False
    """While its argument keeps its sign the deviation does not follow it, as in dry friction."""
    closed: ClassVar[bool] = False
    """`solve` is a formula to be differentiated; otherwise the deviation has a slope at the root
    and the implicit function theorem gives the derivatives."""

    counts_time: ClassVar[bool] = False
    """The memory begins with the time since the start of the record, s: a window that begins later
    is given it."""

    lives_in_time: ClassVar[bool] = False
    """What `timed` says of every law of this kind."""

    own_origin: ClassVar[tuple[str, ...]] = ()
    """Parameters, named without the element, that say where its argument is zero: with others of
    them it is one of its kind again, moved along the argument."""

    flows: ClassVar[bool] = False
    """The memory obeys a differential equation in time, see `bondgraph.simulation.flowing`."""

    follows: ClassVar[tuple[bool, ...]] = ()
    """One entry a memory state, if their number is fixed: whether at rest it is `s`, or else 0."""

    meanings: ClassVar[Mapping[str, str]] = {}
    """What each parameter is, by its name without the element; ``h_i`` is any numbered one."""

    starts: ClassVar[tuple[str, ...]] = ()
    """Fields that no equation uses: where a fit starts, typical sizes, units."""

    @property
    def structure(self) -> Hashable:
        """Everything the equations depend on but the parameters: equal ones share a kernel."""
        names = (f.name for f in fields(self) if f.name not in self.starts)
        kept = tuple((n, getattr(self, n)) for n in names)
        return type(self), kept

    def parameters(self, element: str) -> tuple[Parameter, ...]:
        """Parameters of the deviation, named after `element`."""
        return ()

    def meaning(self, name: str) -> str:
        """Return what a parameter is, named without the element; empty where nothing is told.

        Examples
        --------
        >>> from bondgraph.laws import Coulomb
        >>> Coulomb(0.8).meaning("F_c")
        'friction level, the same at every speed'
        """
        return said_of(name, self.meanings)

    @property
    def words(self) -> str:
        """Its own words, as `law_words` has them, with what its fields change."""
        return law_words(type(self))

    @property
    def slope(self) -> float | None:
        """Own linear slope, or None when the element's value is the slope."""
        return None

    @property
    def signal_slope(self) -> float:
        """Slope the deviation is taken from in a drive or a sensor: the identity, as a rule."""
        return 1.0

    @property
    def timed(self) -> bool:
        """Whether time matters; then `p` ends with the time since the memory, s."""
        return self.lives_in_time

    @property
    def watched(self) -> str:
        """Signal that the law reads beside its argument, "" if none; see `watching.WatchingLaw`."""
        return ""

    @property
    def n_memory(self) -> int:
        """How many numbers the memory holds."""
        return len(self.follows)

    def initial_memory(self, s: float) -> tuple[float, ...]:
        """Memory of a law at rest at `s`."""
        return tuple(s if follows else 0.0 for follows in self.follows)

    def memory_sensitivity(self, s: float = 0.0) -> tuple[float, ...]:
        """Return the derivative of `initial_memory` with respect to `s`."""
        return tuple(map(float, self.follows)) or (0.0,) * self.n_memory

    @abstractmethod
    def deviation(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> Any:
        """Value less ``slope * s``, from the memory of the last accepted step."""

    def advance(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any]) -> tuple[Any, ...]:
        """Memory after `s` has been accepted."""
        return ()

    @final
    def memory_to_dict(self, memory: Sequence[float]) -> dict[str, Any]:
        """Return a memory as plain JSON data, with the law it belongs to.

        Raises
        ------
        UnusableInput
            If its length is not that of this law, or a state is not a finite number.
        """
        return {"law": self.name, "states": list(self.checked_memory(memory))}

    @final
    def memory_from_dict(self, data: Mapping[str, Any]) -> tuple[float, ...]:
        """Rebuild a memory from `memory_to_dict`.

        Raises
        ------
        UnusableInput
            If it belongs to another law, has the wrong length or a state that is no number.
        """
        if data.get("law") != self.name or not isinstance(data.get("states"), list):
            raise UnusableInput(
                f"the memory is one of {data.get('law')!r}, not a list of states of {self.name!r}"
            )
        return self.checked_memory(data["states"])

    @final
    def checked_memory(self, memory: Sequence[Any]) -> tuple[float, ...]:
        """Return a memory as floats.

        Raises
        ------
        UnusableInput
            If its length is not that of this law, or a state is not a finite number.
        """
        if len(memory) != self.n_memory:
            raise UnusableInput(
                f"{self.name} has {self.n_memory} memory states, the memory given has {len(memory)}"
            )
        for i, state in enumerate(memory):
            number = isinstance(state, int | float) and not isinstance(state, bool)
            if not number or not math.isfinite(state):
                raise UnusableInput(f"memory[{i}] = {state!r} of {self.name} is no finite number")
        return tuple(float(state) for state in memory)

    def value(self, ops: Ops, s: Any, memory: Sequence[Any], p: Sequence[Any], slope: Any) -> Any:
        """Return the whole law."""
        return slope * s + self.deviation(ops, s, memory, p)

    def solve(
        self, s_free: Any, gain: Any, memory: Sequence[Any], p: Sequence[Any], w_last: Any
    ) -> Any:
        """Deviation `w` that satisfies ``s = s_free + gain * w``, ``w = deviation(s)``.

        CasADi expressions in and out. The default takes all steps of `iteration`; a law with a
        formula overrides it.
        """
        return self.iteration(memory, p).solved(s_free, gain, w_last)

    @property
    def iterates(self) -> bool:
        """Whether `solve` has no formula, but takes the steps of `iteration`."""
        return type(self).solve is Law.solve

    def iteration(self, memory: Sequence[Any], p: Sequence[Any]) -> Iteration:
        """Return the way to the root of `solve`: Newton steps from the last value."""
        import casadi as ca

        from bondgraph.support.ops import CASADI

        t = ca.SX.sym("t")
        sizes = (len(memory), len(p))
        m, q = (ca.SX.sym(name, size) for name, size in zip("mq", sizes, strict=True))
        w = ca.SX(self.deviation(CASADI, t, split(m), split(q)))
        # a large law is called, not written out for every Newton step: the C code stays small
        options = {"never_inline": True} if self.n_memory >= CALLED_FROM else {}
        law = ca.Function("law", [t, m, q], [w, ca.densify(ca.jacobian(w, t))], options)
        memories, parameters = ca.vertcat(*memory), ca.vertcat(*p)

        def step(s: Any, free: Any, gain: Any) -> Any:
            value, slope = law(s, memories, parameters)
            return s - (s - free - gain * value) / (1 - gain * slope)

        return Iteration(
            lambda free, gain, w_last: free + gain * w_last,
            step,
            lambda s: law(s, memories, parameters)[0],
            1, 1, NEWTON_STEPS,
        )  # fmt: skip


def said_of(name: str, meanings: Mapping[str, str]) -> str:
    """Return the words for a name, or for all numbered ones of its sort."""
    return meanings.get(name) or meanings.get(re.sub(r"_\d+$", "_i", name), "")


def law_words(law: type[Law]) -> str:
    """Return a law in its own words: the first paragraph of its description, with its formula.

    Examples
    --------
    >>> from bondgraph.laws import Coulomb
    >>> law_words(Coulomb)
    'Dry friction ``F_c sign(f)``; sticks exactly, without a regularising velocity.'
    """
    return " ".join(inspect.cleandoc(law.__doc__ or "").split("\n\n")[0].split())


def split(column: Any) -> Sequence[Any]:
    """Entries of a CasADi column."""
    import casadi as ca

    return tuple(ca.vertsplit(column)) if column.numel() else ()
