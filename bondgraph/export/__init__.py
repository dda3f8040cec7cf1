"""Export of equations to other notations and tools.

Each file is one target and imports what it needs when it is called; here are those that need
nothing but SymPy.
"""

from bondgraph.export.latex import latex as latex
from bondgraph.export.latex import ordered_latex as ordered_latex
from bondgraph.export.latex_document import document as document
