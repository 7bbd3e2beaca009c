"""Sphinx configuration of the documentation: `make docs`."""

import os
from importlib.metadata import version as installed

project = "relpos-env"
author = "The relpos-env developers"
copyright = "2026, the relpos-env developers"
version = release = installed("relpos-env")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.intersphinx",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_click",
    "sphinx_copybutton",
]
html_theme = "furo"
html_title = f"relpos-env {release}"
html_static_path = ["static"]
html_css_files = ["wide.css"]
templates_path: list[str] = []
exclude_patterns = ["images"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4
nb_execution_raise_on_error = True
autodoc_member_order = "bysource"
autodoc_typehints = "description"
default_role = "code"
copybutton_prompt_text = r"\$ |>>> "
copybutton_prompt_is_regexp = True
# Only where the network may be used: a page that cannot be fetched would be a warning.
intersphinx_mapping = (
    {
        "gymnasium": ("https://gymnasium.farama.org", None),
        "pettingzoo": ("https://pettingzoo.farama.org", None),
    }
    if os.environ.get("DOCS_ONLINE")
    else {}
)
