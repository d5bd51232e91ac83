"""Profile: what is counted and added up, not how fast; JSON, comparison, command."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from threadpoolctl import threadpool_limits

from tiengine.cli.commands import main
from tiengine.engine.stepper import BETWEEN_STEPS, Plan, Stage, Stepper
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.profiling import profile as profiling
from tiengine.profiling import timed_loop
from tiengine.profiling.machine import cache_bytes
from tiengine.profiling.product_count import count_products
from tiengine.profiling.report import ProfileReport, compare, read_json
from tiengine.profiling.roofline import Roofs
from tiengine.profiling.timed_loop import StageTimer, Times
from tiengine.recording.guards import Guard
from tiengine.result_files.events import Event
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.simulation.tasks import plan
from tiengine.simulation.time_loop import Run as Loop

from ..models import V350, Run, paper_model

ROUNDING = 1e-12  # of a sum of some twenty terms
STEPS = 40


@pytest.fixture(scope="module")
def report() -> ProfileReport:
    """A short profile of two trains."""
    return profiling.profile("paper", trains=2, steps=STEPS)


def call(*arguments: str):
    """Run ``tiengine profile``."""
    return CliRunner().invoke(main, ["profile", *arguments])


def test_stages_add_up_to_the_loop(report):
    """Times and shares; what was not estimated was timed, so cannot be negative."""
    assert sum(s.us_per_train_step for s in report.stages) == pytest.approx(report.loop.us_per_train_step, rel=ROUNDING)
    assert sum(s.share for s in report.stages) == pytest.approx(1.0, rel=ROUNDING)
    assert all(s.us_per_train_step >= 0.0 for s in report.stages if not s.estimated)


def test_every_stage_of_the_step_is_reported(report):
    """The stepper's own and those of the loop, in the order of the table."""
    names = [stage.name for stage in report.stages]
    times = Times.of(Run(paper_model(), V350, steps=1, start=False).stepper)
    assert set(times.calls) <= set(names)
    assert {"window and seats", "irregularity", "suspension", "implicit solve", "contact", "writing"} <= set(names)
    assert names[-1] == BETWEEN_STEPS
    assert (report.trains, report.steps, report.passes) == (2, STEPS, 2)


def test_percentiles_rise_and_factors_agree(report):
    """Percentiles of the same steps; the two trains share the loop."""
    loop = report.loop
    assert loop.step_us_p50 <= loop.step_us_p90 <= loop.step_us_p99 <= loop.step_us_max
    assert loop.real_time_factor_per_train == pytest.approx(loop.real_time_factor / 2, rel=ROUNDING)
    assert loop.steps_per_s * loop.real_time_factor * report.time_step_s == pytest.approx(1.0, rel=ROUNDING)


class Steps(Stepper):
    """A step made of given calls."""

    def __init__(self, *stages: Stage) -> None:
        run = Run(paper_model(), V350, steps=1, start=False)
        super().__init__(run.model.ingredients, run.state, run.chunk)
        self._given = stages
        self.bind()

    def _stages(self) -> Iterator[Stage]:
        yield from self._given

    def factor(self, V: float) -> None:
        """Nothing depends on the speed."""

    def finish(self, body_rows: int) -> None:
        """Nothing is recorded."""

    def compile(self) -> float:
        """Nothing is compiled."""
        return 0.0


def planned(steps: int) -> Plan:
    """Steps without samples."""
    return Plan(np.arange(steps), *2 * [np.full(steps, -1)])


def test_timers_put_every_interval_to_its_stage(monkeypatch):
    """On a clock that only the stages move: one reading where the name changes, the rest between the steps."""
    now = [0]

    def spend(ns: int):
        return lambda *arguments: now.__setitem__(0, now[0] + ns)

    def take(stepper: Stepper, plan: Plan) -> None:
        for i in plan.step:
            now[0] += 100
            stepper.step(i)
            now[0] += 1000

    monkeypatch.setattr(timed_loop, "time", SimpleNamespace(perf_counter_ns=lambda: now[0]))
    monkeypatch.setattr(timed_loop, "plain_steps", take)
    stepper = Steps(("rails", spend(3)), ("slabs", spend(5)), ("own", spend(7)), ("contact", spend(11)))
    stepper.watch("own", spend(1))
    times = Times.of(stepper)
    assert StageTimer(times, 1).take_timed(stepper, planned(2)) == 2 * 1127
    assert times.stages == {"linear forces": 16, "own": 16, "contact": 22, BETWEEN_STEPS: 2200}
    assert times.timed == [27, 27]
    assert times.calls == {"linear forces": 2, "own": 2, "contact": 1}
    assert (times.timed_steps, times.timed_ns) == (2, 2254)
    before = now[0]
    stepper.step(0)
    assert now[0] - before == 27


