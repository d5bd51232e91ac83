"""Profiles and radii of single wheels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tiengine.contact.profile import Profile
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q
from tiengine.scenario.part import Part
from tiengine.vehicle.vehicle import Vehicle

__all__ = ["WheelProfile", "profiles_and_radii"]

SIDES = {"left": (0,), "right": (1,), "both": (0, 1)}
LARGEST_SHARE = 0.05
"""Largest difference from the vehicle's radius over that radius: the table's curvature is then 5 % off, G 1 %."""
LARGEST_DIFFERENCE = 10e-3
"""Largest difference between the wheels of a wheelset [m]: it rolls the wheelset by 7 mrad of the table's 12."""

Number = Annotated[int, Q("-", "number", ge=1, le=1000)]


class WheelProfile(Params):
    """Profile or radius of single wheels; where entries overlap, the last one that states a key counts.

    Vehicles and wheelsets are counted from the front of the train from 1; wheels that all three keys choose are meant.
    A wheelset whose wheels are larger or smaller than its vehicle's stands on packed springs: what counts for heights
    is the difference between its two wheels.
    """

    vehicles: Annotated[tuple[Number, ...] | Literal["all"], Field(description="vehicles that have them")] = "all"
    wheelsets: Annotated[tuple[Number, ...] | Literal["all"], Field(description="wheelsets that have them")] = "all"
    side: Annotated[Literal["left", "right", "both"], Field(description="their wheels")] = "both"
    profile: Annotated[Part | None, Field(description="part: profile of these wheels")] = None
    radius: Annotated[float | None, Q("m", "radius at the tape circle", gt=0, le=2)] = None
    radius_difference: Annotated[
        float | None, Q("m", "radius at the tape circle less that of the vehicle's wheels", ge=-0.1, le=0.1)
    ] = None

    @model_validator(mode="after")
    def _check(self) -> WheelProfile:
        if self.profile is None and self.radius is None and self.radius_difference is None:
            raise InputError("train.wheel_profiles: must state profile, radius or radius_difference")
        if self.radius is not None and self.radius_difference is not None:
            raise InputError(f"train.wheel_profiles.radius = {self.radius:g}: must be left out with radius_difference")
        return self


def profiles_and_radii(
    entries: Sequence[WheelProfile], vehicles: Sequence[Vehicle], common: Profile, own: Mapping[int, Profile]
) -> tuple[tuple[tuple[Profile, Profile], ...], Reals]:
    """Find the profile and the radius of every wheel.

    Args:
        entries: Entries of the scenario.
        vehicles: The vehicles, the leading one first.
        common: Profile of wheels that have no other.
        own: Profiles of the entries that state one, by their place.

    Returns:
        Profiles of the left and the right wheel of each wheelset, and radii [m], shape (W, 2).

    Raises:
        InputError: Names the entry, its value and the rule.
    """
    vehicle = np.array([k for k, each in enumerate(vehicles) for _ in each.axle_positions])
    nominal = np.array([vehicles[k].wheel_radius for k in vehicle])
    radius = np.repeat(nominal[:, None], 2, axis=1)
    profiles = [[common, common] for _ in vehicle]
    for i, entry in enumerate(entries):
        where = f"train.wheel_profiles[{i}]"
        chosen = _chosen(entry, vehicle, where)
        for side in SIDES[entry.side]:
            if entry.radius is not None:
                radius[chosen, side] = entry.radius
            elif entry.radius_difference is not None:
                radius[chosen, side] = nominal[chosen] + entry.radius_difference
            if i in own:
                for pair, meant in zip(profiles, chosen, strict=True):
                    pair[side] = own[i] if meant else pair[side]
        _check_radii(entry, nominal[chosen], where)
    apart = np.abs(radius[:, 0] - radius[:, 1])
    if apart.max() > LARGEST_DIFFERENCE:
        w = int(np.argmax(apart))
        raise InputError(
            f"train.wheel_profiles: wheels of wheelset {w + 1} have radii {radius[w, 0]:g} and {radius[w, 1]:g} m;"
            f" they must differ by at most {1e3 * LARGEST_DIFFERENCE:g} mm"
        )
    return tuple((left, right) for left, right in profiles), radius


def _chosen(entry: WheelProfile, vehicle: NDArray[np.int64], where: str) -> NDArray[np.bool_]:
    """Wheelsets of an entry, shape (W,); ``vehicle`` is that of each wheelset."""
    chosen: NDArray[np.bool_] = np.ones(len(vehicle), dtype=np.bool_)
    for key, numbers, last in (
        ("vehicles", vehicle + 1, int(vehicle[-1]) + 1),
        ("wheelsets", np.arange(len(vehicle)) + 1, len(vehicle)),
    ):
        asked = getattr(entry, key)
        if asked == "all":
            continue
        if not asked or max(asked) > last:
            raise InputError(f'{where}.{key} = {list(asked)}: must be numbers from 1 to {last}, or "all"')
        chosen &= np.isin(numbers, asked)
    if not chosen.any():
        raise InputError(f"{where}.wheelsets = {list(entry.wheelsets)}: none of them belongs to these vehicles")
    return chosen


def _check_radii(entry: WheelProfile, nominal: Reals, where: str) -> None:
    """Refuse radii that are far from those of their vehicles [m]."""
    for key in ("radius", "radius_difference"):
        value = getattr(entry, key)
        if value is None:
            continue
        off = np.abs(value - nominal) if key == "radius" else np.full(1, abs(value))
        if (off > LARGEST_SHARE * nominal).any():
            raise InputError(
                f"{where}.{key} = {value:g}: must be within {100 * LARGEST_SHARE:g} % of the vehicle's wheel_radius ="
                f" {nominal[int(np.argmax(off - LARGEST_SHARE * nominal))]:g} m"
            )
