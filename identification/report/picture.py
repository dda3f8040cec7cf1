"""A drawn figure: shows itself in a notebook, goes into a page, is saved as a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bondgraph.support.errors import UnusableInput
from bondgraph.support.whole_file import write_atomically


@dataclass(frozen=True)
class Picture:
    """A figure as SVG.

    Attributes
    ----------
    svg : str
        One ``<svg>`` element without prolog or scripts.
    caption : str
        What it shows, in words.
    """

    svg: str
    caption: str = ""

    def save(self, path: str | Path) -> Path:
        """Write an SVG file, all or nothing; returns its path."""
        target = Path(path)
        if target.suffix.lower() != ".svg":
            raise UnusableInput(f"{target.name}: pictures are saved as .svg; name it so")
        write_atomically(target, self.svg)
        return target

    def _repr_svg_(self) -> str:
        """Return the figure for notebooks."""
        return self.svg

    def __repr__(self) -> str:
        """Return the caption."""
        return f"Picture({self.caption!r})"
