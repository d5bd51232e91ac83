"""Parts of a scenario: vehicles, rail, slab, fastening and profiles from names, paths and tables.

A named part is looked up among the scenario's own presets first, then in the library, or read from its path.
Loading copies every preset and file into the scenario, so that a resolved scenario needs no other files.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.point_list import Kind
from tiengine.contact.profile import Profile
from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import load_toml, to_tuples
from tiengine.parameters.presets import KINDS, find_preset
from tiengine.parameters.quantity import build
from tiengine.scenario.part import Presets
from tiengine.scenario.profile_part import build_profile, profile_table
from tiengine.scenario.wheel_profiles import profiles_and_radii
from tiengine.track.fastening import Fastening
from tiengine.track.mortar import Mortar
from tiengine.track.rail import Rail
from tiengine.track.slab import Slab
from tiengine.vehicle.coupling import Coupling
from tiengine.vehicle.vehicle import Vehicle, vehicle_from_table
from tiengine.vehicle.wind import Aerodynamics

if TYPE_CHECKING:
    from tiengine.scenario.tables import BlowingWind, Track, Train

__all__ = ["Parts", "build_parts", "collect_presets", "used_presets"]

RAILHEADS = ("rail_profile_left", "rail_profile_right")


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts that a scenario refers to.

    Attributes:
        vehicles: The vehicles, the leading one first.
        centres: Vehicle centres relative to the first's [m], shape (vehicles,); 0, then negative.
        wheel: Profile of wheels that have no other.
        rail: Section of the rail.
        rail_profile: Profile of railheads that have no other, upright unless it says otherwise.
        wheel_profiles: Profiles of the left and the right wheel of each wheelset, the leading one first.
        radii: Radius of each wheel at its tape circle [m], shape (wheelsets, 2).
        rail_profiles: Profiles of the left and the right railhead.
        slab: Slab.
        mortar: Mortar bed of the slab.
        fastening: Fastening.
        couplings: Couplings, each with the number of the vehicle ahead, from 0.
        aerodynamics: Coefficients of the car bodies; None without wind.
        forced: Number in the train of the body of every given force.
    """

    vehicles: tuple[Vehicle, ...]
    centres: NDArray[np.float64]
    wheel: Profile
    rail: Rail
    rail_profile: Profile
    wheel_profiles: tuple[tuple[Profile, Profile], ...]
    radii: NDArray[np.float64]
    rail_profiles: tuple[Profile, Profile]
    slab: Slab
    mortar: Mortar
    fastening: Fastening
    couplings: tuple[tuple[int, Coupling], ...] = ()
    aerodynamics: Aerodynamics | None = None
    forced: tuple[int, ...] = ()

    @property
    def wheelset_positions(self) -> NDArray[np.float64]:
        """Wheelsets relative to the first vehicle's centre, the leading one first [m], shape (wheelsets,)."""
        rows = [x + v.axle_positions for x, v in zip(self.centres, self.vehicles, strict=True)]
        return np.concatenate(rows)

    @property
    def wheel_radii(self) -> tuple[float, ...]:
        """Mean radius of every wheelset's wheels, r0, the leading one first [m]."""
        return tuple(self.radii.mean(axis=1).tolist())

    @property
    def wheel_span(self) -> float:
        """Distance between the outer wheelsets [m]."""
        return float(np.ptp(self.wheelset_positions))


def collect_presets(train: Train, track: Track, wind: BlowingWind, presets: Presets, folder: Path | None) -> Presets:
    """Copy every preset that a scenario names into it.

    Args:
        train: Train table; names vehicles and wheel profile.
        track: Track table; names rail, rail profile, slab and fastening.
        wind: Wind table; names coefficients.
        presets: Presets of the scenario; they are not looked up again.
        folder: Where relative paths start.

    Returns:
        Tables by kind and name, complete.

    Raises:
        InputError: A name that is neither a preset nor a file; a kind that does not exist.
    """
    for kind in presets:
        if kind not in KINDS:
            raise InputError(f"presets.{kind}: unknown kind of preset{nearest(kind, KINDS)}")
    found = {kind: dict(tables) for kind, tables in presets.items()}
    for where, kind, part in _references(train, track, wind):
        stated: dict[str, Any] = {} if isinstance(part, str) else part
        name = part if isinstance(part, str) else part.get("like")
        tables = found.setdefault(kind, {})
        seen: set[Any] = set()
        while name is not None:  # a preset may itself start from another one
            if not isinstance(name, str):
                raise InputError(f"{where}.like = {str(name)[:80]}: must be the name of a preset or the path of a file")
            if name in seen:
                raise InputError(f"{where} = {name!r}: is defined in terms of itself")
            seen.add(name)
            if name not in tables:
                tables[name] = _read(where, kind, name, folder, stated)
            stated = {**tables[name], **stated}
            name = tables[name].get("like")
    return found