def test_blocks_take_turns(monkeypatch):
    """Seven steps in blocks of two: two without timers, two with, two without, one with."""
    taken: list[tuple[bool, int]] = []
    stepper = Steps(("own", lambda: taken.append((stepper._mark is not None, stepper.rows.step))))
    times = Times.of(stepper)
    StageTimer(times, 2).take(stepper, planned(7))
    assert taken == [(i in (2, 3, 6), i) for i in range(7)]
    assert (times.plain_steps, times.timed_steps, len(times.blocks)) == (4, 3, 2)


def test_measuring_changes_no_bit():
    """The same steps with readings and without."""
    model = paper_model()
    watched, bare = (Run(model, V350, steps=20) for _ in range(2))
    bare.advance(20)
    X = V350 * model.ingredients.newmark.dt * np.arange(1, 21)
    watched.stepper.load(X, np.full(20, V350), np.zeros(20), np.zeros_like(watched.chunk.irregularity))
    StageTimer(Times.of(watched.stepper), 10).take_timed(watched.stepper, Plan(*3 * [np.arange(20)]))
    np.testing.assert_array_equal(watched.state.motion, bare.state.motion)
    np.testing.assert_array_equal(watched.chunk.wheel, bare.chunk.wheel)


def test_the_loop_that_is_measured_is_the_runs_own():
    """A run with timers in its loop has the bits of one without."""
    scenario = load_scenario("paper", {"train.distance": 4.0})
    with run(scenario) as plain:
        expected = plain.wheel()["normal_force"]
    (task,) = plan(scenario)
    timed = Loop.begin(task)
    timed.timer = StageTimer(Times.of(timed.stepper), 50)
    with threadpool_limits(1):
        *chunks, _ = timed.blocks()  # the last holds what the envelopes keep to the end
    found = np.concatenate([sent.blocks[0]["wheel"].channels["normal_force"] for sent in chunks])
    np.testing.assert_array_equal(found, expected)
    assert timed.timer.times.timed_steps == 100


def test_counts_of_known_products():
    """(3, 4) (4, 5) twice and (2, 6) (6, 6), by hand."""
    a, b, c, d = np.ones((3, 4)), np.ones((4, 5)), np.ones((2, 6)), np.ones((6, 6))
    stepper = Steps(
        ("solve", lambda: np.dot(a, b)),
        ("contact", lambda: None),
        ("solve", lambda: np.matmul(a, b)),
        ("seats", lambda: np.matmul(c, d, out=np.empty((2, 6)))),
    )
    stepper.watch("envelopes", lambda: np.dot(a, b))
    work = count_products(stepper)
    assert set(work) == {"solve", "seats"}
    solve, seats = work["solve"], work["seats"]
    assert (solve.products, solve.flops, solve.read, solve.traffic) == (2, 2 * 120, 2 * 8 * 32, 2 * 8 * 47)
    assert (seats.products, seats.flops, seats.read, seats.traffic) == (1, 144, 8 * 48, 8 * 60)


def test_counted_solve_is_the_blocks_by_hand():
    """Rails and train as in the model's docstring; what is left is one product of all slabs a pass."""
    model = paper_model("numerics.passes=3", modes=20)
    run = Run(model, V350, steps=1)

    run.stepper.load(np.ones(1), np.full(1, V350), np.zeros(1), np.zeros_like(run.chunk.irregularity))
    flops = count_products(run.stepper)["solve"].flops
    n, slots, dofs = model.ingredients.train.n, int(model.dims[at.SLOTS]), int(model.dims[at.SLAB_DOFS])
    slabs, odd = divmod(flops - 3 * 2 * (2 * 40**2 + 2 * 60**2 + n**2), 3 * 2 * slots * dofs)
    assert odd == 0
    assert 0 < slabs <= dofs  # length of the slabs' sums


def test_array_bytes_counts_every_array_once():
    """Views and repeats hold no memory of their own."""
    a = np.zeros(100)
    assert profiling.array_bytes({"a": a, "view": a[:10], "all": (a, [a.reshape(10, 10), np.zeros(1)])}) == 808


def test_roof_is_the_slower_of_two():
    """2 GFLOP at 4 GFLOP/s, or 3 GB at 2 GB/s."""
    roofs = Roofs(4.0, 1.0, 2.0, 1.0, 1.0)
    assert roofs.floor_s(2e9, 0.0) == pytest.approx(0.5, rel=ROUNDING)
    assert roofs.floor_s(2e9, 3e9) == pytest.approx(1.5, rel=ROUNDING)


