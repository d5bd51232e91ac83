"""Contact of a train whose wheels or rails differ: one table for each different pair of profiles, and radii.

A table knows a wheel's radius by the curvature of its patch only; within a few per cent, wheels of another radius share
it, and rolling radius and height follow from the radius itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.profile import Profile
from tiengine.contact.table import ContactSettings, ContactTable
from tiengine.kernels import layout as at
from tiengine.parameters.arrays import Reals

__all__ = ["WheelContacts", "wheel_contacts"]

Build = Callable[[Profile, Profile, ContactSettings], ContactTable]


@dataclass(frozen=True, eq=False)
class WheelContacts:
    """Tables and radii of all wheels.

    Attributes:
        tables: The different tables, that of the first left wheel first; all have the same nodes.
        number: Table of each wheel, shape (W, 2).
        radius: Radius of each wheel at its tape circle [m], shape (W, 2).
    """

    tables: tuple[ContactTable, ...]
    number: NDArray[np.int32]
    radius: Reals

    @property
    def alike(self) -> bool:
        """Whether all wheels share a table and have its radius."""
        return len(self.tables) == 1 and bool((self.radius == self.tables[0].settings.wheel_radius).all())

    @cached_property
    def values(self) -> Reals:
        """All tables, one after the other along the first axis, shape (tables n_u, n_alpha, 10 patches)."""
        return np.concatenate([table.values for table in self.tables])

    @property
    def numbers(self) -> Reals:
        """Numbers of the wheels from RADIUS_LEFT on (``layout``), shape (W, 8)."""
        found = np.empty((len(self.radius), at.N_WHEEL_NUMBERS - at.RADIUS_LEFT))
        of_tables = ([t.settings.wheel_radius for t in self.tables], [t.crown_offset for t in self.tables])
        own, crown = (np.array(values)[self.number] for values in of_tables)
        rows = len(self.tables[0].values)
        for first, values in (
            (at.RADIUS_LEFT, self.radius),
            (at.LARGER_LEFT, self.radius - own),
            (at.CROWN_LEFT, crown),
            (at.ROW_LEFT, rows * self.number),
        ):
            found[:, first - at.RADIUS_LEFT : first - at.RADIUS_LEFT + 2] = values
        return found


def wheel_contacts(
    wheels: Sequence[tuple[Profile, Profile]],
    rails: tuple[Profile, Profile],
    settings: Sequence[ContactSettings],
    radius: Reals,
    build: Build,
) -> WheelContacts:
    """Build the tables of all wheels, each different one once.

    Args:
        wheels: Profiles of the left and the right wheel of each wheelset.
        rails: Profiles of the left and the right rail.
        settings: Placement and material of each wheelset, with the nominal radius of its vehicle.
        radius: Radius of each wheel [m], shape (W, 2).
        build: Builds a table.

    Raises:
        InputError: Profiles that do not fit.
    """
    kinds: dict[tuple[object, ...], int] = {}
    tables: list[ContactTable] = []
    number = np.zeros(radius.shape, dtype=np.int32)
    for w, (pair, place) in enumerate(zip(wheels, settings, strict=True)):
        for side in range(2):
            key = (_shape(pair[side]), _shape(rails[side]), place.half_spacing, place.wheel_radius)
            if key not in kinds:
                kinds[key] = len(tables)
                tables.append(build(pair[side], rails[side], place))
            number[w, side] = kinds[key]
    return WheelContacts(tuple(tables), number, radius)


def _shape(profile: Profile) -> tuple[object, ...]:
    """Key of a profile: all that a table depends on, which its name is not."""
    return (profile.y.tobytes(), profile.z.tobytes(), profile.has_cant, profile.smoothing)
