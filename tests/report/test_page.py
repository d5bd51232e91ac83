"""``tiengine plot`` and ``tiengine report``: what they write, what they say, what they refuse; the page as HTML."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from tiengine.cli.commands import main
from tiengine.figures.catalogue import KINDS
from tiengine.indices.key_figures import KeyFigure, key_figures, summarise
from tiengine.indices.train_record import Train
from tiengine.report.page import render
from tiengine.report.scenario_words import scenario_words
from tiengine.result_files.reader import RUNNING
from tiengine.scenario.scenario import load_scenario

from .. import hand_made as by
from .. import long_trains as long

VOID_TAGS = {"meta", "img", "br", "link"}
EVIL = '<script src="x"> & $x$ 轨道'


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def groups(samples: int = 1000) -> dict[str, dict]:
    """A train on sound track but for three failed fastenings; its third right wheel is off the rail for 20 ms."""
    rng = np.random.default_rng(1)
    shape = (samples, 4, 2)
    Q, Y = 70e3 + 5e3 * rng.standard_normal(shape), 2e3 * rng.standard_normal(shape)
    Q[50:70, 2, 1], Y[50:70, 2, 1] = 0.0, 0.0
    Q[100, 0, 0], Y[30, 1, 1] = 150e3, -30e3
    contact = {"normal_force": Q, "contact_position_wheel": 1e-6 * Y, "contact_position_rail": 1e-6 * Y}
    body = by.body(np.zeros((samples, 7, 5)))
    track = {"seats": by.seats(250, slice(100, 103)), "slabs": by.slabs(28)}
    return {"wheel": by.wheel(Q, Y, **contact), "body": body, **track}


@pytest.fixture
def file(tmp_path, monkeypatch) -> Path:
    """A result in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return by.written(Path("run.h5"), by.scenario(), groups())


@pytest.fixture
def few_figures(monkeypatch):
    """One figure only, where a report's words are looked at."""
    monkeypatch.setattr("tiengine.report.page.KINDS", [kind for kind in KINDS if kind.name in ("contact", "waterfall")])


def assert_refused(result: Result, message: str) -> None:
    assert result.exit_code == 2, result.output
    assert re.fullmatch(r"error: [^\n]+\n", result.stderr)
    assert message in result.stderr


def test_plot_draws_what_the_file_gives(file):
    """Kinds that the file has the data for are drawn; the others name the key to set."""
    result = call("plot", file)
    assert result.exit_code == 0, result.output
    lines = dict(line.split(maxsplit=1) for line in result.stdout.splitlines())
    drawn = {"forces", "envelopes", "spectrum", "contact"}
    assert {name for name, words in lines.items() if words == f"run_{name}.png"} == drawn
    assert "skipped: run.h5 has no deflection; set output.deflection_interval" in lines["waterfall"]
    assert "ensemble.size" in lines["ensemble"]
    assert {path.name for path in Path().glob("*.png")} == {f"run_{name}.png" for name in drawn}
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in Path().glob("*.png"))


