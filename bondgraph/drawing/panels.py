"""Axes of one figure as an array; where a cell of a notebook ends with it, it shows the figure."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

PIXELS = 100
"""Dots per inch of what a notebook shows."""


class Panels(np.ndarray):
    """Matplotlib axes of one figure, as an array of objects; a notebook shows the figure.

    Attributes
    ----------
    figure : matplotlib Figure
        What they are parts of: `figure.savefig("fit.png")` writes it to a file.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> panels = Panels.of(Figure().subplots(2, 1))
    >>> panels
    <Panels: 2 axes; .figure.savefig(file) writes them>
    """

    @classmethod
    def of(cls, axes: Any) -> Panels:
        """Return the axes that `Figure.subplots` made."""
        return np.asarray(axes, dtype=object).view(cls)

    @property
    def figure(self) -> Any:
        """The figure that the axes are parts of."""
        return self.flat[0].figure

    def __repr__(self) -> str:
        """Say what it is; the addresses of the axes in memory say nothing."""
        shape = " x ".join(map(str, self.shape))
        return f"<Panels: {shape} axes; .figure.savefig(file) writes them>"

    __str__ = __repr__

    def _repr_png_(self) -> bytes:
        made = io.BytesIO()
        self.figure.savefig(made, format="png", dpi=PIXELS)
        return made.getvalue()
