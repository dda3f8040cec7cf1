"""Relations blind to each class of ports, made from the graph, each refitted on its own.

With more sensors than latent signals a part of the residual cannot come from a port whatever its
law is. If the mismatch sits at that port alone, this part is noise once all parameters are fitted
to it and to nothing else; every other relation stays above the floor. No law has to be known
(analytical redundancy: Chow and Willsky, IEEE TAC 29 (1984) 603; from bond graphs: Samantaray and
Ould Bouamama, Model-based Process Supervision, 2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.localisation.relations.latent import (
    LatentModel,
    Sampled,
    latent_model,
)
from identification.diagnosis.localisation.relations.refit import (
    BlindProblem,
    Refitted,
    blind_refit,
)
from identification.diagnosis.localisation.relations.whitening import blind_filter
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.port_response import Probes, probes
from identification.estimation.brief import brief, carried
from identification.estimation.single_record import Fit
from identification.estimation.threads import single_threaded
from identification.report.numbers import times_noise
from identification.study.residual import (
    Point,
    ResidualEvaluation,
    evaluate,
    start_point,
    windows,
)

FLOOR_ERROR = 0.03
"""Relative standard deviation of the square of a floor that was itself estimated."""
LIMIT = 5.0
LEFT = 1e-6
"""Part of the nominal excess that discretisation may leave in the relation of the true port."""
AMPLE = 30.0
CLEAR = 5.0
FIRST = 2
STEPS = 12
FOLLOWED = 2
NEAR, FAR = 3.0, 30.0
"""Times the least misfit up to which relations are followed, and the first of them."""
FALLS = 0.5
"""Part of its first misfit below which one of the first is followed in any case."""
GROSS = 1e4
ONE_CLOCK = 2e-3
"""Relative difference of the recordings' rates up to which one filter serves all of them."""
PARALLEL = 1e-9


@dataclass(frozen=True)
class BlindRelation:
    """The residual as the relation blind to one class of ports sees it.

    Attributes
    ----------
    ports : tuple of str
        Elements that the relation cannot see.
    before : float
        Training misfit at the nominal parameters; 1 is the noise floor, here and below.
    train, test : float
        Training and held-out misfit after the relation's own refit.
    z : float
        Training misfit above the floor, in standard deviations.
    freedom : float
        Degrees of freedom on training data.
    nominal : float
        Training misfit of the nominal fit, all of the residual.
    sides : int
        Latent signals that it is blind to: two for a two-port, whose sides may change together.
    port : str
        The one of `ports` whose signal it is blind to; the others move the readings likewise.
    theta : ndarray
        Unknowns of the fit as this relation sees them.
    """

    ports: tuple[str, ...]
    before: float
    train: float
    test: float
    z: float
    freedom: float
    nominal: float
    sides: int = 1
    port: str = ""
    theta: Array = field(default_factory=lambda: np.zeros(0), compare=False, repr=False)

    @property
    def decided(self) -> bool:
        """Whether anything is known: where a port could explain every reading, nothing is."""
        return bool(np.isfinite(self.train))

    @property
    def left(self) -> float:
        """Part of the nominal excess over the floor that the ports do not explain."""
        return max(self.train - 1.0, 0.0) / max(self.nominal - 1.0, 1e-12)

    @property
    def compatible(self) -> bool:
        """Whether the mismatch may sit at these ports alone."""
        return not self.decided or self.z < LIMIT or (self.left < LEFT and self.nominal > 2.0)

    @property
    def words(self) -> str:
        """One sentence."""
        names = ", ".join(self.ports)
        if not self.decided:
            return f"blind to {names}: nothing is left that could tell, so that it is not excluded"
        left, held_out = times_noise(self.train), times_noise(self.test)
        said = f"blind to {names}: {left:.3g} times the noise (held out {held_out:.3g})"
        if self.compatible:
            return f"{said}; the mismatch may sit there alone"
        return f"{said}, {self.z:.3g} standard errors above it; something is missing elsewhere"


