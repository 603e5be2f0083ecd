"""Sphinx: pages in MyST; commands, scene keys and shortcuts are written from the code first.

``sphinx-build -W docs out/docs`` also runs the gallery; ``-D plot_gallery=0`` leaves that out.
"""

import re
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from generated import write_all  # noqa: E402

project, author, copyright = "Fingertap", "The Fingertap developers", "The Fingertap developers"
extensions = [
    "mathml",
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["amsmath", "dollarmath", "deflist"]
html_math_renderer = "mathml"
myst_heading_anchors = 3
exclude_patterns = ["gallery/**", "plugin-example/**", "reference/generated/**"]
html_theme = "pydata_sphinx_theme"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False}
html_static_path, html_css_files = ["_static"], ["tables.css"]
html_title = "Fingertap"
html_show_sourcelink = False
smartquotes = False  # --set is not a dash
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "description"
nitpicky = False

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "auto_gallery",
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "write_computation_times": False,  # pages that load scripts from elsewhere
    "abort_on_example_error": True,
    "image_scrapers": ("matplotlib",),
}

write_all(HERE / "reference" / "generated")

ENTRY = re.compile(r"(\w[\w, ]*) : (.*)")


def readable(app: object, what: str, name: str, of: object, options: object, lines: Any) -> None:
    """Make lists of a docstring's lines ``name : what it is``, and keep |x| what it is."""
    if what == "attribute" and lines:  # what is before a colon in its first line is not its type
        lines[0] = lines[0].replace(": ", " \N{EN DASH} ")
    end = next((i - 1 for i, line in enumerate(lines) if set(line) == {"-"}), len(lines))
    following = [*lines[1:end], ""]
    found: list[str] = []
    listing = False
    for line, after in zip(lines[:end], following, strict=False):
        entry = ENTRY.fullmatch(line)
        if entry and not (after[:1].strip() and ENTRY.fullmatch(after) is None):
            found += [*([] if listing else [""]), f"- {entry[1]}: {entry[2]}"]
            listing = True
        else:
            if listing and line[:1].strip():
                found.append("")  # a paragraph behind the list
                listing = False
            found.append(line)
    lines[:end] = [line.replace("|", r"\|") for line in found]


def setup(app: Any) -> None:
    """Before napoleon, which reads the sections."""
    app.connect("autodoc-process-docstring", readable, priority=400)
