"""Print a fit, its judgement and its profiles."""

from __future__ import annotations

from models import rough_positioner  # type: ignore[import-not-found]
from vocabulary import (  # type: ignore[import-not-found]
    LogNormal,
    Recording,
    Study,
    Vary,
    estimate,
    from_estimation,
    judge,
    profiles,
)

record = Recording.read("none.csv", map={"F": "F", "x": "x_um"})
study = Study(rough_positioner(), record, free=("m", Vary("d", prior=LogNormal(4.0, 3.0)), "k"))
for method in ("single_shooting", "multiple_shooting", "prediction_error"):
    made = estimate(study, method)
    print(method, made.status.name, f"cost {made.cost:.10g}")
    print("  trace", *(f"{c:.8g}" for c in made.trace))
    for e in (*made.estimates, *made.nuisances):
        print(f"  {e.name} = {e.value:.10g} {e.unit}", *(f"{v:.8g}" for v in e.ci95))
    for part in ("train", "test"):
        print(f"  {part}", *(f"{n} {v:.8g}" for n, v in made.rmse(part).items()))
    for note in made.notes:
        print("  note", note)
    if method == "single_shooting":
        print(judge(made))
        for p in profiles(from_estimation(made), ["m", "k"], jobs=1):
            print(f"  profile {p.name}: {p.shape}, {p.status}", *(f"{v:.8g}" for v in p.interval))
