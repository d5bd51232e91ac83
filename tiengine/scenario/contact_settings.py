"""Contact-table settings of a scenario."""

from __future__ import annotations

from tiengine.contact.table import ContactSettings
from tiengine.scenario.scenario import Scenario
from tiengine.vehicle.train import TrainModel


def contact_settings(scenario: Scenario, train: TrainModel, wheelset: int = 0) -> ContactSettings:
    """Placement and material of the wheels of a wheelset and the rails.

    The radius is that of the vehicle: what single wheels have beyond it needs no table of its own.

    Args:
        scenario: The scenario.
        train: Its train.
        wheelset: Number of the wheelset.
    """
    parts, track = scenario.parts, scenario.track
    vehicle = parts.vehicles[train.wheelset_vehicle[wheelset]]
    return ContactSettings(
        gauge=track.gauge,
        gauge_depth=track.gauge_depth,
        cant=track.cant,
        half_spacing=vehicle.half_spacing,
        wheel_radius=vehicle.wheel_radius,
        E=parts.rail.E,
        nu=parts.rail.nu,
        hertz=scenario.contact.hertz,
        smoothing=scenario.contact.smoothing,
        patches=scenario.contact.patches,
    )
