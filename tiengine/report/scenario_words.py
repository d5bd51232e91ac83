"""Scenario in sentences: train, track, irregularity, defects and numerics."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tiengine.scenario.ensemble import Ensemble
from tiengine.track.alignment import CANT_BASE

if TYPE_CHECKING:
    from tiengine.scenario.parts import Parts
    from tiengine.scenario.scenario import Scenario
    from tiengine.track.defects import FailedFastenings
    from tiengine.track.mortar import MortarVoid
from tiengine.track.slab_warp import SlabWarp

__all__ = ["scenario_words"]

GROUND = {"cosine": "a cosine", "angles": "two ramps that meet", "ramp": "a ramp"}


def scenario_words(scenario: Scenario) -> list[tuple[str, str]]:
    """Describe a scenario.

    Args:
        scenario: Scenario of one train or of an ensemble.

    Returns:
        Headings and sentences.
    """
    rows = [
        ("Train", _train(scenario)),
        ("Track", _track(scenario)),
        ("Line", _line(scenario)),
        ("Irregularity", _irregularity(scenario)),
        ("Defects", "; ".join(_defects(scenario)) or "none"),
        ("Numerics", _numerics(scenario)),
    ]
    if ground := "; ".join(_ground(scenario)):
        rows.insert(3, ("Ground", ground))
    if scenario.ensemble != Ensemble():
        rows.insert(0, ("Trains", _ensemble(scenario)))
    if scenario.source:
        rows.append(("Source", scenario.source))
    return rows


def _train(scenario: Scenario) -> str:
    train, parts = scenario.train, scenario.parts
    counts = Counter(vehicle.name for vehicle in parts.vehicles)
    vehicles = ", ".join(f"{number} x {name}" if number > 1 else name for name, number in counts.items())
    if isinstance(train.speed_kmh, tuple):
        speed = ", ".join(f"{v:g} km/h at {x:g} m" for x, v in train.speed_kmh)
    else:
        speed = f"{train.speed_kmh:g} km/h"
    return f"{vehicles} with {_wheels(parts)}, over {train.distance:g} m at {speed}"


def _wheels(parts: Parts) -> str:
    """Profiles of the wheels, and their radii where these differ from the vehicle's."""
    names = Counter(profile.name for pair in parts.wheel_profiles for profile in pair)
    (common, _), *others = names.most_common()
    words = f"{common} wheels" + "".join(f", {count} of {name}" for name, count in others)
    nominal = np.array([v.wheel_radius for v in parts.vehicles for _ in v.axle_positions])
    count = int((parts.radii != nominal[:, None]).sum())
    if not count:
        return words
    return f"{words} ({count} with radii of their own, all from {parts.radii.min():g} to {parts.radii.max():g} m)"


def _railheads(parts: Parts) -> str:
    """Profiles of the rails."""
    left, right = (profile.name for profile in parts.rail_profiles)
    return f"{left} profile" if left == right else f"{left} profile on the left and {right} on the right"


def _track(scenario: Scenario) -> str:
    parts, track = scenario.parts, scenario.track
    slab, fastening = parts.slab, parts.fastening
    return (
        f"{parts.rail.name} rails with {_railheads(parts)}, cant {_cant(track.cant)}, gauge"
        f" {1e3 * track.gauge:g} mm, friction {track.friction:g}; {fastening.name} fastenings"
        f" ({1e-6 * fastening.vertical_stiffness:g} kN/mm) every {slab.fastening_pitch:g} m; {slab.name} slabs of"
        f" {slab.length:g} x {slab.width:g} x {slab.thickness:g} m on a bed of {1e-9 * parts.mortar.stiffness:g} N/mm³"
        f"{', which does not pull' if parts.mortar.no_tension else ''}"
    )


def _line(scenario: Scenario) -> str:
    line = scenario.track.line
    if line is None:
        return "straight and level"
    curvature, cant = float(np.abs(line.curvature).max()), 1e3 * CANT_BASE * float(np.abs(np.sin(line.roll)).max())
    curves = (
        f"curves down to a radius of {1.0 / curvature:.4g} m, cant up to {cant:.3g} mm" if curvature else "straight"
    )
    gradient = 1e3 * float(np.abs(line.gradient).max())
    return f"{curves}, {f'gradients up to {gradient:.3g} ‰' if gradient else 'level'}"


def _cant(cant: float) -> str:
    return f"1:{1.0 / cant:g}" if cant > 0.0 else "0"


