"""Export of equations to other notations."""

from bondgraph.export.latex import latex as latex
from bondgraph.export.latex import ordered_latex as ordered_latex
