"""One or more operators of every kind, for the tests that hold for all of them."""

from __future__ import annotations

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    DeadZone,
    MaxwellResistiveCapacitor,
    Operator,
    PrandtlIshlinskii,
)

PI = PrandtlIshlinskii((0.0, 0.3, 1.0, 2.5), (1.2, 0.6, -0.4, 0.9))
ZONES = DeadZone((-2.0, -0.5, 0.0, 0.7, 3.0), (0.3, -0.2, 1.0, 0.5, -0.8))
EXAMPLES: dict[str, Operator] = {
    "prandtl_ishlinskii": PI,
    "prandtl_ishlinskii linear": PrandtlIshlinskii((0.0,), (2.0,)),
    "dead_zone": ZONES,
    "ang": Ang(PI, ZONES),
    "ang_inverse": Ang(PI, ZONES).inverse(),
    "al_janaideh": AlJanaideh(q=1.0, c=1.5, sigma=0.4, alpha=0.5, beta=0.3, count=6),
    "maxwell_resistive_capacitor": MaxwellResistiveCapacitor((2.0, 1.0, 0.5), (0.4, 0.5, 1.2)),
}
