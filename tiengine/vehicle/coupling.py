"""Couplings between neighbouring vehicles: springs, dampers and stops between their bodies (MODEL §16).

Points are given from the coupling plane, where the two vehicles meet: x forward, y right, height above the rails. Body
``a`` belongs to the vehicle ahead, ``b`` to the one behind. Without a longitudinal coordinate of the vehicles a
coupling has no longitudinal springs; a longitudinal damper acts by pitch and yaw.
"""

from __future__ import annotations

from typing import Annotated, TypeVar

from pydantic import Field, model_validator

from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.quantity import Name, Params, Source
from tiengine.vehicle.connector import Damper, Joint, Spring, Stop
from tiengine.vehicle.vehicle import Vehicle

__all__ = ["Coupling", "placed"]

Connector = TypeVar("Connector", bound=Joint)


class Coupling(Params):
    """Connectors between a vehicle and the one behind it.

    In their tables `a` is a body of the vehicle ahead, `b` of the one behind; points count from the plane in which the
    vehicles meet.
    """

    name: Name = "coupling"
    source: Source = ""
    spring: Annotated[tuple[Spring, ...], Field(description="tables", max_length=100)] = ()
    damper: Annotated[tuple[Damper, ...], Field(description="tables", max_length=100)] = ()
    stop: Annotated[tuple[Stop, ...], Field(description="tables", max_length=100)] = ()

    @model_validator(mode="after")
    def _check(self) -> Coupling:
        if not (self.spring or self.damper or self.stop):
            raise InputError(f"{self.name}: a coupling must have a spring, a damper or a stop")
        for i, spring in enumerate(self.spring):
            for key in ("kx", "cx"):
                if getattr(spring, key):
                    where = f"{self.name}.spring[{i}].{key} = {getattr(spring, key):g}"
                    raise InputError(f"{where}: must be 0; vehicles have no longitudinal coordinate")
        for i, damper in enumerate(self.damper):
            if damper.k_series:
                where = f"{self.name}.damper[{i}].k_series = {damper.k_series:g}"
                raise InputError(f"{where}: must be 0 between vehicles")
        for i, stop in enumerate(self.stop):
            if stop.direction == "x":
                where = f"{self.name}.stop[{i}].direction = 'x'"
                raise InputError(f"{where}: must be 'y' or 'z'; vehicles have no longitudinal coordinate")
        return self

    def check_bodies(self, ahead: Vehicle, behind: Vehicle, where: str) -> None:
        """Refuse bodies that the vehicles do not have.

        Args:
            ahead: Vehicle ahead.
            behind: Vehicle behind.
            where: Names the coupling in messages.

        Raises:
            InputError: Names the connector and the body.
        """
        for kind in ("spring", "damper", "stop"):
            for i, joint in enumerate(getattr(self, kind)):
                for end, vehicle in (("a", ahead), ("b", behind)):
                    names = [body.name for body in vehicle.body]
                    if (name := getattr(joint, end)) not in names:
                        known = nearest(name, names)
                        raise InputError(f"{where}.{kind}[{i}].{end} = {name!r}: no such body of {vehicle.name}{known}")


def placed(joint: Connector, ahead: float, behind: float) -> Connector:
    """Copy of a connector with its points in the coordinates of either vehicle.

    Args:
        joint: Points from the coupling plane.
        ahead: x of the plane in the vehicle ahead [m], negative.
        behind: x of the plane in the vehicle behind [m].
    """
    (xa, *a), (xb, *b) = joint.point_a, joint.point_b
    return joint.model_copy(update={"point_a": (ahead + xa, *a), "point_b": (behind + xb, *b)})
