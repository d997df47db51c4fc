"""Hooks of the site: formulas as MathML, made when the site is built, and the changelog as a page."""

import re
from html import unescape
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

_FORMULA = re.compile(r'<(span|div) class="arithmatex">\\[(\[](.*?)\\[)\]]</\1>', re.DOTALL)
_BOLD = re.compile(r'<mi mathvariant="bold(?:-italic)?">&#x00?(\w+);</mi>')


def _bold(match: re.Match[str]) -> str:
    """Return a bold Greek letter: browsers draw no `mathvariant` but the upright one."""
    return f"<mi>{chr(0x1D6C2 + int(match[1], 16) - 0x3B1)}</mi>"


def _typeset(match: re.Match[str]) -> str:
    text = unescape(match[2]).replace("{aligned}", "{align*}")
    return _BOLD.sub(_bold, convert(text, display="block" if match[1] == "div" else "inline"))


def on_page_content(html: str, **_: Any) -> str:
    """Return the page with its formulas typeset."""
    return _FORMULA.sub(_typeset, html)


def on_files(files: Files, config: Any) -> Files:
    """Add the changelog, which lies beside the pages' folder."""
    source = Path(config.docs_dir).parent / "CHANGELOG.md"
    files.append(File.generated(config, "changelog.md", abs_src_path=str(source)))
    return files
