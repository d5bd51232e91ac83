"""Vehicles: validated parameters, and reading them from presets or files (MODEL §4).

A vehicle is data: bodies, springs, dampers and stops. A file may give them one by one (``[[body]]``,
``[[spring]]``, ``[[damper]]``, ``[[stop]]``), or as a coach on two bogies (:mod:`tiengine.vehicle.coach`), or as a
coach with such extras.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import load_toml, to_tuples
from tiengine.parameters.presets import find_preset, preset_names
from tiengine.parameters.quantity import Name, Params, Q, Source, build
from tiengine.vehicle.coach import Coach, expand
from tiengine.vehicle.connector import Body, Damper, SeriesSprings, Spring, Stop, VehicleClass

__all__ = ["Vehicle", "load_vehicle", "vehicle_from_table", "vehicle_names"]


class Vehicle(Params):
    """Rigid bodies joined by springs, dampers and stops."""

    name: Name
    source: Source = ""
    vehicle_class: Annotated[
        VehicleClass | None, Field(description="selects the limits of indices; without it only those of all vehicles")
    ] = None
    wheel_radius: Annotated[float, Q("m", "r0", gt=0, le=1.5)]
    half_span_contact: Annotated[float, Q("m", "b0, half distance of the tape circles", gt=0, le=2)]
    length_over_couplers: Annotated[float, Q("m", "default pitch of the vehicles of a train", gt=0, le=100)]
    series_springs: SeriesSprings = False
    body: Annotated[tuple[Body, ...], Field(description="tables")]
    spring: Annotated[tuple[Spring, ...], Field(description="tables")] = ()
    damper: Annotated[tuple[Damper, ...], Field(description="tables")] = ()
    stop: Annotated[tuple[Stop, ...], Field(description="tables")] = ()

    @model_validator(mode="after")
    def _check(self) -> Vehicle:
        names = [body.name for body in self.body]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise InputError(f"{self.name}.body[{i}].name = {name!r}: must differ from the others")
        for kind in ("spring", "damper", "stop"):
            for i, joint in enumerate(getattr(self, kind)):
                for end in ("a", "b"):
                    if (name := getattr(joint, end)) not in names:
                        where = f"{self.name}.{kind}[{i}].{end} = {name!r}"
                        raise InputError(f"{where}: no such body{nearest(name, names)}")
        if not len(self.axle_positions):
            raise InputError(f"{self.name}.body: at least one must be a wheelset")
        if any(body.wheelset and body.y != 0.0 for body in self.body):
            raise InputError(f"{self.name}.body: a wheelset must be on the centre line, y = 0")
        if not np.diff(self.axle_positions).all():
            raise InputError(f"{self.name}.body: no two wheelsets may have the same x")
        return self

    @property
    def half_spacing(self) -> float:
        """b0, half distance of the wheels' tape circles [m]."""
        return self.half_span_contact

    @property
    def length(self) -> float:
        """Length over couplers [m]."""
        return self.length_over_couplers

    @property
    def mass(self) -> float:
        """Mass of the whole vehicle [kg]."""
        return float(sum(body.mass for body in self.body))

    @property
    def axle_positions(self) -> NDArray[np.float64]:
        """Wheelsets' x forward of the vehicle's centre, the leading one first [m], shape (wheelsets,)."""
        return np.sort([body.x for body in self.body if body.wheelset])[::-1]


def vehicle_names() -> list[str]:
    """List the vehicle presets of the library."""
    return preset_names("vehicles")


def load_vehicle(name_or_path: str, folder: Path | None = None) -> Vehicle:
    """Load a vehicle of the library or of a TOML file of the same form.

    Args:
        name_or_path: ``"CRH380A_v2"``, or the path of a file.
        folder: Where relative paths start; the working directory if None.

    Returns:
        The vehicle.

    Raises:
        InputError: There is no such preset or file, or a value breaks a rule.
    """
    path = find_preset("vehicles", name_or_path, folder=folder)
    return vehicle_from_table({"name": path.stem} | load_toml(path), path.stem)


def vehicle_from_table(table: Mapping[str, Any], where: str = "vehicle") -> Vehicle:
    """Build a vehicle from the tables of a file.

    Args:
        table: The file's content; with a ``geometry`` table a coach on two bogies, else a list of bodies.
        where: Names the vehicle in error messages.

    Returns:
        The vehicle.

    Raises:
        InputError: Unknown key, missing key, or a value that breaks a rule.
    """
    table = {key: to_tuples(value, f"{where}.{key}") for key, value in table.items()}
    if "geometry" in table:
        table = expand(build(Coach, table, where))
    return build(Vehicle, table, where)
