"""All trials against each other: figure, table, and in words why each one lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.effects import by_name
from identification.diagnosis.report.canvas import drawing, plain
from identification.diagnosis.report.style import AFTER, FLOOR, LOST
from identification.diagnosis.search import Trial, paired_z

ALIKE = "#8b5cf6"


@dataclass(frozen=True)
class Standing:
    """One trial in the table.

    Attributes
    ----------
    role : str
        ``winner``, ``alike``, ``lost`` or ``locates`` (an unnamed curve).
    z : float
        Standard errors by which it lies behind the best one.
    share : float
        Part of the excess misfit that it explains.
    """

    trial: Trial
    role: str
    z: float
    share: float
    why: str


def standings(d: Diagnosis) -> tuple[Standing, ...]:
    """Every trial, best held-out score first."""
    if d.nominal is None or not d.trials:
        return ()
    chosen = d.decision.chosen if d.decision else None
    ranked = sorted(
        (_same(t, chosen) for t in d.trials), key=lambda t: (not np.isfinite(t.test), t.test)
    )
    first = chosen or ranked[0]
    excess = d.nominal.chi2("test") - 1.0
    found = []
    for t in ranked:
        share = (d.nominal.chi2("test") - t.test) / excess if excess > 0 else 0.0
        z = paired_z(t.blocks, first.blocks) if t.blocks.size == first.blocks.size else float("nan")
        role, why = _why(d, t, chosen, z, share)
        found.append(Standing(t, role, z, share, why))
    return tuple(found)


def _same(t: Trial, chosen: Trial | None) -> Trial:
    """Return `t`; the chosen effect is shown as refitted on all samples."""
    return chosen if chosen is not None and t.label == chosen.label else t


def strength_shown(t: Trial) -> bool:
    """Whether one of the parameters that make the effect differs from zero at 95 %."""
    found = {e.name: e.ci95 for e in t.fit.estimates}
    return any(n in found and (found[n][0] > 0 or found[n][1] < 0) for n in t.insertion.strengths)


def _why(d: Diagnosis, t: Trial, chosen: Trial | None, z: float, share: float) -> tuple[str, str]:
    assert d.nominal is not None
    assert d.decision is not None
    if t is chosen:
        named = d.kind == "missing_physics"
        return "winner", "named" if named else "closest, but not certain enough for a name"
    if t.effect == "unknown":
        return "locates", "a curve without a name: shows where, not what"
    if any(t is x for x in d.decision.same_place):
        return "alike", "same effect, equally good here: these sensors cannot tell"
    if any(t is x for x in d.decision.rivals):
        return "alike", "as good on held-out data: not excluded"
    if not strength_shown(t):
        return "lost", "its strength does not differ from zero"
    if t.test >= 0.98 * d.nominal.chi2("test"):
        return "lost", "does not improve the held-out samples"
    if chosen is None:
        return "lost", f"explains only {100 * share:.0f} % of the misfit"
    if chosen.effect in by_name(t.effect).simpler and t.element == chosen.element:
        return "lost", f"richer, yet hardly better than {_words(chosen.effect)}"
    if t.test <= chosen.test * 1.02 and not t.home:
        return "lost", "an unusual place for it, and no clear gain over the usual one"
    if t.test <= chosen.test * 1.02:
        return "lost", "not clearly better than the simpler one"
    if z < 0.5:
        return "lost", "about as good on average, but the named one is simpler or more usual"
    factor = (t.test - 1) / max(chosen.test - 1, 0.05)
    left = f"{factor:.1f}" if factor < 10 else f"{factor:.0f}"
    return "lost", f"leaves {left} times as much misfit above the floor"


def _words(name: str) -> str:
    return name.replace("_", " ")


def title(t: Trial) -> str:
    """Text such as ``dry friction at F_v``."""
    what = "unnamed curve" if t.effect == "unknown" else _words(t.effect)
    return f"{what} at {t.element}"


def rivals_figure(d: Diagnosis, found: tuple[Standing, ...], most: int = 14) -> str:
    """Held-out misfit of the best trials, logarithmic bars from the floor."""
    assert d.nominal is not None
    shown = [s for s in found if np.isfinite(s.trial.test)][:most]
    nominal = d.nominal.chi2("test")
    colours = {"winner": AFTER, "alike": ALIKE, "lost": LOST, "locates": "#e2e8f0"}
    values = [nominal, *(s.trial.test for s in shown)]
    low = 0.9 * min(1.0, *values)
    with drawing("rivals", 0.7 + 0.26 * len(values)) as canvas:
        ax = canvas.rows(1)[0, 0]
        place = np.arange(len(shown))
        ax.barh(
            place, [s.trial.test - low for s in shown], left=low, height=0.68,
            color=[colours[s.role] for s in shown],
        )  # fmt: skip
        ax.barh(len(shown), nominal - low, left=low, height=0.68, color="#d97706")
        ax.set_xscale("log")
        ax.set_xlim(low, max(values) * (max(values) / low) ** 0.12)
        if max(values) < 10:
            ax.xaxis.set_major_formatter("{x:g}")
            ax.xaxis.set_minor_formatter("{x:g}")
        for y, v in enumerate([*(s.trial.test for s in shown), nominal]):
            ax.annotate(
                f"{v:.4g}" if v < 1e5 else f"{v:.2e}", (v, y), (4, 0), va="center", fontsize=8,
                textcoords="offset points",
            )  # fmt: skip
        ax.axvline(1.0, color=FLOOR, ls="--", lw=1.2)
        ax.set_yticks(
            [*place, len(shown)], [*(plain(title(s.trial)) for s in shown), "nominal model"]
        )
        ax.invert_yaxis()
        ax.grid(False, axis="y")
        ax.set_xlabel("held-out mean square residual over the noise floor (dashed: the floor)")
    return canvas.svg


def places_figure(d: Diagnosis) -> str:
    """Show the best share of the misfit that effects and an unnamed curve explain by place."""
    rows: dict[str, list[float]] = {}
    for s in standings(d):
        pair = rows.setdefault(s.trial.element, [0.0, 0.0])
        k = 1 if s.trial.effect == "unknown" else 0
        if np.isfinite(s.share):
            pair[k] = max(pair[k], min(s.share, 1.0))
    order = sorted(rows, key=lambda n: -max(rows[n]))
    with drawing("places", 0.8 + 0.42 * len(order)) as canvas:
        ax = canvas.rows(1)[0, 0]
        place = np.arange(len(order))
        ax.barh(
            place - 0.19,
            [100 * rows[n][0] for n in order],
            height=0.36,
            color=AFTER,
            label="best named effect",
        )
        ax.barh(
            place + 0.19,
            [100 * rows[n][1] for n in order],
            height=0.36,
            color=LOST,
            label="unnamed curve",
        )
        ax.set_yticks(place, [plain(n) for n in order])
        ax.invert_yaxis()
        ax.set_xlim(0, 100)
        ax.grid(False, axis="y")
        ax.set_xlabel("share of the misfit explained on held-out samples (%)")
        canvas.figure.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return canvas.svg
