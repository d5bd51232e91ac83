"""Ingredients of a model from a scenario."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.table_cache import contact_table
from tiengine.contact.wheel_contacts import WheelContacts, wheel_contacts
from tiengine.irregularity.wheel_shapes import wheel_tables
from tiengine.model.given_sources import given_sources
from tiengine.model.ingredients import Ingredients, SlabDesigns
from tiengine.model.newmark import Newmark
from tiengine.scenario.contact_settings import contact_settings
from tiengine.scenario.scenario import Scenario
from tiengine.track.defects import fastening_factors
from tiengine.track.slab_matrices import slab_designs
from tiengine.vehicle.train import TrainModel, assemble, with_wheel_radii

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
    moving = scenario.track.base_motion.file is not None
    if scenario.track.line is not None or scenario.wind.speed is not None or asked.forces or moving:
        train = replace(train, K=train.K + train.K_leaning)
    contacts = _contacts(scenario, train)
    train = with_wheel_radii(train, np.array(parts.wheel_radii))
    return Ingredients(
        rail=parts.rail,
        fastening=parts.fastening,
        seat_factors=_seat_factors(scenario),
        slab=parts.slab,
        mortar=parts.mortar,
        designs=_designs(scenario),
        train=train,
        contact=contacts.tables[0],
        contacts=None if contacts.alike else contacts,
        friction=scenario.track.friction,
        cross_level_rolls=scenario.contact.cross_level_rolls_rails,
        length=scenario.window_length,
        modes=numerics.modes(scenario.window_length),
        grading=numerics.knots if numerics.trial_functions == "splines" else None,
        newmark=Newmark(dt),
        passes=numerics.passes,
        cover=numerics.slab_count == "cover",
        local_compliance=numerics.truncation == "local",
        absorbing_zone=numerics.absorbing_zone,
        explicit_mortar=numerics.mortar == "explicit",
        given=given_sources(scenario, train),
        shaped=bool(shapes or scenario.track.rail_shapes or scenario.track.ground),
        out_of_round=wheel_tables(shapes, parts.wheel_radii) if shapes else None,
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


def _designs(scenario: Scenario) -> SlabDesigns:
    """Sound design of the slabs, and one for each slab with a void or a failed fastening."""
    parts, track = scenario.parts, scenario.track
    voids = track.mortar_voids
    matrices, of_void = slab_designs(parts.slab, parts.mortar, voids, parts.fastening.baseplate)
    per_slab = parts.slab.fastenings
    damaged = set(of_void)
    for row in track.failed_fastenings:
        damaged.update(range(row.seats[0] // per_slab, row.seats[1] // per_slab + 1))
    order = sorted(damaged)
    sound = np.ones((per_slab, 2))
    scales = [fastening_factors(track.failed_fastenings, slab * per_slab, per_slab) for slab in order]
    return SlabDesigns(
        matrices=(matrices[0], *(matrices[of_void.get(slab, 0)] for slab in order)),
        seat_scale=np.stack([sound, *scales]),
        of_slab={slab: i + 1 for i, slab in enumerate(order)},
    )