def used_presets(train: Train, track: Track, wind: BlowingWind, presets: Presets) -> Presets:
    """Presets that a scenario refers to, out of those of many scenarios.

    Args:
        train: The train's table.
        track: The track's table.
        wind: The wind's table.
        presets: Result of :func:`collect_presets`, of this scenario and of others.
    """
    found: Presets = {}
    for _, kind, part in _references(train, track, wind):
        name = part if isinstance(part, str) else part.get("like")
        while name in presets.get(kind, {}) and name not in found.setdefault(kind, {}):
            found[kind][name] = presets[kind][name]
            name = presets[kind][name].get("like")
    return found


def build_parts(train: Train, track: Track, wind: BlowingWind, presets: Presets) -> Parts:
    """Build and check every part.

    Args:
        train: The train's table.
        track: The track's table.
        wind: The wind's table.
        presets: Result of :func:`collect_presets`; other names are read from the library.

    Returns:
        The parts.

    Raises:
        InputError: The first value that breaks a rule, as ``train.vehicles[0].car.mass = -1: ...``.
    """
    presets = collect_presets(train, track, wind, presets, None)
    tables = {where: _resolved(kind, part, presets) for where, kind, part in _references(train, track, wind)}
    vehicles = []
    for i in range(len(train.vehicles)):
        table = tables[f"train.vehicles[{i}]"]
        table.setdefault("name", "vehicle")
        vehicles.append(vehicle_from_table(table, f"train.vehicles[{i}]"))
    slab_table = tables["track.slab"]
    mortar_table = slab_table.pop("mortar", None)
    if not isinstance(mortar_table, dict):
        raise InputError(
            "track.slab.mortar: missing; a table of the bed's properties is required, or like = the name of a preset"
        )
    mortar = build(Mortar, mortar_table, "track.slab.mortar")
    if track.mortar_no_tension:
        mortar = mortar.model_copy(update={"no_tension": True})
    wheel, wheels, radii = _wheels(train, vehicles, tables)
    rails = _railheads(track, tables)
    return Parts(
        vehicles=tuple(vehicles),
        centres=_centres(vehicles, train),
        wheel=wheel,
        rail=build(Rail, tables["track.rail"], "track.rail"),
        rail_profile=rails[0],
        wheel_profiles=wheels,
        radii=radii,
        rail_profiles=(rails[1], rails[2]),
        slab=build(Slab, slab_table, "track.slab"),
        mortar=mortar,
        fastening=build(Fastening, tables["track.fastening"], "track.fastening"),
        couplings=_couplings(train, vehicles, tables),
        aerodynamics=_aerodynamics(wind, vehicles, tables),
        forced=tuple(
            _body(vehicles, entry.vehicle, entry.body, f"train.forces[{i}]") for i, entry in enumerate(train.forces)
        ),
    )


def _references(train: Train, track: Track, wind: BlowingWind) -> Iterator[tuple[str, str, str | dict[str, Any]]]:
    """Key, kind and value of every part that a scenario refers to."""
    for i, vehicle in enumerate(train.vehicles):
        yield f"train.vehicles[{i}]", "vehicles", vehicle
    for i, coupled in enumerate(train.couplings):
        yield f"train.couplings[{i}].part", "couplings", coupled.part
    yield "train.wheel_profile", "profiles", train.wheel_profile
    for i, entry in enumerate(train.wheel_profiles):
        if entry.profile is not None:
            yield f"train.wheel_profiles[{i}].profile", "profiles", entry.profile
    yield "track.rail", "rails", track.rail
    yield "track.rail_profile", "profiles", track.rail_profile
    for key in RAILHEADS:
        if (part := getattr(track, key)) is not None:
            yield f"track.{key}", "profiles", part
    yield "track.slab", "slabs", track.slab
    yield "track.fastening", "fastenings", track.fastening
    if wind.speed is not None:
        yield "wind.aerodynamics", "aerodynamics", wind.aerodynamics


