"""Single shooting: one free run a recording (or a window), the misfit of its readings."""

from __future__ import annotations

from typing import ClassVar, final

from bondgraph.support.errors import UnusableInput
from identification.estimation.methods.method import FitTask, Method, MethodSolution
from identification.study.free_parameters import clocks, dead_times
from identification.study.study import Study


@final
class SingleShooting(Method):
    """Output error of the free run; initial states are eliminated, memory has exact derivatives."""

    name: ClassVar[str] = "single_shooting"
    reads_after: ClassVar[bool] = True
    optimisers: ClassVar[tuple[str, ...]] = ("gauss_newton", "ipopt")

    def check(self, study: Study) -> None:
        """Refuse windows with given initial states, or what reaches over their edges."""
        if study.window is not None and study.initial != "free":
            raise UnusableInput(
                f"window = {study.window} gives every window a free initial state, but initial = "
                f"{study.initial!r}; leave window out, or initial free"
            )
        late = sorted(dead_times(study.graph) | clocks(study.graph))
        if study.nuisances.clock:
            late.append(f"a clock of each sensor (nuisances, {study.nuisances.clock:g})")
        if study.window is not None and late:
            raise UnusableInput(
                f"window = {study.window}: {', '.join(late)} reaches over the edges of windows; "
                "leave window out"
            )

    def solve(self, task: FitTask) -> MethodSolution:
        """Descend from the start."""
        if task.options.optimiser == "ipopt":
            from identification.estimation.ipopt import minimise_with_ipopt

            made = minimise_with_ipopt(task.stack, task.start, task.options)
        else:
            made = task.descend(task.stack, task.start, task.options.report)
        return MethodSolution(made.point, made.status, made.trace, evaluations=made.evaluations)
