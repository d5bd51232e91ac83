"""Ingredients of a model from a scenario."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.table_cache import contact_table
from tiengine.contact.wheel_contacts import WheelContacts, wheel_contacts
from tiengine.irregularity.wheel_shapes import wheel_tables
from tiengine.model.given_sources import given_sources
from tiengine.model.ingredients import Ingredients, SlabDesigns
from tiengine.model.newmark import Newmark
from tiengine.model.slabs_at_rest import slabs_at_rest
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES
from tiengine.parameters.errors import InputError
from tiengine.scenario.contact_settings import contact_settings
from tiengine.scenario.scenario import Scenario
from tiengine.track.defects import FailedFastenings, fastening_factors, fastening_plays
from tiengine.track.slab_matrices import slab_designs
from tiengine.vehicle.train import TrainModel, assemble, static_wheel_loads, with_wheel_radii

__all__ = ["ingredients"]


def ingredients(scenario: Scenario, dt: float) -> Ingredients:
    """Build the ingredients of a model from the scenario's parts.

    Args:
        scenario: Checked scenario.
        dt: Time step [s].

    Raises:
        InputError: Parts that do not fit together.
    """
    parts, numerics = scenario.parts, scenario.numerics
    asked, shapes = scenario.train, scenario.train.wheel_shapes
    train = assemble(
        parts.vehicles,
        parts.centres,
        series_springs=asked.series_springs or None,
        effort=asked.effort,
        couplings=parts.couplings,
    )
    _check_wheel_loads(train)
    moving = scenario.track.base_motion.file is not None
    if scenario.track.line is not None or scenario.wind.speed is not None or asked.forces or moving:
        train = replace(train, K=train.K + train.K_leaning)
    contacts = _contacts(scenario, train)
    train = with_wheel_radii(train, np.array(parts.wheel_radii))
    designs = _designs(scenario)
    dead = slabs_at_rest(scenario, designs)
    return Ingredients(
        rail=parts.rail,
        fastening=parts.fastening,
        seat_factors=_seat_factors(scenario),
        slab=parts.slab,
        mortar=parts.mortar,
        designs=designs,
        train=train,
        contact=contacts.tables[0],
        contacts=None if contacts.alike else contacts,
        friction=scenario.track.friction,
        cross_level_rolls=scenario.contact.cross_level_rolls_rails,
        length=scenario.window_length,
        modes=numerics.modes(scenario.window_length),
        grading=scenario.grading if numerics.trial_functions == "splines" else None,
        newmark=Newmark(dt),
        passes=numerics.passes,
        cover=numerics.slab_count == "cover",
        local_compliance=numerics.truncation != "none",
        static_compliance=numerics.truncation == "static",
        absorbing_zone=numerics.absorbing_zone,
        explicit_mortar=numerics.mortar == "explicit",
        given=given_sources(scenario, train),
        shaped=bool(shapes or scenario.track.rail_shapes or scenario.track.ground or (dead and dead.uneven)),
        out_of_round=wheel_tables(shapes, parts.wheel_radii) if shapes else None,
        seat_plays=_seat_plays(scenario),
        dead=dead,
    )


def _check_wheel_loads(train: TrainModel) -> None:
    """Refuse vehicles that do not stand on all of their wheels."""
    loads = static_wheel_loads(train)
    w, side = np.unravel_index(int(np.argmin(loads)), loads.shape)
    if loads[w, side] <= 0.0:
        raise InputError(
            f"train.vehicles: wheelset {w + 1} {SIDES[side]} would carry {1e-3 * loads[w, side]:.3g} kN at rest; all"
            " wheels must carry: do the centres of gravity (x, y) lie between them, are masses in kg and stiffnesses in"
            " N/m?"
        )


def _contacts(scenario: Scenario, train: TrainModel) -> WheelContacts:
    """Contact tables of all wheels."""
    parts = scenario.parts
    settings = [contact_settings(scenario, train, w) for w in range(len(train.wheelset_x))]
    return wheel_contacts(parts.wheel_profiles, parts.rail_profiles, settings, parts.radii, contact_table)


def _seat_factors(scenario: Scenario) -> Callable[[int, int], NDArray[np.float64]]:
    """Function that gives the factors of consecutive seats, from the first and their number, shape (count, 2)."""
    failed = scenario.track.failed_fastenings
    return lambda first, count: fastening_factors(failed, first, count)


def _seat_plays(scenario: Scenario) -> Callable[[int, int], Reals] | None:
    """Function that gives the gaps of consecutive seats [m], None if none hangs."""
    failed = scenario.track.failed_fastenings
    if not any(row.gap for row in failed):
        return None
    return lambda first, count: fastening_plays(failed, first, count)


def _designs(scenario: Scenario) -> SlabDesigns:
    """Sound design of the slabs, and one for each slab with a void or fastenings that failed or hang."""
    parts, track = scenario.parts, scenario.track
    voids = [void for void in track.mortar_voids if void.factor != 1.0]  # those with a gap may be sound beyond it
    matrices, of_void = slab_designs(parts.slab, parts.mortar, voids, parts.fastening.baseplate)
    per_slab = parts.slab.fastenings
    damaged = set(of_void)
    for row in track.failed_fastenings:
        damaged.update(range(row.seats[0] // per_slab, row.seats[1] // per_slab + 1))
    order = sorted(damaged)
    sound = np.ones((per_slab, 2))
    scales = [_implicit_factors(track.failed_fastenings, slab * per_slab, per_slab) for slab in order]
    return SlabDesigns(
        matrices=(matrices[0], *(matrices[of_void.get(slab, 0)] for slab in order)),
        seat_scale=np.stack([sound, *scales]),
        of_slab={slab: i + 1 for i, slab in enumerate(order)},
    )


def _implicit_factors(failed: Sequence[FailedFastenings], first: int, count: int) -> Reals:
    """Factors of the fastenings whose share stands in the slab's implicit block: that of hanging ones does not."""
    hang = fastening_plays(failed, first, count) > 0.0
    return np.where(hang, 0.0, fastening_factors(failed, first, count))
