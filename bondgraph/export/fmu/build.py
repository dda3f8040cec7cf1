"""Program -> functional mock-up unit."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from bondgraph.equations.program import Program
from bondgraph.export.fmu.archive import linux_binary, write_archive
from bondgraph.export.fmu.description import build_description, description_2, description_3
from bondgraph.export.fmu.equations import Equations, equations
from bondgraph.export.fmu.names import identifier
from bondgraph.export.fmu.sizes import size_header, state_sizes
from bondgraph.export.fmu.variables import variables
from bondgraph.support.errors import UnusableInput, require_known

_SHARED = ("model.h", "model.c", "values.c")
_OWN = {
    2: ("fmi2.c", "fmi2_types.h", "fmi2_refused.c", "radau.c"),
    3: ("fmi3.c", "fmi3_types.h", "fmi3_refused.c"),
}


def fmu2_cosimulation(
    program: Program,
    path: str | Path,
    step: float | None = None,
    *,
    tolerance: float = 1e-6,
) -> Path:
    """Write an FMI 2.0 unit for co-simulation with its own integrator.

    Inputs are held over a communication step, as FMI 2.0 has it, unless the importer gives their
    slopes; an input ``d_NAME`` then takes the slope given for ``NAME``. The integrator is Radau
    IIA of order 5 (L-stable) with exact Jacobians and error control. Memory is evaluated from the
    last accepted sub-step and moves only when one is accepted; a sub-step ends where the argument
    of a law with memory turns. Parameters are tunable; states and memory can be set before the
    start. Without gcc the archive holds the C sources only.

    Parameters
    ----------
    program : Program
    path : str or Path
        File to write, usually ``*.fmu``; replaced if it exists.
    step : float, optional
        Largest internal step, s (parameter ``solver.largest_step``); chosen by the error alone
        when not given.
    tolerance : float
        Relative to the largest value each state has had (parameter ``solver.tolerance``).

    Returns
    -------
    Path
        The file.

    Raises
    ------
    UnusableInput
        If a law jumps (set-valued friction has no integrator step here), a number is not
        positive, or the file cannot be written.
    """
    if step is not None and not (math.isfinite(step) and step > 0.0):
        raise UnusableInput(f"FMU of {program.name}: step = {step} s must be positive")
    if not 1e-12 <= tolerance <= 1e-2:
        raise UnusableInput(f"FMU of {program.name}: tolerance = {tolerance} is not in 1e-12..1e-2")
    _accept(program)
    found = equations(program)
    name = identifier(program.name)
    table = variables(program, step or 0.0, tolerance, ())
    header = size_header(program, found, step or 0.0, tolerance, (), 0, [])

    def describe(token: str) -> dict[str, bytes]:
        text = description_2(program.name, name, token, table, found)
        return {"modelDescription.xml": text}

    token = "{%s}"
    return _write(Path(path), 2, name, found, header, describe, token, "linux64")


def fmu3_model_exchange(
    program: Program, path: str | Path, *, nominal: Mapping[str, float] | None = None
) -> Path:
    """Write an FMI 3.0 unit for model exchange.

    Algebraic unknowns are solved inside by Newton's method. Memory moves in
    ``fmi3CompletedIntegratorStep`` and is constant in between; where the argument of a law with
    memory turns, and where one without memory changes its piece, such as at a stop, an event
    indicator crosses zero, so that steps end there. Without gcc the archive holds the C sources
    only.

    Parameters
    ----------
    program : Program
    path : str or Path
        File to write, usually ``*.fmu``; replaced if it exists.
    nominal : mapping of str to float, optional
        Typical sizes of states, SI, for the importer's error control. By default the largest
        amplitude that an input of amplitude 1 excites, linearised at the start.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    UnusableInput
        If a law jumps, a nominal size is not positive, or the file cannot be written.
    UnknownName
        If `nominal` names no state.
    """
    _accept(program)
    found = equations(program)
    sizes = [float(s) for s in state_sizes(program, found)]
    for state, size in (nominal or {}).items():
        require_known("state", program.name, program.states, state)
        if not (math.isfinite(size) and size > 0.0):
            raise UnusableInput(f"FMU of {program.name}: nominal size {size} of {state}: give > 0")
        sizes[program.states.index(state)] = float(size)
    name = identifier(program.name)
    table = variables(program, 0.0, 1e-6, found.events, found.n_k)
    header = size_header(program, found, 0.0, 1e-6, found.events, found.n_k, sizes)

    def describe(token: str) -> dict[str, bytes]:
        text = description_3(program.name, name, token, table, found, sizes)
        return {
            "modelDescription.xml": text,
            "sources/buildDescription.xml": build_description(name),
        }

    return _write(Path(path), 3, name, found, header, describe, "%s", "x86_64-linux")


def _accept(program: Program) -> None:
    for call in program.laws:
        if call.law.set_valued:
            raise UnusableInput(
                f"FMU of {program.name}: the law of {call.element} jumps, and between its two "
                "values the rates have no solution; use a smooth law, such as LuGre"
            )


def _write(
    path: Path,
    version: int,
    name: str,
    found: Equations,
    header: str,
    describe: Callable[[str], dict[str, bytes]],
    token_form: str,
    platform: str,
) -> Path:
    folder = files("bondgraph.export.fmu").joinpath("sources")
    sources = {n: folder.joinpath(n).read_bytes() for n in (*_SHARED, *_OWN[version])}
    sources["linear.c"] = files("bondgraph.export").joinpath("sources/linear.c").read_bytes()
    sources["equations.c"] = found.source.encode()
    sources["sizes.h"] = header.encode()
    token = token_form % _fingerprint([describe(""), sources])
    sources["token.h"] = f'#define MODEL_TOKEN "{token}"\n'.encode("ascii")
    content = describe(token) | {f"sources/{n}": text for n, text in sources.items()}
    binary = linux_binary(sources, f"fmi{version}.c")
    if binary is not None:
        content[f"binaries/{platform}/{name}.so"] = binary
    write_archive(path, content)
    return path


def _fingerprint(parts: Sequence[Mapping[str, bytes]]) -> str:
    """Return a GUID that depends on the contents only."""
    digest = hashlib.sha256()
    for part in parts:
        for name in sorted(part):
            digest.update(f"{name} {len(part[name])}\n".encode() + part[name])
    h = digest.hexdigest()
    return f"{h[:8]}-{h[8:12]}-{h[12:16]}-{h[16:20]}-{h[20:32]}"