@single_threaded
def blind_relations(
    fit: Fit, structure: Isolability, *, probed: Probes | None = None, steps: int = STEPS
) -> tuple[BlindRelation, ...]:
    """Relations blind to every class of ports, most compatible first.

    Parameters
    ----------
    fit : Fit
        The nominal fit.
    structure : Isolability
        Classes of ports; elements it does not know stand alone.
    probed : Probes, optional
        The fitted model with its ports probed, if already made.
    steps : int
        Largest number of Gauss-Newton steps of each refit.

    Returns
    -------
    tuple of BlindRelation
        Empty where there is none; `no_relation` says why. Also empty if the fit is broken. Ports
        that could explain every reading are at the end, not `decided`.

    Notes
    -----
    Of a long record the first samples are looked at; places that they leave in question, and the
    most likely ones in any case, are held against all of it.

    A refit is local. On three identical masses it found single sites with a nominal misfit up
    to 50 dB above the floor; grosser ones may stop short of it, and then no port is compatible.
    """
    probed = probed if probed is not None else probes(fit)
    if no_relation(fit, probed):
        return ()
    model, begun = latent_model(probed), _brief(fit)
    found, silent = _followed(begun, model, _classes(model, structure), steps)
    if begun is fit:
        return (*(f.relation for f in found), *silent)
    kept, excluded, lost = _on_all(fit, model, found, steps)
    return (*(f.relation for f in (*kept, *excluded)), *silent, *lost)


def _followed(
    fit: Fit, model: LatentModel, classes: Sequence[tuple[str, ...]], steps: int
) -> tuple[list[_Looked], list[BlindRelation]]:
    """Refit every relation a little and those near the floor to their end, and what says nothing.

    What is near the floor comes first.
    """
    start = evaluate(fit.problem, fit.point)
    if not np.isfinite(start.residual).all() or not start.residual.size:
        return [], []
    found, silent = [], []
    for ports in classes:
        heard = [n for n in ports if _hears(model.sampled(n, fit.point.theta))]
        seen = _seen(fit, model, start, heard)
        done = None if seen is None else _refitted(seen, start, FIRST)
        if seen is not None and done is not None:
            found.append(_Looked(ports, heard, seen, done, start))
        elif heard:
            sides = len(model.ports[heard[0]]) or 1
            silent.append(_undecided(ports, float(np.mean(start.residual**2)), sides))
    found.sort(key=lambda f: f.done.train)
    # only those that may yet reach the floor are followed to their end
    for i in _near(found):
        if found[i].done.moving:
            found[i] = found[i].from_there(found[i].done.theta, steps)
    if not any(f.relation.compatible for f in found):
        # a gross mismatch may have dragged the nominal fit too far: begin where the model did
        declared = start_point(fit.problem).theta
        for i, f in [(i, found[i]) for i in _near(found) if i < FOLLOWED]:
            again = f.from_there(declared, steps)
            found[i] = again if again.done.train < f.done.train else f
    return sorted(found, key=lambda f: f.done.train), silent


def _near(found: Sequence[_Looked]) -> list[int]:
    """Return the relations that may reach the floor; the first have the least.

    A gross mismatch drags all parameters along: then even the true one begins far off, but falls.
    """
    best = found[0].done.train if found else 1.0
    limits = [(FAR if i < FOLLOWED else NEAR) * max(best, 1.0) for i in range(len(found))]
    falls = [i < FOLLOWED and f.done.train < FALLS * f.done.before for i, f in enumerate(found)]
    return [i for i, f in enumerate(found) if f.done.train < limits[i] or falls[i]]


