"""An effort of constant size against every flow, which holds a flow at rest up to that size."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.laws import Coulomb, Law
from identification.diagnosis.catalogue.effect import Effect, Hint
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import at_least


class ConstantLevel(Effect):
    """What friction does to a motion and brushes to a current; abstract."""

    kind = "dissipative"
    laws = (Coulomb,)
    weights = ("F_c",)

    def made(self, at: Site) -> Law:
        """Coulomb law beside the linear one."""
        return Coulomb(0.3 * _effort(at), unit=at.units[0])

    def tried(self, at: Site, law: Law, hint: Hint | None) -> Sequence[Values]:
        """Return two levels: along a bent nominal model the screening may see next to nothing."""
        effort = _effort(at)
        seen = 0.05 if hint is None else at_least(hint.weights[0] / effort, 0.02)
        return [{"F_c": level * effort} for level in (0.3, seen)]


def _effort(at: Site) -> float:
    return at_least(at.past.swing, 1e-12)
