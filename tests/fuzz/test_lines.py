"""Random scenarios of imperfect wheels, rails and ground, wind, couplings, curves: refused in one line, or run.

Trains of one or two wagons on two wheelsets, in a window of some 10 m: a scenario is built, started and run for half a
metre within half a second. Each has one to three features with mostly sensible values, and often one value spoilt.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate
from validation.cases.klingel import wagon

COUNT = 1000
LEAST = COUNT // 5
"""Scenarios of either outcome that must be among them."""
KEY = r"(train|track|wind|contact|numerics|irregularity)\b"
ODD = (0.0, -1.0, 1e-300, 1e300, -0.0, float("inf"), float("nan"), 1e7, 3, 10**30, "x", "", True, None, (), {}, (1, 2))
LEAD, DISTANCE = 12.0, 0.5
"""Chainage of the leading wheel at the start, and distance [m]."""

Random = np.random.Generator
Feature = dict[str, Any]


def pick(random: Random, *values: Any) -> Any:
    return values[random.integers(len(values))]


def some(random: Random, count: int) -> Any:
    """Numbers of wheelsets or vehicles, or "all"."""
    if random.random() < 0.5:
        return "all"
    return tuple(int(n) for n in random.integers(1, count + 1, random.integers(1, 3)))


def wheel_shapes(random: Random) -> Feature:
    kind = pick(random, "harmonics", "flat")
    shape: dict[str, Any] = {"kind": kind, "wheelsets": some(random, 4), "side": pick(random, "left", "right", "both")}
    if kind == "flat":
        shape |= {"length": float(random.uniform(0.005, 0.06)), "form": pick(random, "new", "worn")}
        shape["angle"] = float(random.uniform(0.0, 6.3))
    else:
        orders = tuple(int(n) for n in random.integers(1, 30, random.integers(1, 4)))
        shape |= {"order": orders, "amplitude": tuple(float(a) for a in random.uniform(0.0, 1e-4, len(orders)))}
    return {"train.wheel_shapes": (shape,)}


def wheel_profiles(random: Random) -> Feature:
    entry: dict[str, Any] = {"wheelsets": some(random, 4), "side": pick(random, "left", "right", "both")}
    if random.random() < 0.5:
        entry["vehicles"] = some(random, 2)
    if random.random() < 0.5:
        entry["profile"] = pick(random, "LMA", "S1002")
    if random.random() < 0.7:
        entry["radius_difference"] = float(random.normal(0.0, 1e-3))
    found: Feature = {"train.wheel_profiles": (entry,)}
    if random.random() < 0.3:
        found[f"track.rail_profile_{pick(random, 'left', 'right')}"] = pick(random, "CHN60", "60E1")
    return found


def rail_shapes(random: Random) -> Feature:
    kind, at = pick(random, "corrugation", "weld", "joint"), LEAD + float(random.uniform(-0.1, 0.55))
    shape: dict[str, Any] = {"kind": kind, "rail": pick(random, "left", "right", "both")}
    shape["depth"] = float(random.normal(0.0, 1e-4))
    if kind == "corrugation":
        shape |= {"reach": (at, at + float(random.uniform(0.1, 5.0))), "wavelength": float(random.uniform(0.005, 2.0))}
        shape["taper"] = float(random.uniform(0.01, 0.2))
    else:
        shape |= {"at": at, "length": float(random.uniform(0.1, 2.0))}
    return {"track.rail_shapes": (shape,)}


def ground(random: Random) -> Feature:
    shape = {
        "kind": pick(random, "cosine", "angles", "ramp"), "at": LEAD + float(random.uniform(-0.1, 0.55)),
        "length": float(random.uniform(1.0, 30.0)), "depth": float(random.normal(0.0, 5e-3)),
    }  # fmt: skip
    if random.random() < 0.3:
        shape["lateral"] = float(random.normal(0.0, 2e-3))
    return {"track.ground": (shape,)}


def wind(random: Random) -> Feature:
    found: Feature = {"wind.speed": float(random.uniform(0.0, 30.0))}
    if random.random() < 0.4:
        found["wind.speed"] = ((0.0, 5.0), (float(random.uniform(1.0, 20.0)), float(random.uniform(-20.0, 30.0))))
        found["wind.over"] = pick(random, "time", "chainage")
    elif random.random() < 0.5:
        found |= {"wind.gust": "en14067", "wind.gust_at": LEAD + float(random.uniform(-5.0, 20.0))}
    return found


def forces(random: Random) -> Feature:
    force = {
        "vehicle": int(pick(random, 1, 1, 1, 2)), "body": pick(random, "car", "car", "wheelset 1", "frame 1"),
        "motion": pick(random, "y", "z", "roll", "pitch", "yaw"), "over": pick(random, "time", "chainage"),
        "rows": ((0.0, 0.0), (float(random.uniform(0.01, 20.0)), float(random.normal(0.0, 1e4)))),
    }  # fmt: skip
    return {"train.forces": (force,)}


def couplings(random: Random) -> Feature:
    part = pick(random, "EMU_intercar", "gangway")
    found: Feature = {"train.couplings": ({"part": part, "behind": pick(random, "all", (1,), (1,), (2,))},)}
    return found | ({"train.vehicles": (wagon(1e7), wagon(1e7))} if random.random() < 0.9 else {})


def alignment(random: Random) -> Feature:
    elements: list[dict[str, Any]] = [{"kind": "straight", "length": float(random.uniform(1.0, 20.0))}]
    elements.append({"kind": "transition", "length": float(random.uniform(20.0, 200.0))})
    radius = float(pick(random, -1.0, 1.0) * 10.0 ** random.uniform(2.3, 4.0))
    cant = float(np.sign(radius) * random.uniform(0.0, 150.0))
    elements.append({"kind": "arc", "length": 500.0, "radius": radius, "cant_mm": cant})
    first = int(pick(random, 0, 0, 1, 2))  # a train may stand in the arc, where a line begins with it
    return {"track.alignment": tuple(elements[first:]), "contact.patches": int(pick(random, 1, 1, 2))}


def lifting(random: Random) -> Feature:
    slab, seat = int(LEAD // 5.67), int(LEAD // 0.63)
    x = float(random.uniform(0.0, 5.0))
    found: Feature = {"track.mortar_no_tension": random.random() < 0.95}
    if random.random() < 0.7:
        found["track.slab_warps"] = ({"gradient": float(random.normal(0.0, 60.0))},)
    if random.random() < 0.7:
        void = {"slab": slab, "x": (x, x + float(random.uniform(0.01, 2.0))), "y": (-1.25, 1.25)}
        found["track.mortar_voids"] = (void | {"gap": float(10.0 ** random.uniform(-6.0, -1.0))},)
    if random.random() < 0.5:
        gap = float(10.0 ** random.uniform(-6.0, -2.0))
        found["track.failed_fastenings"] = ({"seats": (seat, seat + 1), "gap": gap},)
    return found


FEATURES: tuple[Callable[[Random], Feature], ...] = (
    wheel_shapes, wheel_profiles, rail_shapes, ground, wind, forces, couplings, alignment, lifting,
)  # fmt: skip


def spoil(random: Random, value: Any) -> Any:
    """A value with one number, text or list in it replaced."""
    if isinstance(value, dict) and value and random.random() < 0.95:
        key = pick(random, *value)
        return {**value, key: spoil(random, value[key])}
    if isinstance(value, tuple) and value and random.random() < 0.9:
        i = random.integers(len(value))
        return (*value[:i], spoil(random, value[i]), *value[i + 1 :])
    return pick(random, *ODD)


def scenario_tables(seed: int) -> Feature:
    """Overrides of the seed's scenario."""
    random = np.random.default_rng((16, seed))
    vehicles = tuple(wagon(1e7) for _ in range(int(random.integers(1, 3))))
    found: Feature = {
        "train.vehicles": vehicles,
        "train.speed_kmh": float(pick(random, 20.0, 40.0, 60.0)),
        "train.distance": DISTANCE,
        "irregularity.taper": 0.1,
        "numerics.time_step": 1e-4,
        "output.run_in": 0.0,
        "output.deflection_interval": "none",
    }
    for feature in random.choice(len(FEATURES), random.integers(1, 4), replace=False):
        found |= FEATURES[feature](random)
    span = 2.5 + 6.0 * (len(found["train.vehicles"]) - 1)
    found |= {"numerics.window": span + 5.0, "train.start": LEAD - 1.25}
    if random.random() < 0.3:
        key = pick(
            random, *[key for key in found if key.startswith(("wind", "track", "train.w", "train.f", "train.c"))]
        )
        found[key] = spoil(random, found[key])
    return found


def outcome(seed: int) -> str | None:
    """Refusal of the seed's scenario, a failure's reason, or None if it ran and all forces are finite."""
    try:
        chosen = load_scenario("smooth", scenario_tables(seed))
        with warnings.catch_warnings(), simulate.run(chosen) as result:
            warnings.simplefilter("ignore")
            forces = result.wheel()
            assert all(np.isfinite(forces[name]).all() for name in ("vertical_force", "lateral_force")), seed
    except RunFailedError as failure:
        return f"run: {failure}"
    except InputError as error:
        return str(error)
    return None


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # forces of any size: runs may diverge, and say so
def test_random_scenarios_are_refused_in_one_line_or_run():
    found = [outcome(seed) for seed in range(COUNT)]
    refused = [text for text in found if text is not None and not text.startswith("run: ")]
    for text in refused:
        assert "\n" not in text
        assert len(text) < 500, text
    ran = found.count(None)
    assert LEAST <= len(refused) <= COUNT - LEAST
    assert ran >= LEAST