def _on_all(
    fit: Fit, model: LatentModel, found: Sequence[_Looked], steps: int
) -> tuple[list[_Looked], list[_Looked], list[BlindRelation]]:
    """Hold what the first samples leave in question against all of them.

    Returns
    -------
    kept : list of _Looked
        On all samples, the most compatible first.
    excluded : list of _Looked
        On the first samples, which exclude them.
    lost : list of BlindRelation
        What cannot be refitted to all samples: nothing is known.
    """
    start, near = evaluate(fit.problem, fit.point), _near(found)
    if not np.isfinite(start.residual).all():
        return [], [], []
    nominal = float(np.mean(start.residual**2))
    kept, excluded, lost = [], [], []
    for i, f in enumerate(found):
        theta = carried(f.done.theta, f.seen.problem, fit.problem)
        if i not in near and not f.relation.compatible:
            excluded.append(replace(f, done=replace(f.done, theta=theta)))
            continue
        seen = _seen(fit, model, start, f.heard)
        done = None if seen is None else _refitted(seen, start, steps, theta)
        if seen is not None and done is not None:
            kept.append(_Looked(f.ports, f.heard, seen, done, start))
        else:
            lost.append(_undecided(f.ports, nominal, f.seen.sides))
    return sorted(kept, key=lambda f: f.done.train), excluded, lost


@dataclass(frozen=True, eq=False)
class _Looked:
    """One class of ports, those heard, the fit as its relation sees it, how that was refitted."""

    ports: tuple[str, ...]
    heard: Sequence[str]
    seen: BlindProblem
    done: Refitted
    start: ResidualEvaluation

    def from_there(self, theta: Array, steps: int) -> _Looked:
        """Refit again from other unknowns; itself where that fails."""
        done = _refitted(self.seen, self.start, steps, theta)
        return self if done is None else replace(self, done=done)

    @property
    def relation(self) -> BlindRelation:
        done, spread = self.done, np.hypot(np.sqrt(2.0 / self.done.count), FLOOR_ERROR)
        away = float((done.train - 1.0) / spread)
        nominal = float(np.mean(self.start.residual**2))
        return BlindRelation(
            self.ports, done.before, done.train, done.test, away, done.count, nominal,
            self.seen.sides, self.seen.port, done.theta,
        )  # fmt: skip


def _brief(fit: Fit) -> Fit:
    """Return the fit on the first samples of a long record."""
    shorter = brief(fit.problem)
    if shorter is None:
        return fit
    theta = carried(fit.point.theta, fit.problem, shorter)
    point = Point(theta, fit.point.states[: len(windows(shorter))])
    return replace(fit, problem=shorter, point=point, simulated=fit.simulated[: shorter.data.n])


def _undecided(ports: tuple[str, ...], nominal: float, sides: int) -> BlindRelation:
    nothing = float("nan")
    return BlindRelation(ports, nothing, nothing, nothing, nothing, 0.0, nominal, sides)


def no_relation(fit: Fit, probed: Probes | None = None) -> str:
    """Why no relation can be made; empty where some can."""
    n_y = len(fit.problem.data.names)
    if n_y < 2:
        return (
            f"{n_y} sensor: a latent signal at any port can explain all of the residual; a second "
            "sensor gives relations that locate without a law"
        )
    data = fit.problem.data
    if any(abs(data.step(w) / data.dt - 1.0) > ONE_CLOCK for w in windows(fit.problem)):
        return "the recordings' rates differ: one filter for all of them cannot be blind to a port"
    probed = probed if probed is not None else probes(fit)
    if probed.dynamics.lure is None:
        return f"{fit.problem.graph.name} is not linear up to scalar laws: no transfer functions"
    return ""


def more_than_one_site(relations: tuple[BlindRelation, ...]) -> bool:
    """Whether no single class of ports explains the mismatch: at least two sites, or moving ones.

    False without relations, and where the mismatch is so gross (40 dB above the floor) that a
    refit may have stopped short: then nothing is known.
    """
    return (
        any(r.decided for r in relations)
        and relations[0].nominal < GROSS
        and not any(r.compatible for r in relations if r.decided)
    )


def _classes(model: LatentModel, structure: Isolability) -> list[tuple[str, ...]]:
    """Classes of the structure with a probed port; ports it does not know join a parallel one.

    Two-ports whose sides may change together stand alone: they explain more than their classes.
    """
    classes = [tuple(n for n in c if n in model.ports) for c in structure.classes]
    classes = [c for c in classes if c]
    listed = {n for c in classes for n in c}
    theta = model.probes.fit.point.theta
    angles = np.geomspace(1e-3, 2.0, 9)
    for name in model.ports:
        if name in listed:
            continue
        own = model.sampled(name, theta).response(angles)
        for i, members in enumerate(classes):
            if _parallel(own, model.sampled(members[0], theta).response(angles)):
                classes[i] = (*members, name)
                break
        else:
            classes.append((name,))
    wide = [(n,) for c in classes for n in c if len(model.ports[n]) > 1]
    alone = {n for (n,) in wide}
    single = [tuple(n for n in c if n not in alone) for c in classes]
    return [*(c for c in single if c), *wide]


