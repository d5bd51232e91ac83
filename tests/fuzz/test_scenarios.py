"""Damaged scenarios: changed texts, odd values of every key, the ends of every range."""

from __future__ import annotations

import datetime
import math
import operator
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import annotated_types
import pytest
import tomli_w
from hypothesis import strategies as st
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.parameters.input_files import parse_toml
from tiengine.parameters.quantity import Params, build
from tiengine.scenario.key_checks import NumberOr
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.simulation import simulate

from ..fuzzing import BAD, EXAMPLES, mutated_texts, on_many, refused

POINTS = "\n".join(f"{y} {y * y / 2000.0}" for y in range(-30, 31, 3))
BASE: dict[str, Any] = {
    "name": "fuzzed",
    "train": {
        "vehicles": ["CRH380A_v2", {"like": "CRH2", "car": {"mass": 3e4}}],
        "speed_kmh": [[0.0, 200.0], [30.0, 210.0]],
        "distance": 30.0,
        "wheel_profile": {"points": POINTS},
        "couplings": [{"part": "EMU_intercar", "behind": [1]}],
        "wheel_profiles": [{"wheelsets": [2], "side": "left", "profile": {"points": POINTS}, "radius": 0.431}],
        "wheel_shapes": [{"kind": "harmonics", "wheelsets": [2], "order": [3], "amplitude": [1e-4]}],
        "forces": [{"motion": "z", "rows": [[0.0, 0.0], [0.1, 1e4]]}],
    },
    "track": {
        "rail": "CHN60",
        "slab": "CRTS_III",
        "fastening": {"like": "ACE2021", "vertical_stiffness": 5e7},
        "mortar_no_tension": True,
        "failed_fastenings": [{"seats": [40, 42], "rail": "left", "factor": 0.5, "gap": 1e-3}],
        "mortar_voids": [{"slab": 5, "x": [0.5, 1.0], "y": [-0.5, 0.5], "gap": 1e-4}],
        "slab_warps": [{"gradient": -30.0, "slabs": [3, 8]}],
        "rail_shapes": [{"kind": "weld", "at": 60.0, "length": 1.0, "depth": 2e-4}],
        "ground": [{"kind": "angles", "at": 70.0, "length": 12.0, "depth": 5e-3, "lateral": -1e-3}],
        "base_motion": {"file": "quake.csv", "start": 0.5, "wave_speed": 500.0, "at": 20.0},
    },
    "irregularity": {"spectrum": "german_low", "seed": 3},
    "wind": {"speed": 5.0, "gust": "en14067", "gust_at": 60.0},
    "numerics": {"window": 60.0, "absorbing_zone": 1.0},
    "output": {"wheel_channels": ["vertical_force"], "run_in": 1.0},
    "gauges": [{"name": "a", "on": "rail", "chainage": 30.0, "side": "left"}],
    "events": {"derailment": "stop"},
    "ensemble": {"size": 2, "vary": {"track.friction": [0.2, 0.3]}},
}
TEXT = tomli_w.dumps(BASE)
HUGE = 10**400
TEXT_OF_A_MEGABYTE = "x" * 1_000_000
ODD_VALUES: tuple[Any, ...] = (
    *(0, -1, 1, 0.0, -0.0, -1.0, 1.0, 0.5, math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 1e15, 1e16, 1e-16),
    *(HUGE, -HUGE, 2**63, 2**63 - 1, -(2**63), True, False, None, "", "x", "auto", "a\0b", TEXT_OF_A_MEGABYTE),
    *("../../../etc/passwd", "/dev/zero", "~nobody/x.toml", "a/" * 3000, (), (1.0,), ((1.0, 2.0), (1.0, 2.0)), {}),
    *({"like": "x"}, {"like": {"a": 1}}, {"": 1}, {"like": "CHN60", "points": "1 1"}, datetime.date(2000, 1, 1), b"x"),
    *(("x",) * 1000, tuple(range(1000)), (math.nan,), ({},), ({"name": "a"},)),
)


def models(value: Any, path: str = "") -> Iterator[tuple[str, BaseModel]]:
    """Every table of a scenario with its dotted path."""
    if isinstance(value, BaseModel):
        yield path, value
        for key in type(value).model_fields:
            yield from models(getattr(value, key), f"{path}.{key}".lstrip("."))
    elif isinstance(value, tuple):
        for i, item in enumerate(value[:1]):
            yield from models(item, f"{path}.{i}")


@cache
def scenario() -> Scenario:
    return load_scenario(BASE)


