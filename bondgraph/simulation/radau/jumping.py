"""Laws that jump, such as dry friction, in the general step: it finds the force that holds them.

Newton's method has nothing to go by at a jump, and no value of such a law tells the force of a
contact that sticks. So its deviation is an unknown of every stage, and the law closed over the step
(`Law.solve`) is the equation for it, piecewise linear where the law is a jump between two levels.
The inclusion holds at both stages: what sticks does not creep within a step. Radau IIA is
algebraically stable, so that its stages have one solution for any monotone law (Hairer and Wanner,
Solving Ordinary Differential Equations II, 1996, sec. IV.12 to IV.14).
"""

from __future__ import annotations

from functools import lru_cache

from bondgraph.equations.codegen import Evaluation, program_of
from bondgraph.equations.program import LawCall, Program
from bondgraph.equations.system import System
from bondgraph.simulation.radau.recorder import Key


def stepping_program(model: System) -> Program:
    """Return the program of a system for the general step: what jumps is held where it can be."""
    program = program_of(model)
    closed = tuple(i for i in jumping_laws(program) if program.laws[i].law.closed)
    if not closed:
        return program
    made = Evaluation(model, held=closed)
    # what does not move its own argument is no contact: a jump of its input is one of its output
    return program_of(model, tuple(i for i in closed if made.gain(i).nnz()))


def jumping(program: Program) -> tuple[str, ...]:
    """Return the elements whose laws jump and are not held: Newton's method cannot follow them."""
    return tuple(program.laws[i].element for i in jumping_laws(program) if i not in program.held)


def jumping_laws(program: Program) -> tuple[int, ...]:
    """Return the positions of the laws that jump, held or not."""
    return _jumping(Key(program))


@lru_cache(maxsize=64)
def _jumping(key: Key) -> tuple[int, ...]:
    return tuple(i for i, c in enumerate(key.program.laws) if _jumps(c, key.program))


def _jumps(call: LawCall, program: Program) -> bool:
    """Whether the deviation is set-valued, or plainly jumps where the argument changes sign."""
    if call.law.set_valued:
        return True
    q = [program.nominal[program.parameters.index(n)] or 1.0 for n in call.parameters]
    memory = program.virgin[call.memory]
    ahead, back = (float(call.value(s, memory, q, 0.0)) for s in (1e-60, -1e-60))
    return abs(ahead - back) > 1e-20
