"""The banded rotary friction damper: a dry slider behind an elastic band with free play."""

from __future__ import annotations

from bondgraph import BondGraph, C, De, R, Sf, Zero
from bondgraph.laws import AsymmetricCoulomb, Backlash


def band_brake(stiffness: float = 5e6, gap: float = 1e-3, friction: float = 1e4) -> BondGraph:
    """Return a slider of another level each way in series with a spring that has free play.

    At each reversal the band unloads, the drum turns freely until the other end takes the load,
    and the band multiplies its tension differently in the two directions: Downey et al.,
    Engineering Structures 113 (2016) 287. Measured velocity ``v``, reading force ``F``.

    Parameters
    ----------
    stiffness, gap, friction : float
        Start values: N/m, half width in m, N.
    """
    with BondGraph("band_brake") as g:
        device = Zero("device")
        Sf("v", unit="m/s", measured=True) >> device
        play = Backlash(coefficient="k", stiffness=stiffness, width=gap, size=5 * gap)
        device >> C("k", stiffness=stiffness, unit="N/m", law=play)
        device >> R("c", 2e4, unit="N*s/m", law=AsymmetricCoulomb(friction, friction))
        device >> De("F", unit="N")
    return g