@cache
def keys() -> list[tuple[str, type[BaseModel], str]]:
    """Path of the table, its class and key, of every declared parameter of a scenario."""
    found = [
        (path, type(model), key)
        for path, model in models(scenario())
        for key in type(model).model_fields
        if key not in ("presets", "train")
    ]
    parts = scenario().parts
    named = {
        "track.rail": parts.rail,
        "track.slab": parts.slab,
        "track.slab.mortar": parts.mortar,
        "track.fastening": parts.fastening,
    }
    skipped = {"name", "source", "no_tension"}
    found += [(path, type(m), key) for path, m in named.items() for key in type(m).model_fields if key not in skipped]
    return found


@cache
def instances() -> list[Params]:
    """One of each class of parameters, parts of vehicles included."""
    parts = scenario().parts
    found: dict[type, BaseModel] = {}
    for root in (scenario(), parts.rail, parts.slab, parts.mortar, parts.fastening, *parts.vehicles):
        for _, model in models(root):
            found.setdefault(type(model), model)
    return [each for each in found.values() if isinstance(each, Params)]


def outside(info: FieldInfo, value: Any) -> bool:
    """Whether the declaration of a number refuses a number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    rules = [mark for mark in info.metadata if isinstance(mark, annotated_types.BaseMetadata)]
    if any(isinstance(mark, NumberOr) for mark in info.metadata):
        number = next(mark for mark in info.metadata if isinstance(mark, NumberOr))
        return not number.low <= value <= number.high
    checks = {"gt": operator.gt, "ge": operator.ge, "lt": operator.lt, "le": operator.le}
    return any(not check(value, getattr(m, name)) for m in rules for name, check in checks.items() if hasattr(m, name))


def edges(info: FieldInfo) -> list[Any]:
    """The ends of a declared range, just inside and just outside them."""
    found: list[Any] = []
    for mark in info.metadata:
        bounds = [getattr(mark, name) for name in ("gt", "ge", "lt", "le", "low", "high") if hasattr(mark, name)]
        for bound in bounds:
            found += [bound, bound - 1, bound + 1]
            if isinstance(bound, float) or info.annotation is not int:
                found += [math.nextafter(bound, math.inf), math.nextafter(bound, -math.inf), float(bound)]
    return found


def numbers(value: Any) -> Iterator[float]:
    """Every number in a value, at any depth."""
    if isinstance(value, dict):
        for item in value.values():
            yield from numbers(item)
    elif isinstance(value, tuple | list):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, int | float):
        yield value


def assert_sound(loaded: Scenario) -> None:
    """An accepted scenario is finite, within its ranges, and equal to the one loaded from its own text."""
    assert all(-1e15 <= x <= 1e15 or (isinstance(x, int) and abs(x) < 2**63) for x in numbers(loaded.model_dump()))
    for _, model in models(loaded):
        for key, info in type(model).model_fields.items():
            assert not outside(info, getattr(model, key)), key
    again = load_scenario(parse_toml(to_toml(loaded), "again"))
    assert again == loaded
    assert to_toml(again) == to_toml(loaded)


@EXAMPLES
def test_changed_texts(examples: int, tmp_path: Path) -> None:
    """A changed text is refused, naming the file or a key, or read as written."""
    path = tmp_path / "fuzzed.toml"

    def check(text: str) -> bool:
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        loaded: list[Scenario] = []
        message = refused(lambda: loaded.append(load_scenario(path)))
        if message is None:
            assert_sound(loaded[0])
        return message is not None

    on_many(examples, mutated_texts(TEXT), check)


@EXAMPLES
def test_odd_values_anywhere(examples: int) -> None:
    """One or two keys of any table with an odd value or one at the end of a range are refused or used."""

    @st.composite
    def changes(draw: st.DrawFn) -> dict[str, Any]:
        found = {}
        for _ in range(draw(st.integers(1, 2))):
            path, model, key = draw(st.sampled_from(keys()))
            values = st.sampled_from(ODD_VALUES + tuple(edges(model.model_fields[key])))
            drawn = st.one_of(values, st.floats(), st.integers(), st.text(max_size=8))
            found[f"{path}.{key}".lstrip(".")] = draw(drawn)
        return found

    def check(found: dict[str, Any]) -> bool:
        loaded: list[Scenario] = []
        message = refused(lambda: loaded.append(load_scenario(BASE, found)))
        if message is None:
            assert_sound(loaded[0])
        return message is not None

    on_many(examples, changes(), check)


@EXAMPLES
def test_settings_on_the_command_line(examples: int) -> None:
    """``--set`` accepts any text around the equals sign or refuses it with a message."""
    names = [f"{path}.{key}".lstrip(".") for path, _, key in keys()]
    texts = mutated_texts("train.vehicles.0.car.mass=[3e4, {a = 1}]")

    def check(setting: str) -> bool:
        loaded: list[Scenario] = []
        message = refused(lambda: loaded.append(load_scenario(BASE, [setting])))
        if message is None:
            assert_sound(loaded[0])
        return message is not None

    pairs = st.tuples(st.sampled_from(names), st.one_of(st.text(max_size=20), mutated_texts("[1.0, 'a', {b=2}]")))
    on_many(examples, st.one_of(texts, pairs.map("=".join)), check)


def boundary_cases() -> list[tuple[type[BaseModel], str, Any]]:
    return [
        (type(model), key, value)
        for model in instances()
        for key, info in type(model).model_fields.items()
        for value in (*ODD_VALUES, *edges(info))
    ]


@pytest.mark.parametrize("stride", [pytest.param(29, id="quick"), pytest.param(1, id="all", marks=pytest.mark.slow)])
def test_edges_of_every_parameter(stride: int) -> None:
    """Every parameter of every class is refused with its name, or accepted unchanged within its range."""
    given = {type(model): {k: getattr(model, k) for k in model.model_fields_set} for model in instances()}
    bad = 0
    for model, key, value in boundary_cases()[::stride]:
        if model is Scenario and key in ("train", "presets"):
            continue
        built: list[BaseModel] = []
        table = {**given[model], key: value}
        message = refused(lambda model=model, table=table, built=built: built.append(build(model, table, "table")))
        if message is not None:
            bad += 1
            continue
        taken = getattr(built[0], key)
        if isinstance(value, bool | int | float) and value is not None:
            assert not outside(model.model_fields[key], value), f"{model.__name__}.{key} = {value!r} was taken"
            assert not isinstance(taken, float) or math.isfinite(taken), f"{model.__name__}.{key}"
            assert taken == (float(value) if isinstance(taken, float) else value)
            assert isinstance(taken, bool) == isinstance(value, bool)
    assert bad >= (BAD if stride == 1 else 50)


@pytest.mark.parametrize(("path", "model", "key"), [pytest.param(*k, id=f"{k[0]}.{k[2]}") for k in keys()])
def test_what_is_outside_its_range_is_named(path: str, model: type[BaseModel], key: str) -> None:
    """The message names the key as written in the scenario."""
    info = model.model_fields[key]
    values = [value for value in edges(info) if outside(info, value)]
    values += [math.nan, "x" * 10_001, b"", (math.inf,)]
    for value in values:
        message = refused(lambda value=value: load_scenario(BASE, {f"{path}.{key}".lstrip("."): value}))
        if message is None:
            assert value == "x" * 10_001  # a source, or the name of a function, may be long
            assert key in ("source", "function")
        else:
            assert re.search(rf"\b{key}\b", message), (value, message)
            assert "\n" not in message


AT_THE_EDGE: tuple[dict[str, Any], ...] = (
    {"track.friction": 1.0, "track.cant": 0.0, "irregularity.scale": 0.0, "train.distance": 1e-15},
    {"track.friction": 1e-15, "numerics.passes": 20, "irregularity.taper": 1e-15},
    {"numerics.time_step": 1e-6, "train.distance": 0.05},
    {"train.speed_kmh": 1000.0, "numerics.modes_per_metre": 0.2},
    {"train.speed_kmh": 0.1, "train.distance": 0.01},
    {"numerics.absorbing_zone": 0.0, "contact.smoothing": 0.0, "output.deflection_interval": 1e-6},
    {"contact.smoothing": 2e-3, "track.fastening.vertical_stiffness": 1e15},
    {"track.slab.elements_x": 1, "track.slab.elements_y": 1, "train.vehicles.0.car.mass": 1e15},
    {"track.rail.nu": 0.0, "track.rail.kappa_vertical": 1.0, "irregularity.scale": 1e15},
)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # the run diverges on purpose, and the guard reports it
@pytest.mark.parametrize("settings", AT_THE_EDGE, ids=lambda s: next(iter(s)))
def test_runs_at_the_edge(settings: dict[str, Any], tmp_path: Path) -> None:
    """Two metres with values at the ends of their ranges give a result, a refusal or an event, never a crash."""
    path = tmp_path / "edge.h5"
    try:
        chosen = load_scenario("smooth", {"train.distance": 2.0, "output.run_in": 0.0, **settings})
        simulate.run(chosen, path).close()
    except (InputError, RunFailedError):
        pass
