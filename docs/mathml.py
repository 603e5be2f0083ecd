"""Sphinx extension: equations as MathML, which browsers draw themselves: nothing is loaded."""

import re
from html import unescape
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

BOLD = re.compile('<mi mathvariant="bold(?:-italic)?">([^<]*)</mi>')


def mathml(latex: str, display: str) -> str:
    """The MathML of an equation.

    Raises
    ------
    ValueError
        It has a command that the converter does not know, and would print.
    """
    found = BOLD.sub(lambda match: f"<mi>{bold(match[1])}</mi>", convert(latex, display=display))
    if "\\" in found or "<mi>&</mi>" in found:
        raise ValueError(f"no MathML for {latex}")
    for side in ("left", "right"):  # Chromium reads no attribute, but the style
        style = f'style="text-align: {side}; padding-{side}: 0"'
        found = found.replace(f'columnalign="{side}"', style)
    return found


def bold(text: str) -> str:
    """Latin and Greek letters as bold ones: browsers no longer make them so themselves."""
    letter = unescape(text)
    for first, last, shown in (("A", "Z", 0x1D400), ("a", "z", 0x1D41A), ("Α", "Ω", 0x1D6A8),
                               ("α", "ω", 0x1D6C2)):  # fmt: skip
        if first <= letter <= last:
            return chr(shown + ord(letter) - ord(first))
    return text


def inline(writer: Any, node: Any) -> None:
    """``$...$``."""
    writer.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def block(writer: Any, node: Any) -> None:
    """``$$...$$``; a wide one is scrolled in its own box."""
    found = mathml(node.astext(), "block")
    writer.body.append(f'<div style="overflow-x: auto; margin: 1rem 0">{found}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Make it the renderer ``mathml``."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