def _read(where: str, kind: str, name: str, folder: Path | None, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Table of a preset or file, of which the scenario states some keys itself."""
    path = find_preset(kind, name, folder=folder, called=where)
    if path.suffix == ".toml":
        return load_toml(path)
    body: Kind = "wheel" if where.startswith("train.") else "rail"
    return profile_table(path, body, f"{where} = {name!r}", stated)


def _resolved(kind: str, part: str | dict[str, Any], presets: Presets) -> dict[str, Any]:
    """Complete table of a part: its own keys over those of the preset it starts from."""
    chain: list[Mapping[str, Any]] = []
    current: str | Mapping[str, Any] | None = part
    while current is not None:
        if isinstance(current, str):
            current = presets[kind][current]
        chain.append({key: value for key, value in current.items() if key != "like"})
        current = current.get("like")
    table: dict[str, Any] = {}
    for layer in reversed(chain):
        table = _merged(table, layer)
    return table


def _merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """``base`` with the keys of ``over``, table by table."""
    merged = dict(base)
    for key, value in over.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merged(merged[key], value) if both else value
    return merged


def _wheels(
    train: Train, vehicles: list[Vehicle], tables: Mapping[str, dict[str, Any]]
) -> tuple[Profile, tuple[tuple[Profile, Profile], ...], NDArray[np.float64]]:
    """Profile of all wheels that have no other, profiles and radii of every wheel."""
    common = build_profile(tables["train.wheel_profile"], "train.wheel_profile", "wheel")
    own = {}
    for i, entry in enumerate(train.wheel_profiles):
        if entry.profile is not None:
            where = f"train.wheel_profiles[{i}].profile"
            own[i] = build_profile(tables[where], where, "wheel")
    return common, *profiles_and_radii(train.wheel_profiles, vehicles, common, own)


def _railheads(track: Track, tables: Mapping[str, dict[str, Any]]) -> tuple[Profile, Profile, Profile]:
    """Profile of railheads that have no other, of the left and of the right one."""
    common = build_profile(tables["track.rail_profile"], "track.rail_profile", "rail")
    left, right = (
        common if getattr(track, key) is None else build_profile(tables[f"track.{key}"], f"track.{key}", "rail")
        for key in RAILHEADS
    )
    return common, left, right


def _aerodynamics(
    wind: BlowingWind, vehicles: list[Vehicle], tables: Mapping[str, dict[str, Any]]
) -> Aerodynamics | None:
    """Coefficients of the car bodies; None without wind."""
    if wind.speed is None:
        return None
    for number in range(1, len(vehicles) + 1) if wind.vehicles == "all" else wind.vehicles:
        _body(vehicles, number, wind.body, "wind", "vehicles")
    return build(Aerodynamics, to_tuples(tables["wind.aerodynamics"], "wind.aerodynamics"), "wind.aerodynamics")


def _body(vehicles: list[Vehicle], number: int, name: str, where: str, key: str = "vehicle") -> int:
    """Number in the train of a body of a vehicle, which is counted from 1."""
    if number > len(vehicles):
        raise InputError(f"{where}.{key} = {number}: must be a number from 1 to {len(vehicles)}")
    names = [body.name for body in vehicles[number - 1].body]
    if name not in names:
        raise InputError(f"{where}.body = {name!r}: no such body of vehicle {number}{nearest(name, names)}")
    return sum(len(vehicle.body) for vehicle in vehicles[: number - 1]) + names.index(name)


def _couplings(
    train: Train, vehicles: list[Vehicle], tables: Mapping[str, dict[str, Any]]
) -> tuple[tuple[int, Coupling], ...]:
    """Couplings behind the vehicles that have them."""
    found = []
    for i, entry in enumerate(train.couplings):
        where = f"train.couplings[{i}]"
        behind = tuple(range(1, len(vehicles))) if entry.behind == "all" else entry.behind
        if not behind or max(behind) >= len(vehicles):
            rule = f"must be numbers from 1 to {len(vehicles) - 1}" if len(vehicles) > 1 else "needs two vehicles"
            raise InputError(f"{where}.behind = {entry.behind if entry.behind == 'all' else list(behind)!r}: {rule}")
        coupling = build(Coupling, to_tuples(tables[f"{where}.part"], f"{where}.part"), f"{where}.part")
        for k in behind:
            coupling.check_bodies(vehicles[k - 1], vehicles[k], f"{where}.part")
            found.append((k - 1, coupling))
    return tuple(found)


def _centres(vehicles: list[Vehicle], train: Train) -> NDArray[np.float64]:
    """Vehicle centres relative to the first's [m]."""
    pitch = train.coupler_pitch
    couplings = len(vehicles) - 1
    if pitch is None:
        gaps = [(a.length + b.length) / 2.0 for a, b in pairwise(vehicles)]
    elif isinstance(pitch, tuple):
        gaps = list(pitch)
    else:
        gaps = [pitch] * couplings
    if len(gaps) != couplings:
        raise InputError(f"train.coupler_pitch = {list(gaps)}: must be one number or {couplings}, one per coupling")
    centres = 0.0 - np.concatenate([[0.0], np.cumsum(gaps)])
    for i in range(couplings):
        least = vehicles[i + 1].axle_positions[0] - vehicles[i].axle_positions[-1]
        if not least < gaps[i] < 1000.0:
            rule = f"must be between {least:g} m, where the wheelsets of neighbours meet, and 1000 m"
            raise InputError(f"train.coupler_pitch = {gaps[i]:g}: {rule}")
    return centres
