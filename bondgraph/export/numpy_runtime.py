"""The part of a printed NumPy module that is the same for every model: Newton and the time step."""

from __future__ import annotations

__all__ = ["RUNTIME"]

RUNTIME = '''
class NoConvergence(ArithmeticError):
    """Newton's method found no solution: take a smaller step, or a better guess for z."""


def newton(system, start, where):
    """Solve ``system(y)[0] = 0``; ``system(y, True)[1]`` is the exact Jacobian.

    A row is solved when its residual is 1e-12 of its own terms, so units do not matter. Steps are
    halved up to four times; the best of them is taken.
    """
    y = np.array(start, float)
    if y.size == 0:
        return y
    residual, matrix = system(y.tolist(), True)
    merit = np.inf
    for _ in range(60):
        r, slopes = np.array(residual), np.array(matrix)
        rows = np.abs(slopes).max(axis=1)
        if not (np.isfinite(r).all() and np.isfinite(slopes).all() and rows.all()):
            break
        try:
            change = np.linalg.solve(slopes / rows[:, None], -r / rows)
        except np.linalg.LinAlgError:
            break
        terms = np.abs(slopes) @ np.maximum(np.abs(y), np.abs(change))
        terms[terms == 0.0] = 1.0
        merit = float(np.max(np.abs(r) / terms))
        if merit <= 1e-12:
            return y + change
        best = np.inf
        for share in (1.0, 0.5, 0.25, 0.125, 0.0625):
            try:
                tried = float(np.max(np.abs(system((y + share * change).tolist())[0]) / terms))
            except ArithmeticError:
                continue
            if tried < best:
                best, chosen = tried, share
            if tried <= (1.0 - 0.5 * share) * merit:
                break
        if best == np.inf:
            break
        y = y + chosen * change
        residual, matrix = system(y.tolist(), True)
    if merit <= 1e-8:
        return y
    raise NoConvergence(
        f"{where}: no solution of the equations found; their residual is {merit:.1e} of their "
        "terms. Take more substeps or a better guess"
    )


def _floats(values, names, what):
    found = np.asarray(values, float).ravel()
    if found.size != len(names):
        raise ValueError(f"{what} needs {len(names)} values {names}, not {found.size}")
    if not np.isfinite(found).all():
        raise ValueError(f"{what} holds a value that is not finite")
    return found.tolist()


def _arguments(t, x, u, p, memory, h):
    return (
        float(t), _floats(x, STATES, "x"), _floats(u, INPUTS, "u"), _floats(p, PARAMETERS, "p"),
        _floats(memory, MEMORY, "memory"), float(h),
    )


def _unknowns(t, x, u, p, m, h, guess):
    n = len(STATES)

    def system(z, slopes=False):
        g = evaluate(t, x, z, u, p, m, h)[2]
        return g, [row[n:] for row in jacobian(t, x, z, u, p, m, h)[n:]] if slopes else None

    return newton(system, guess, f"algebraic unknowns at t = {t:g} s").tolist()


def unknowns(t, x, u, p=NOMINAL, memory=VIRGIN, h=0.0, guess=GUESS):
    """Return the algebraic unknowns z that make the residuals zero, shape (n_z,)."""
    given = _arguments(t, x, u, p, memory, h)
    return np.array(_unknowns(*given, _floats(guess, ALGEBRAIC, "guess")))


def _evaluated(part, t, x, u, p, memory, h):
    t, x, u, p, m, h = _arguments(t, x, u, p, memory, h)
    z = _unknowns(t, x, u, p, m, h, GUESS)
    return np.array(evaluate(t, x, z, u, p, m, h)[part], float)


def rates(t, x, u, p=NOMINAL, memory=VIRGIN, h=0.0):
    """Return dx/dt at time t (s), shape (n_x,); h is the time since the memory, s."""
    return _evaluated(0, t, x, u, p, memory, h)


def outputs(t, x, u, p=NOMINAL, memory=VIRGIN, h=0.0):
    """Return the outputs, shape (n_y,)."""
    return _evaluated(1, t, x, u, p, memory, h)


def advance(t, x, u, p=NOMINAL, memory=VIRGIN, h=0.0):
    """Return the memory after a step that ended here has been accepted, shape (n_m,)."""
    return _evaluated(3, t, x, u, p, memory, h)


# Alexander's third-order SDIRK: L-stable, its last stage is the end of the step
# (R. Alexander, SIAM J. Numer. Anal. 14 (1977) 1006).
_G = 0.43586652150845899942
_STAGES = (
    (_G,),
    (0.5 * (1.0 - _G), _G),
    (-0.25 * (6.0 * _G * _G - 16.0 * _G + 1.0), 0.25 * (6.0 * _G * _G - 20.0 * _G + 5.0), _G),
)


def step(t, h, x, z, u0, u1, p, m):
    """Return state and unknowns h seconds later; u runs straight from u0 to u1, m stands still."""
    n, start, slopes = len(STATES), np.array(x, float), []
    y = np.concatenate([start, np.array(z, float)])
    for weights in _STAGES:
        share = sum(weights)
        ti, hi = t + share * h, share * h
        u = [a + share * (b - a) for a, b in zip(u0, u1)]
        base = start + h * sum((w * k for w, k in zip(weights, slopes)), np.zeros(n))

        def system(v, wanted=False, ti=ti, hi=hi, u=u, base=base):
            dx, _, g, _ = evaluate(ti, v[:n], v[n:], u, p, m, hi)
            r = np.array(v, float)
            r[:n] -= base + h * _G * np.array(dx, float)
            r[n:] = g
            if not wanted:
                return r, None
            matrix = np.array(jacobian(ti, v[:n], v[n:], u, p, m, hi), float)
            matrix[:n] *= -h * _G
            matrix[range(n), range(n)] += 1.0
            return r, matrix

        y = newton(system, y, f"step of {h:g} s from t = {t:g} s")
        slopes.append((y[:n] - base) / (h * _G))
    return y[:n].tolist(), y[n:].tolist()


def _table(time, inputs):
    unknown = set(inputs) - set(INPUTS)
    if unknown:
        raise KeyError(f"no input {sorted(unknown)}; the inputs are {INPUTS}")
    table = np.empty((time.size, len(INPUTS)))
    for i, name in enumerate(INPUTS):
        if name in inputs:
            table[:, i] = inputs[name]
        elif name == "one":
            table[:, i] = 1.0
        elif name.startswith("ramp") and name[4:].isdigit() or name == "ramp":
            table[:, i] = np.linspace(0.0, 1.0, time.size) ** int(name[4:] or 1)
        elif name not in INPUT_RATES:
            raise KeyError(f"input {name!r} is missing; the inputs are {INPUTS}")
    if not np.isfinite(table[:, [n in inputs for n in INPUTS]]).all():
        raise ValueError("an input holds a value that is not finite")
    return table


def simulate(time, inputs, p=NOMINAL, x=START, memory=VIRGIN, substeps=1):
    """Simulate over `time` (shape (N,), s, rising), inputs straight between the samples.

    ``inputs`` maps names to arrays of shape (N,); input rates that are missing are the slopes
    between samples. The memory is replaced only after an accepted step. Returns a dictionary of
    arrays of shape (N,) by output and state name, and the last memory under ``"memory"``.
    """
    time = np.asarray(time, float)
    if time.ndim != 1 or time.size < 2 or not (np.diff(time) > 0.0).all():
        raise ValueError("time needs at least two samples that rise")
    table = _table(time, inputs)
    rows = table.tolist()
    slope = np.diff(table, axis=0) / np.diff(time)[:, None]
    rate_of = [
        (INPUTS.index(r), INPUTS.index(r[2:])) for r in INPUT_RATES if r not in inputs
    ]

    def at(k, share):
        k, share = (k, share) if k < time.size - 1 else (k - 1, 1.0)
        row = [a + share * (b - a) for a, b in zip(rows[k], rows[k + 1])]
        for i, j in rate_of:
            row[i] = float(slope[k, j])
        return row

    t, x, u, p, m, _ = _arguments(time[0], x, at(0, 0.0), p, memory, 0.0)
    z = _unknowns(t, x, u, p, m, 0.0, GUESS)
    _, y, _, m = evaluate(t, x, z, u, p, m, 0.0)
    found = [[*y, *x]]
    for k in range(time.size - 1):
        h = float(time[k + 1] - time[k]) / substeps
        for i in range(substeps):
            t = float(time[k]) + i * h
            u0, u1 = at(k, i / substeps), at(k, (i + 1) / substeps)
            x, z = step(t, h, x, z, u0, u1, p, m)
            _, y, _, m = evaluate(t + h, x, z, u1, p, m, h)
        found.append([*y, *x])
    columns = np.array(found).T
    shown = dict(zip((*STATES, *OUTPUTS), (*columns[len(OUTPUTS) :], *columns[: len(OUTPUTS)])))
    return {**shown, "memory": np.array(m, float)}
'''
"""Python source; it needs ``np``, the constants, ``evaluate`` and ``jacobian``."""