def _parallel(a: Array, b: Array) -> bool:
    """Whether two single columns point the same way at every frequency."""
    if a.shape[2] != 1 or b.shape[2] != 1:
        return False
    inner = np.abs(np.sum(a[:, :, 0].conj() * b[:, :, 0], axis=1))
    both = np.linalg.norm(a[:, :, 0], axis=1) * np.linalg.norm(b[:, :, 0], axis=1)
    return bool((both > 0).any() and (inner >= (1 - PARALLEL) * both).all())


def _hears(sampled: Sampled) -> bool:
    """Whether a latent signal reaches any reading."""
    return bool(np.abs(sampled.response(np.geomspace(1e-3, 3.0, 9))).max(initial=0.0) > 0)


def _seen(
    fit: Fit, model: LatentModel, start: ResidualEvaluation, ports: Sequence[str]
) -> BlindProblem | None:
    """Return the fit as the relation sees it; None where the ports explain all.

    Responses of a class are parallel, but one port may have to move much more than another for the
    same reading: the one that has to move least stands for all.
    """
    least: tuple[float, str, Array] | None = None
    for port in ports:
        try:
            sampled = model.sampled(port, fit.point.theta)
            size = ample_size(fit, sampled, start.y)
            if size is not None and not (least and least[0] <= float(size.max())):
                blind_filter(sampled, size)
                least = float(size.max()), port, size
        except (np.linalg.LinAlgError, BondsightError):
            continue
    if least is None:
        return None
    _, port, size = least
    return BlindProblem(
        fit, lambda theta: blind_filter(model.sampled(port, theta), size), port, size.size
    )


def _refitted(
    seen: BlindProblem, start: ResidualEvaluation, steps: int, theta: Array | None = None
) -> Refitted | None:
    try:
        done = blind_refit(seen, start, steps, theta)
    except (np.linalg.LinAlgError, BondsightError):
        return None
    return done if np.isfinite(done.train) else None


def ample_size(fit: Fit, sampled: Sampled, y: Array) -> Array | None:
    """Return a deviation of the latent signal ample for the residual beside `y` to come from it."""
    n_y, k = sampled.d.shape
    mask = fit.problem.data.mask("train")
    n = int(mask.sum())
    # windows are consecutive; for a size their joints do not matter
    left = (fit.problem.data.readings - y)[mask] / fit.problem.data.floor
    taper = np.hanning(n)
    spectrum = np.fft.rfft(left * (taper / np.sqrt(np.sum(taper**2)))[:, None], axis=0)[2:]
    angles = 2 * np.pi * np.arange(2, spectrum.shape[0] + 2) / n
    power = np.linalg.norm(spectrum, axis=1)
    picked = np.sort(np.argsort(power)[::-1][:200])
    g, seen, power = sampled.response(angles[picked]), spectrum[picked], power[picked]
    if np.linalg.matrix_rank(np.abs(g).sum(axis=0) > 0) == 0:
        return None
    if all(np.linalg.matrix_rank(one) >= n_y for one in g[:: max(1, len(g) // 8)]):
        return None
    sizes = np.ones(k)
    for j in range(k):
        strength = np.linalg.norm(g[:, :, j], axis=1)
        along = np.abs(np.einsum("fy,fy->f", g[:, :, j].conj(), seen))
        sound = (strength > 0) & (power > CLEAR) & (along > 0.5 * strength * power)
        needed = along[sound] / strength[sound] ** 2
        least = CLEAR / strength.max()
        sizes[j] = AMPLE * max(float(np.max(needed, initial=0.0)), least)
    return sizes