@pytest.mark.parametrize(("suffix", "magic"), [("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_plot_one_kind(file, suffix, magic):
    """Into the file that is named, replacing it."""
    figure = Path(f"contact.{suffix}")
    figure.write_text("an older one")
    assert call("plot", file, "contact", "-o", figure).output == f"{figure}\n"
    assert figure.read_bytes().startswith(magic)


def test_plot_into_a_folder(file):
    """Named after result and kind."""
    Path("figures").mkdir()
    assert call("plot", file, "contact", "-o", "figures").exit_code == 0
    assert [path.name for path in Path("figures").iterdir()] == ["run_contact.png"]


def test_plot_compares(file):
    """The kind goes without saying; names that look like formulas are only names."""
    Path("$a$_b$.h5").write_bytes(file.read_bytes())
    assert call("plot", file, "--with", "$a$_b$.h5").output == "run_compare.png\n"
    assert Path("run_compare.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["forces", "-o", "run.h5"], "its suffix must be one of"),
        (["forces", "-o", "no/such/figure.png"], "there is no folder"),
        (["-o", "all.png"], "must be an existing folder"),
        (["forces", "--train", "3"], "train = 3: must be from 0 to 0"),
        (["compare"], "needs the second file: --with FILE"),
        (["forces", "--with", "run.h5"], "--with: only for kind compare"),
        (["gauges"], "set [[gauges]] and run again"),
    ],
)
def test_plot_refuses(file, arguments, message):
    """One line; the result stays as it was."""
    before = file.read_bytes()
    assert_refused(call("plot", file, *arguments), message)
    assert file.read_bytes() == before
    assert [path.name for path in Path().iterdir()] == ["run.h5"]


def test_report_refuses(file):
    """The page never replaces a result."""
    assert_refused(call("report", file, "-o", "run.h5"), "its suffix must be .html or .htm")
    assert_refused(call("report", file, "-o", "no/such/page.html"), "there is no folder")
    assert_refused(call("report", file, "--train", "7"), "must be from 0 to 0")


class Page(HTMLParser):
    """Page as a browser parses it: elements closed in order, addresses, texts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.texts: dict[str, list[str]] = {}
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found["href"]] if "href" in found else []
        self.sources += [found["src"]] if "src" in found else []
        if tag not in VOID_TAGS:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open:
            self.texts.setdefault(self.open[-1], []).append(data)


def test_report_is_one_page(file):
    """Everything inside: pictures as data, no script, no address; the contents lead to what is there."""
    assert call("report", file).output == "run.html\n"
    text = Path("run.html").read_text(encoding="utf-8")
    page = Page(text)
    assert "script" not in page.texts
    assert not re.search(r"(https?:)?//[a-z]", re.sub(r"base64,[A-Za-z0-9+/=]+", "", text))
    assert {link.removeprefix("#") for link in page.links} <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    assert {"figure-forces", "figure-envelopes", "figure-spectrum", "figure-contact", "facts"} <= set(page.ids)
    assert len(page.sources) == 4
    for source in page.sources:
        head, _, data = source.partition(",")
        assert head == "data:image/png;base64"
        assert base64.b64decode(data).startswith(b"\x89PNG")
    assert [path.name for path in Path().iterdir() if path.suffix != ".h5"] == ["run.html"]


def test_report_says_numbers_and_verdicts(file, few_figures):
    """By hand: Q of 150 kN, 20 ms in the air, 25 kN on a neighbour, 2.5 of sound; verdicts in words."""
    text = call("report", file) and Path("run.html").read_text(encoding="utf-8")
    cells = Page(text).texts["td"]
    row = cells.index("largest vertical wheel force Q")
    x = by.START + by.OFFSET[0] + 0.1 * by.V
    assert cells[row + 1 : row + 4] == ["150", "kN", f"wheelset 1 left, chainage {x:.1f} m"]
    row = cells.index("longest time of a wheel off the rail")
    assert cells[row + 1 : row + 4] == ["20", "ms", "wheelset 3 right"]
    row = cells.index("largest force on a fastening over the sound median")
    assert cells[row + 1] == "2.5"
    assert cells[row + 3].startswith("seat 99 left, chainage 62.7 m")
    assert "within the limit" in cells
    row = cells.index("mean comfort N_MV")
    assert cells[row + 5] == "no value"
    assert "set output.deflection_interval and run again" in " ".join(Page(text).texts["li"])


def test_names_in_a_file_are_only_text(tmp_path, few_figures):
    """A scenario's name, a status and an event that hold markup."""
    scenario = load_scenario(by.scenario(), {"source": EVIL}).model_copy(update={"name": EVIL})
    events = {"event": np.arange(1), "time": np.ones(1), "position": np.ones(1), "message": (EVIL,)}
    with by.made(tmp_path / "a.h5", scenario, {**groups(200), "events": events}, status=EVIL) as result:
        page = Page(render(result))
    assert "script" not in page.texts
    assert EVIL in page.texts["h1"]
    assert "<script src=" in page.texts["pre"][0]
    assert any(f"The run is not complete: {EVIL}" in words for words in page.texts["p"])
    assert sum(EVIL in words for words in page.texts["td"]) >= 3  # source, failure, event
    assert any(words.startswith("No indices: ") for words in page.texts["p"])


def test_report_of_many_trains(tmp_path, few_figures):
    """Three of four came through: 5, 50, 95 % over these, the failure listed, verdicts over all."""
    trains = [groups(400) for _ in range(4)]
    for i, train in enumerate(trains):
        train["seats"]["largest_vertical_force"][60, 1] = 30e3 + 10e3 * i
    with by.made(tmp_path / "a.h5", by.scenario(ensemble__size=4), *trains, status="derailed at 7 m") as result:
        cells = Page(render(result)).texts["td"]
    row = cells.index("largest vertical force on a fastening")
    assert cells[row + 1 : row + 7] == ["40", "31 to 49", "50", "kN", "2", "seat 60 right, chainage 38.1 m"]
    assert cells[cells.index("derailed at 7 m") - 1] == "3"


def test_key_figures_of_a_poor_file(tmp_path, few_figures):
    """Key figures whose data the file lacks are left out."""
    with by.made(tmp_path / "a.h5", by.scenario(), {"body": by.body(np.zeros((300, 7, 5)))}) as result:
        assert key_figures(Train(result)) == []
        assert "The file holds neither wheel forces nor envelopes" in render(result)


def test_the_worst_is_the_smallest_where_less_is_worse():
    """The worst of 3, 1, 2 is 1, their median 2."""
    (summary,) = summarise(
        [(i, [KeyFigure("Q", value, "kN", smallest=True)]) for i, value in enumerate((3.0, 1.0, 2.0))]
    )
    assert (summary.worst.value, summary.train, summary.median) == (1.0, 1, 2.0)


def test_a_scenario_in_words():
    """Chainages by hand: seats at (j + 1/2) 0.63 m."""
    words = dict(scenario_words(load_scenario("defects")))
    assert words["Train"] == "CRH380A_v2 with LMA wheels, over 200 m at 350 km/h"
    assert "3 fastenings of the left rail failed (seats 160 to 162, chainage 101.1 to 102.4 m)" in words["Defects"]
    assert "no mortar under 1.6 m² of slab 24" in words["Defects"]
    assert words["Line"] == "straight and level"
    small = dict(scenario_words(load_scenario("small_curve")))
    assert small["Line"] == "curves down to a radius of 350 m, cant up to 100 mm, level"
    gaps = dict(scenario_words(load_scenario("gap", {"track.slab_warps": [{"gradient": -45.0, "slabs": [3, 5]}]})))
    assert "2 fastenings of the right rail hanging by 1 mm (seats 230 to 231" in gaps["Defects"]
    assert "a gap of 0.05 mm under 4.7 m² of slab 21" in gaps["Defects"]
    assert "slabs 3 to 5 colder at the top by 45 K/m" in gaps["Defects"]
    smooth = dict(scenario_words(load_scenario("smooth", {"ensemble.size": 3, "ensemble.vary": {
        "train.speed_kmh": (100.0, 200.0, 300.0)}})))  # fmt: skip
    assert smooth["Irregularity"] == "none, a smooth track"
    assert smooth["Defects"] == "none"
    assert smooth["Trains"] == "3 realisations of the irregularity, train.speed_kmh in 3 values"


def test_words_on_the_ground():
    ground = [
        {"kind": "angles", "at": 100.0, "length": 20.0, "depth": 0.01, "lateral": -0.002},
        {"kind": "file", "file": "levels.csv", "scale": 2.0},
    ]
    changes = {"track.ground": ground, "track.base_motion": {"file": "quake.csv", "wave_speed": 500.0, "start": 1.0}}
    words = dict(scenario_words(load_scenario("default", changes)))["Ground"]
    assert words == (
        "displaced 10 mm down and 2 mm to the left, two ramps that meet over 20 m at chainage 100 m; displaced by"
        " levels.csv, times 2; moving in time by quake.csv, travelling at 500 m/s, from 1 s on"
    )
    assert "Ground" not in dict(scenario_words(load_scenario("default")))


def test_unfinished_files_are_drawn(tmp_path, few_figures):
    """An unfinished run: its results so far, with a notice."""
    with by.made(tmp_path / "a.h5", by.scenario(), groups(300), status=RUNNING) as result:
        assert "The run is not complete: running" in render(result)


def test_a_train_has_a_table_by_vehicle(tmp_path, few_figures):
    """Three cars: the second has 150 kN and 30 kN sideways, the first a wheel of 20 kN; a single car has no table."""
    wheel = long.wheel(3, 900)
    wheel["vertical_force"][500, 6, 1], wheel["vertical_force"][500, 2, 0] = 150e3, 20e3
    wheel["lateral_force"][500, 5, 0] = -30e3
    tracks = {"wheel": wheel, "body": long.body(3, 900)}
    with by.made(tmp_path / "a.h5", long.train_of(3), tracks) as result:
        text = render(result)
    assert "#vehicles" in Page(text).links
    begin = text.index('<section id="vehicles">')
    table = Page(text[begin : text.index("</section>", begin) + len("</section>")])
    columns = table.texts["th"].index("1") - 1
    assert table.texts["th"][:4] == ["vehicle", "largest Q [kN]", "smallest Q [kN]", "largest |Y| [kN]"]
    rows = [table.texts["td"][k * columns : k * columns + 3] for k in range(3)]
    assert rows == [["70", "20", "0"], ["150", "70", "30"], ["70", "70", "0"]]
    places = table.texts["span"]
    assert places[1] == "wheelset 3 left"
    assert places[columns : columns + 3 : 2] == ["wheelset 7 right", "wheelset 6 left"]
    with by.made(tmp_path / "b.h5", by.scenario(), groups(300)) as result:
        assert "vehicles" not in Page(render(result)).ids
