"""What the site needs besides its pages: the reports of the repository, and formulas as MathML."""

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
OUTSIDE = re.compile(r"\]\(((?:\.\./)*)\.\./(validation/report/|CHANGELOG\.md)")
INWARD = re.compile(r"\]\(docs/")
FUNCTION = re.compile(r"<mi>(sin|cos|tan)</mi>")
SPACED = r'<mrow><mspace width="0.17em"/><mi>\1</mi><mspace width="0.17em"/></mrow>'
FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', flags=re.DOTALL)


def on_files(files: Any, config: Any) -> Any:
    """Let pages and pictures of the reports be pages of the site, as they are; bring a font for formulas."""
    from mkdocs.structure.files import File

    paths = [REPORT / path.name for path in sorted((ROOT / REPORT).iterdir()) if path.suffix in (".md", ".png")]
    for path in (*paths, Path("CHANGELOG.md")):
        files.append(File.generated(config, path.as_posix(), abs_src_path=str(ROOT / path)))
    files.append(File.generated(config, FONT, abs_src_path=str(resources.files("ziamath") / FONT)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """In the repository the reports lie beside docs/, in the site below the pages."""
    markdown = OUTSIDE.sub(r"](\1\2", markdown)
    return INWARD.sub("](", markdown) if page.file.src_uri == "CHANGELOG.md" else markdown


def on_page_content(content: str, page: Any, config: Any, files: Any) -> str:
    """Formulas as MathML, which browsers draw without a script."""

    def formula(match: re.Match[str]) -> str:
        display = "block" if match[2] == "[" else "inline"
        return FUNCTION.sub(SPACED, convert(html.unescape(match[3]).strip(), display=display))

    return FORMULA.sub(formula, content)