def test_caches_as_linux_describes_them(tmp_path):
    """Data and unified caches; a system that says nothing has none."""
    for i, row in enumerate((("Data", "1", "32K"), ("Instruction", "1", "64K"), ("Unified", "3", "32M"))):
        (tmp_path / f"index{i}").mkdir()
        for name, text in zip(("type", "level", "size"), row, strict=True):
            (tmp_path / f"index{i}" / name).write_text(f"{text}\n")
    assert cache_bytes(tmp_path) == {1: 2**15, 3: 2**25}
    assert cache_bytes(tmp_path / "none") == {}


def test_json_round_trip(report, tmp_path):
    """The same report; keys for scripts at the top."""
    file = tmp_path / "a.json"
    file.write_text(report.to_json())
    assert read_json(file) == report
    tables = json.loads(file.read_text())
    assert (tables["format"], tables["format_version"]) == ("tiengine-profile", 1)
    assert set(tables) == {"format", "format_version", *asdict(report)}
    assert set(tables["stages"][0]) == {"name", "calls_per_step", "us_per_train_step", "share", "estimated"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda tables: None, "cannot be read (No such file or directory)"),
        (lambda tables: "{", "must be a JSON file"),
        (lambda tables: "[1]", "must be a file that 'tiengine profile --json' wrote"),
        (
            lambda tables: json.dumps(tables | {"format": "other"}),
            "must be a file that 'tiengine profile --json' wrote",
        ),
        (lambda tables: json.dumps(tables | {"format_version": 7}), "format version 7; must be 1"),
        (lambda tables: json.dumps(tables | {"trains": "many"}), "trains: Input should be a valid integer"),
    ],
)
def test_compare_refuses_other_files(report, tmp_path, change, message):
    """One line, exit status 2."""
    good, bad = tmp_path / "good.json", tmp_path / "bad.json"
    good.write_text(report.to_json())
    text = change(json.loads(report.to_json()))
    if text is not None:
        bad.write_text(text)
    result = call("--compare", str(good), str(bad))
    assert (result.exit_code, result.stdout) == (2, "")
    assert f"error: profile = '{bad}': {message}" in result.stderr
    assert result.stderr.count("\n") == 1


def test_compare_sets_stages_side_by_side(report):
    """Ratios by name, stages that one lacks, and what was not measured alike."""
    first = report.stages[0]
    other = replace(
        report,
        trains=3,
        stages=(replace(first, us_per_train_step=2.0), replace(first, name="new", us_per_train_step=5.0)),
    )
    found = compare(report, other)
    rows = {name: (a, b) for name, a, b in found.rows}
    assert rows[f"{first.name} [us/train-step]"] == (first.us_per_train_step, 2.0)
    assert rows["new [us/train-step]"] == (None, 5.0)
    assert rows[f"{report.stages[1].name} [us/train-step]"] == (report.stages[1].us_per_train_step, None)
    assert rows["RTF"] == (report.loop.real_time_factor, report.loop.real_time_factor)
    assert found.differences == ("trains: 2 and 3",)


def test_command_prints_a_table_and_writes_json(tmp_path):
    """A few steps of one train; then the file compared with itself."""
    file = tmp_path / "a.json"
    result = call("paper", "--set", "train.speed_kmh=300", "--steps", "4", "--json", str(file))
    assert result.exit_code == 0, result.output
    for words in ("implicit solve", "overhead of measuring", "GFLOP/s", "loop, writing included", "of roof"):
        assert words in result.stdout
    assert read_json(file).steps == 4
    result = call("--compare", str(file), str(file))
    assert result.exit_code == 0, result.output
    assert re.search(r"implicit solve \[us/train-step\] +[\d.]+ +[\d.]+ +1\.000\n", result.stdout)
    assert "not measured alike" not in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--seconds", "0"), "seconds = 0: must be greater than 0"),
        (("--seconds", "nan"), "seconds = nan: must be greater than 0"),
        (("--json", "no/such/folder/a.json"), "output = 'no/such/folder/a.json': there is no folder"),
        (("papr",), "papr"),
    ],
)
def test_bad_input_is_one_line(arguments, message):
    """Before anything is computed."""
    result = call(*arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_distance_too_short_is_refused():
    """Five metres do not last a second at 350 km/h."""
    with pytest.raises(InputError, match=r"train.distance = 5: too short for the time to measure"):
        profiling.profile(load_scenario("paper", ["train.distance=5"]), seconds=1.0)


def test_a_run_that_fails_is_told(monkeypatch):
    """A train that derails while it is measured."""
    derailed = Event("derailment", 0.1, 20.0, 1, "left", "wheelset 1 left derailed", True)
    monkeypatch.setattr(Guard, "check", lambda guard, step, position: guard._report(0, step, derailed))
    with pytest.raises(RunFailedError, match="train 0: wheelset 1 left derailed"):
        profiling.profile("paper", steps=2)