def _irregularity(scenario: Scenario) -> str:
    track = scenario.irregularity
    if track.file is not None:
        words = f"measured, {Path(track.file).name}"
    elif track.function is not None:
        words = f"given by the Python function {track.function}"
    elif track.spectrum == "none":
        words = "none, a smooth track"
    else:
        waves = f"waves of {track.wavelength_min:g} to {track.wavelength_max:g} m"
        words = f"spectrum {track.spectrum}, {waves}, seed {track.seed}"
    if track.scale != 1.0:
        words += f", scaled by {track.scale:g}"
    return words + (f", and short waves down to {track.short_wave_min:g} m" if track.short_wave else "")


def _defects(scenario: Scenario) -> Iterator[str]:
    slab = scenario.parts.slab
    for row in scenario.track.failed_fastenings:
        yield _fastenings(row, slab.fastening_pitch)
    for void in scenario.track.mortar_voids:
        yield _void(void)
    for warp in scenario.track.slab_warps:
        yield _warp(warp)


def _ground(scenario: Scenario) -> Iterator[str]:
    """Displacements of the ground, then its motion in time."""
    for each in scenario.track.ground:
        if each.file is not None:
            yield f"displaced by {Path(each.file).name}" + (f", times {each.scale:g}" if each.scale != 1.0 else "")
            continue
        sizes = (("down", "up", each.depth), ("to the right", "to the left", each.lateral))
        moved = [f"{1e3 * abs(size):g} mm {plus if size > 0.0 else minus}" for plus, minus, size in sizes if size]
        yield f"displaced {' and '.join(moved)}, {GROUND[each.kind]} over {each.length:g} m at chainage {each.at:g} m"
    moving = scenario.track.base_motion
    if moving.file is not None:
        scale = f", times {moving.scale:g}" if moving.scale != 1.0 else ""
        speed = "everywhere at once" if moving.wave_speed is None else f"travelling at {moving.wave_speed:g} m/s"
        yield f"moving in time by {Path(moving.file).name}{scale}, {speed}, from {moving.start:g} s on"


def _fastenings(row: FailedFastenings, pitch: float) -> str:
    first, last = row.seats
    count = last - first + 1
    state = "failed" if row.factor == 0.0 else f"at {100.0 * row.factor:g} % of their stiffness"
    if row.gap:
        state = f"hanging by {1e3 * row.gap:g} mm" + ("" if row.factor == 1.0 else f", {state}")
    rails = "both rails" if row.rail == "both" else f"the {row.rail} rail"
    where = f"seat {first}" if count == 1 else f"seats {first} to {last}"
    begin, end = ((seat + 0.5) * pitch for seat in row.seats)
    span = f"{begin:.1f} m" if count == 1 else f"{begin:.1f} to {end:.1f} m"
    return f"{count} {'fastening' if count == 1 else 'fastenings'} of {rails} {state} ({where}, chainage {span})"


def _void(void: MortarVoid) -> str:
    state = "no mortar" if void.factor == 0.0 else f"mortar at {100.0 * void.factor:g} % of its stiffness"
    if void.gap:
        state = f"a gap of {1e3 * void.gap:g} mm" + ("" if void.factor == 1.0 else f", {state} below,")
    area = (void.x[1] - void.x[0]) * (void.y[1] - void.y[0])
    return f"{state} under {area:.2g} m² of slab {void.slab} (from its rear edge {void.x[0]:g} to {void.x[1]:g} m)"


def _warp(warp: SlabWarp) -> str:
    which = "all slabs" if warp.slabs is None else f"slabs {warp.slabs[0]} to {warp.slabs[1]}"
    return f"{which} {'warmer' if warp.gradient > 0.0 else 'colder'} at the top by {abs(warp.gradient):g} K/m"


def _numerics(scenario: Scenario) -> str:
    numerics = scenario.numerics
    step = "chosen by trial" if numerics.time_step == "auto" else f"{numerics.time_step:g} s"
    return (
        f"window of {scenario.window_length:g} m with {scenario.trial_functions.count} {numerics.trial_functions} a"
        f" field, time step {step}, {numerics.passes} passes, compliance that they lack: {numerics.truncation}, start:"
        f" {numerics.start}"
    )


def _ensemble(scenario: Scenario) -> str:
    ensemble = scenario.ensemble
    varied = ", ".join(f"{key} in {len(values)} values" for key, values in ensemble.vary.items())
    return f"{ensemble.size} realisations of the irregularity" + (f", {varied}" if varied else "")
