"""Hooks of the site: pages from outside ``docs/``, and formulas as MathML."""

from __future__ import annotations

import html
import re
from importlib import resources
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert

ROOT = Path(__file__).parents[1]
REPORT = Path("validation/report")
FONT = "fonts/STIXTwoMath-Regular.ttf"
ROOT_PAGES = ("CHANGELOG.md", "CONTRIBUTING.md")
OUTSIDE = re.compile(r"\]\(((?:\.\./)*)\.\./(validation/report/|CHANGELOG\.md|CONTRIBUTING\.md)")
INWARD = re.compile(r"\]\(docs/")
FUNCTION = re.compile(r"<mi>(sin|cos|tan)</mi>")
SPACED = r'<mrow><mspace width="0.17em"/><mi>\1</mi><mspace width="0.17em"/></mrow>'
ROLE = re.compile(r":(?:func|meth|class|data|mod|attr):(?=<code>)")
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', flags=re.DOTALL)


def on_files(files: Any, config: Any) -> Any:
    """Add the reports with their pictures, the pages of the root folder and a font for formulas to the site."""
    from mkdocs.structure.files import File

    paths = [REPORT / path.name for path in sorted((ROOT / REPORT).iterdir()) if path.suffix in (".md", ".png")]
    for path in (*paths, *map(Path, ROOT_PAGES)):
        files.append(File.generated(config, path.as_posix(), abs_src_path=str(ROOT / path)))
    files.append(File.generated(config, FONT, abs_src_path=str(resources.files("ziamath") / FONT)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Adapt links: the reports are next to docs/ in the repository, but below the pages in the site."""
    markdown = OUTSIDE.sub(r"](\1\2", markdown)
    return INWARD.sub("](", markdown) if page.file.src_uri in ROOT_PAGES else markdown


def on_page_content(content: str, page: Any, config: Any, files: Any) -> str:
    """Convert formulas to MathML, which browsers draw without a script; drop the roles of docstrings' references."""

    def formula(match: re.Match[str]) -> str:
        display = "block" if match[2] == "[" else "inline"
        return FUNCTION.sub(SPACED, convert(html.unescape(match[3]).strip(), display=display))

    return FORMULA.sub(formula, ROLE.sub("", content))
