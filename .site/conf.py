"""The documentation site: Sphinx with MyST and numpydoc. `build.py` lays out its pages and calls Sphinx."""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import historysim

project = "historysim"
author = copyright = "The historysim developers"  # noqa: A001 - the name that Sphinx reads
version = release = historysim.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc", "mathml"]
autosummary_generate = False

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
# a README starts where its folder's subject starts
suppress_warnings = ["myst.header"]

autodoc_typehints = "none"  # numpydoc's text has the types, with units
autodoc_default_options = {"members": True}
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_theme = "furo"
html_title = f"historysim {release}"
html_theme_options = {"navigation_with_keys": True}
html_static_path = [str(Path(__file__).parent / "static")]
html_css_files = ["site.css"]
html_copy_source = False
html_math_renderer = "mathml"

default_role = "py:obj"  # `name` in a docstring: a link where the site has that name, else code


def _bars(app, what, name, of, options, lines):  # noqa: ARG001 - the arguments that Sphinx passes
    """Keep |T| in a docstring: bars are absolute values there, and no substitutions."""
    lines[:] = [re.sub(r"(?<!\\)\|(?=\S)|(?<=\S)(?<!\\)\|", r"\\|", line) for line in lines]


def _toml(app, what, name, of, options, lines):  # noqa: ARG001 - the arguments that Sphinx passes
    """Set examples in TOML as code, before numpydoc reads them."""
    begin = next(
        (
            at + 1
            for at, line in enumerate(lines)
            if lines[at - 1 : at + 1] == ["Examples", "--------"]
        ),
        None,
    )
    if begin is None or not lines[begin].startswith("["):
        return
    end = (
        next(
            (at for at in range(begin, len(lines)) if lines[at] and set(lines[at]) == {"-"}),
            len(lines) + 1,
        )
        - 1
    )
    lines[begin:end] = [".. code-block:: toml", "", *(f"    {line}" for line in lines[begin:end])]


def setup(app):
    """Connect what the docstrings need."""
    app.connect("autodoc-process-docstring", _toml, priority=400)
    app.connect("autodoc-process-docstring", _bars, priority=900)
