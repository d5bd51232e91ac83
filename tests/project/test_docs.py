"""The site builds without a warning, loads nothing from other sites, and agrees with the code."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from tiengine.scenario.manual import page, tables, with_channels

ROOT = Path(__file__).parents[2]
RELOAD = "; update it by python -m tiengine.scenario.manual docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The site, built in a process of its own, since warnings of mkdocs itself are not errors of the suite."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


class Resources(HTMLParser):
    """Addresses that a browser fetches to show a page, without the links that a reader may follow."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            is_source = name in ("src", "srcset", "data", "poster") or (name == "href" and tag in ("link", "use"))
            if is_source and value:
                self.found.append(value)


def test_site_loads_nothing_from_elsewhere(site):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 10
    for html in pages:
        resources = Resources()
        resources.feed(html.read_text(encoding="utf-8"))
        assert resources.found
        assert not [address for address in resources.found if re.match(r"(https?:)?//", address)], html
    for css in site.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*['\"]?(https?:)?//", css.read_text(encoding="utf-8")), css


def test_formulas_are_mathml(site):
    html = (site / "model.html").read_text(encoding="utf-8")
    source = (ROOT / "docs" / "model.md").read_text(encoding="utf-8")
    assert html.count("<math") == len(re.findall(r"\$\$.+?\$\$|\$[^$]+?\$", source, flags=re.DOTALL)) > 100
    assert "arithmatex" not in html
    assert not re.search(r"<m(i|o|text)>\\", html), "a LaTeX command that the converter does not know"


def test_reports_are_pages(site):
    """Reports are taken from validation/report unchanged, with their figures."""
    for name in ("paper", "verification", "convergence", "speed"):
        assert (site / "validation" / "report" / f"{name}.html").is_file()
    assert (site / "validation" / "report" / "paper_vertical.png").is_file()


def test_scenario_reference_is_that_of_the_code():
    assert (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8") == page(), f"docs/scenario.md{RELOAD}"


def test_channels_are_those_of_the_code():
    text = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    assert text == with_channels(text), f"docs/results.md{RELOAD}"


def test_every_key_is_described():
    """The last cell of each row of the reference is its description, taken from the declaration."""
    rows = [line for line in page().splitlines() if line.startswith("| `")]
    assert len(rows) > 150
    assert not [row for row in rows if not row.split("|")[-2].strip()]


def test_reference_knows_unit_range_and_default():
    """Rows written by hand from the declarations: bound, number or word, list, nested table, required part."""
    text = page()
    for row in (
        "| `distance` | number | m | > 0, ≤ 1e6 | required | distance the train covers |",
        '| `window` | number or `"auto"` | m | 1 to 2000 | `"auto"` |',
        "| `v` | list of numbers | m/s | ≥ 0 | [0] | rates |",
        "| `damping` | number | N s/m^3 | ≥ 0 | required | vertical damping c_m per area |",
        "| `vehicles` | list of parts |  |  | required |",
    ):
        assert row in text
    places = [place for table in (*tables()[0], *tables()[1]) for place in table.places]
    assert {"`[[track.failed_fastenings]]`", "`[[gauges]]`", "`[car]`", "`[[damper]]`"} <= set(places)
    assert len(places) == len(set(places))
