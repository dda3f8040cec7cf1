"""How `make docs` builds these pages."""

from __future__ import annotations

import sys
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

project = "Bondsight"
author = copyright = "Bondsight contributors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = "Bondsight"
exclude_patterns = ["_build"]
myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
napoleon_google_docstring = False
napoleon_use_ivar = True
default_role = "py:obj"
autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"
autodoc_class_signature = "mixed"


def _written(app: Sphinx) -> None:
    from docs.catalogue_pages import write_catalogue
    from docs.public_names import write_reference
    from docs.written_pages import write_commands, write_models

    write_commands(HERE / "reference" / "commands.md")
    write_models(HERE / "reference" / "models")
    write_reference(HERE / "reference" / "api")
    write_catalogue(HERE / "reference" / "effects")


def setup(app: Sphinx) -> None:
    """Write the pages that follow from the code before anything is read."""
    app.connect("builder-inited", _written)
