"""Where in the recording the model fails: times, frequencies, amplitudes, speeds, history."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from identification.diagnosis.localisation.recording import Region as Region
from identification.diagnosis.localisation.recording import where
from identification.diagnosis.screening.port_history import FittedModel
from identification.estimation.single_record import Fit


def regions(
    fit: Fit, scene: FittedModel | None = None, places: Iterable[str] = ()
) -> tuple[Region, ...]:
    """Regions in which `fit` fails, most concentrated first.

    Parameters
    ----------
    fit : Fit
    scene : FittedModel, optional
        Gives the variables of every port; only the commands are looked at without it.
    places : iterable of str
        Elements under suspicion, in whose variables a region is told first.
    """
    if scene is None:
        return where(fit, None, places)
    # the search may have worked on thinned samples: then its own fit goes with its histories
    same = scene.data.n == fit.problem.data.n
    return where(fit if same else scene.nominal, scene.past, places)


def summary(found: Sequence[Region]) -> tuple[str, ...]:
    """Sentences for the regions that stand out."""
    return tuple(str(r) for r in found if r.density > 1.3)
