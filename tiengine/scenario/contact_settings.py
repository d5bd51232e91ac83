"""Contact-table settings of a scenario."""

from __future__ import annotations

import numpy as np

from tiengine.contact.table import ContactSettings
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario
from tiengine.vehicle.train import TrainModel


def contact_settings(scenario: Scenario, train: TrainModel) -> ContactSettings:
    """Placement and material of wheels and rails; all wheels of a train share one contact table.

    Raises:
        InputError: Vehicles whose wheels differ.
    """
    parts, track = scenario.parts, scenario.track
    for what, values in (("wheel_radius", train.wheel_radius), ("half_span_contact", train.half_spacing)):
        if np.ptp(values) > 0.0:
            raise InputError(
                f"train.vehicles: {what} is {values.min():g} and {values.max():g} m;"
                " vehicles of one train must agree, they share a contact table"
            )
    return ContactSettings(
        gauge=track.gauge,
        gauge_depth=track.gauge_depth,
        cant=track.cant,
        half_spacing=float(train.half_spacing[0]),
        wheel_radius=float(train.wheel_radius[0]),
        E=parts.rail.E,
        nu=parts.rail.nu,
        hertz=scenario.contact.hertz,
        smoothing=scenario.contact.smoothing,
        patches=scenario.contact.patches,
    )
