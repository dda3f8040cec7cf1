"""Program -> CasADi functions with named inputs and outputs, for optimisers and integrators."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import casadi as ca

from bondgraph.equations.program import FunctionNames, Program
from bondgraph.export.casadi_step import step_function
from bondgraph.export.implicit import solve_algebraic
from bondgraph.export.switches import switches
from bondgraph.support.errors import UnusableInput, unknown_name
from bondgraph.support.whole_file import write_atomically

SCHEMA: Final = "bondsight.casadi/1"
KNOWN: Final = ("t", "x", "u", "p", "m", "h")


@dataclass(frozen=True)
class CasadiModel:
    """The model as CasADi functions.

    Two functions of the program are kept, everything else is made of them, so that a saved model
    is small and complete.

    Attributes
    ----------
    names : FunctionNames
    equations : casadi.Function
        ``(t, x, z, u, p, m, h) -> (dx, y, g)``, SX; the physics with ``g = 0`` left open.
    memory_rule : casadi.Function
        ``(t, x, z, u, p, m, h) -> m_next``, SX.
    """

    names: FunctionNames
    equations: ca.Function = field(repr=False)
    memory_rule: ca.Function = field(repr=False)

    @cached_property
    def residual(self) -> ca.Function:
        """``(t, x, z, u, p, m, h) -> g``, SX; shape (n_z,)."""
        v = self._symbols()
        labels = ["t", "x", "z", "u", "p", "m", "h"]
        return ca.Function("residual", v, [self.equations(*v)[2]], labels, ["g"])

    @cached_property
    def switches(self) -> ca.Function:
        """``(t, x, z, u, p, m, h) -> zero``, SX: where a law without memory changes its piece.

        CasADi's integrators take such expressions as ``zero`` of a DAE, as an experiment.
        """
        v = self._symbols()
        dx, _, g = self.equations(*v)
        zero = switches(ca.vertcat(dx, g), v, ca.vertcat(v[1], v[2]), v[5])
        return ca.Function("switches", v, [zero], [*"txzupmh"], ["zero"])

    @cached_property
    def rhs(self) -> ca.Function:
        """``(t, x, u, p, m, h, z_guess) -> (dx, y, z)`` with z solved inside; MX.

        h is the time since the memory, s (it matters to laws that depend on time). Without
        algebraic unknowns `z_guess` is empty and may be left out of a call by names.
        """
        known, guess = self._known()
        t, x, u, p, m, h = known
        z = solve_algebraic(self.residual, guess, known)
        dx, y, _ = self.equations(t, x, z, u, p, m, h)
        return ca.Function(
            "rhs", [*known, guess], [dx, y, z], [*KNOWN, "z_guess"], ["dx", "y", "z"]
        )

    @cached_property
    def advance(self) -> ca.Function:
        """``(t, x, u, p, m, h, z_guess) -> m_next`` once a step of h seconds is accepted; MX."""
        known, guess = self._known()
        t, x, u, p, m, h = known
        z = solve_algebraic(self.residual, guess, known)
        new = self.memory_rule(t, x, z, u, p, m, h)
        return ca.Function("advance", [*known, guess], [new], [*KNOWN, "z_guess"], ["m_next"])

    @property
    def dae(self) -> dict[str, ca.SX]:
        """Semi-explicit equations for ``ca.integrator(name, "idas", model.dae, ..)``.

        Keys ``t, x, u, p, ode`` and, with algebraic unknowns, ``z, alg``; without them ``"cvodes"``
        takes it too. The vector ``p`` is that of `packed`: parameters, then memory and the time of
        that memory, which stay as they are over one call. SUNDIALS in CasADi does not start anew
        where an input jumps on its grid, and fails there at tight tolerances or with algebraic
        unknowns: integrate from jump to jump, `z0` from `rhs`; `step` does.

        Raises
        ------
        UnusableInput
            The model has no states: there is nothing to integrate.
        """
        self._require_states()
        t, x, z, u, _, _, _ = self._symbols()
        packed, p, m, since = self._packed_symbols(ca.SX)
        dx, _, g = self.equations(t, x, z, u, p, m, t - since)
        found = {"t": t, "x": x, "u": u, "p": packed, "ode": dx}
        return found | {"z": z, "alg": g} if self.names.algebraic else found

    @property
    def ode(self) -> dict[str, ca.MX]:
        """As `dae` with z solved inside, starting from `names.guess`: for ``"cvodes"``, ``"rk"``.

        Raises
        ------
        UnusableInput
            The model has no states: there is nothing to integrate.
        """
        self._require_states()
        (t, x, u, _, _, _), _ = self._known()
        packed, p, m, since = self._packed_symbols(ca.MX)
        dx, _, _ = self.rhs(t, x, u, p, m, t - since, ca.DM(self.names.guess))
        return {"t": t, "x": x, "u": u, "p": packed, "ode": dx}

    def step(
        self, interval: float, plugin: str = "cvodes", options: Mapping[str, Any] | None = None
    ) -> ca.Function:
        """Return ``(t, x, u, u_next, p, m, z_guess) -> (x_next, m_next, y, z)``: an accepted step.

        A record of N + 1 samples is one call of ``step.mapaccum("run", N, ["x", "m", "z_guess"],
        ["x_next", "m_next", "z"])``. See `step_function` for `plugin` and `options`.
        """
        return step_function(self, interval, plugin, options)

    def packed(
        self,
        parameters: Mapping[str, float] | None = None,
        memory: Sequence[float] | None = None,
        since: float = 0.0,
    ) -> ca.DM:
        """Return the vector ``p`` of `dae` and `ode`: nominal where nothing is given.

        Parameters
        ----------
        parameters : mapping of str to float, optional
            Values that differ from the nominal ones, SI.
        memory : sequence of float, shape (n_m,), optional
            Virgin when not given.
        since : float
            Time at which this memory was accepted, s.
        """
        p = self.parameters(parameters)
        if not self.names.memory:
            return p
        m = self.names.virgin if memory is None else memory
        return ca.vertcat(p, ca.DM(m), since)

    def parameters(self, values: Mapping[str, float] | None = None) -> ca.DM:
        """Return the vector p, shape (n_p,), with some values changed by name."""
        found = dict(zip(self.names.parameters, self.names.nominal, strict=True))
        for name, value in (values or {}).items():
            if name not in found:
                raise unknown_name("parameter", name, self.names.name, self.names.parameters)
            found[name] = float(value)
        return ca.DM(list(found.values()))

    def save(self, file: Path) -> Path:
        """Write names and functions as JSON, all or nothing; `load` reads it back."""
        data = {
            "schema": SCHEMA,
            "casadi": ca.CasadiMeta.version(),
            "names": asdict(self.names),
            "equations": self.equations.serialize(),
            "memory_rule": self.memory_rule.serialize(),
        }
        write_atomically(Path(file), json.dumps(data, indent=1, allow_nan=False) + "\n")
        return Path(file)

    def _symbols(self) -> list[ca.SX]:
        f = self.equations
        return [ca.SX.sym(f.name_in(i), *f.size_in(i)) for i in range(f.n_in())]

    def _known(self) -> tuple[tuple[ca.MX, ...], ca.MX]:
        f = self.equations
        v = {f.name_in(i): ca.MX.sym(f.name_in(i), *f.size_in(i)) for i in range(f.n_in())}
        return tuple(v[k] for k in KNOWN), ca.MX.sym("z_guess", *v["z"].shape)

    def _packed_symbols(self, kind: Any) -> tuple[Any, Any, Any, Any]:
        n_p, n_m = len(self.names.parameters), len(self.names.memory)
        packed = kind.sym("packed", n_p + (n_m + 1 if n_m else 0))
        m, since = packed[n_p : n_p + n_m], packed[n_p + n_m] if n_m else kind(0)
        return packed, packed[:n_p], m, since

    def _require_states(self) -> None:
        if not self.names.states:
            raise UnusableInput(
                f"{self.names.name}: it has no states, so there is nothing to integrate; call rhs "
                "for the outputs and advance for the memory, sample by sample"
            )


def casadi_functions(program: Program) -> CasadiModel:
    """Return `program` as CasADi functions with named, ordered inputs and outputs.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, De, One, R, Se, Zero
    >>> from bondgraph.equations.codegen import program
    >>> with BondGraph("rc") as g:
    ...     loop, node = One("loop"), Zero("node")
    ...     _ = Se("V") >> loop >> R("R_1", 1e3)
    ...     _ = loop >> node >> C("C_1", 1e-6)
    ...     _ = node >> De("y")
    >>> model = casadi_functions(program(g))
    >>> model.rhs(x=2e-6, u=5.0, p=model.parameters())["dx"]
    DM(0.003)
    """
    labels = ["t", "x", "z", "u", "p", "m", "h"]
    v = [ca.SX.sym(n, *program.rhs.size_in(i)) for i, n in enumerate(labels)]
    dx, y = program.rhs(*v)
    g, new = program.residual(*v), program.advance(*v)
    names = FunctionNames(**{k: getattr(program, k) for k in FunctionNames.__dataclass_fields__})
    return CasadiModel(
        names,
        ca.Function("equations", v, [dx, y, g], labels, ["dx", "y", "g"]),
        ca.Function("memory_rule", v, [new], labels, ["m_next"]),
    )


def load(file: Path) -> CasadiModel:
    """Read a model that `CasadiModel.save` wrote.

    CasADi reads its own serialised functions; take files only from whom you would take a program.

    Raises
    ------
    UnusableInput
        No such file, no such JSON, or functions this CasADi cannot read.
    """
    file = Path(file)
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise UnusableInput(f"{file}: cannot be read ({error.strerror}); check the path") from error
    except ValueError as error:
        raise UnusableInput(f"{file}: is not JSON; export the model to CasADi again") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        raise UnusableInput(f"{file}: is no file of {SCHEMA}; export the model to CasADi again")
    try:
        names = FunctionNames(**{k: _frozen(v) for k, v in data["names"].items()})
        functions = [ca.Function.deserialize(data[k]) for k in ("equations", "memory_rule")]
    except (KeyError, TypeError, AttributeError, RuntimeError) as error:
        raise UnusableInput(
            f"{file}: written by CasADi {data.get('casadi')}, not readable by "
            f"{ca.CasadiMeta.version()}; export the model again"
        ) from error
    return CasadiModel(names, *functions)


def _frozen(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
