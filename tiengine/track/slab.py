"""Track slab: a thin free plate of ACM elements with rigid lateral displacement and yaw.

DOFs of a slab: (w, dw/dx, dw/dy) of every node, node (ix, iy) being number ix (elements_y + 1) + iy, then the
lateral displacement y and the yaw psi of its centre. x forward, y right, w down; side index 0 left, 1 right.
The matrices come from the Taichi kernels of ``kernels/plate.py``, so :func:`tiengine.engine.backend.start` must have
been called.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import ValidationInfo, field_validator

from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import find_preset, preset_names
from tiengine.parameters.quantity import Params, Q, build
from tiengine.track.mortar import Mortar

__all__ = ["Slab", "load_slab", "slab_names"]

MOST_DOFS = 5000  # per slab, since its matrices are full
THIN = 0.1
"""Largest thickness over length or width of a thin plate (the source paper, section 2.1.2)."""


class Slab(Params):
    """Geometry, material and mesh of one slab.

    Attributes:
        name: Name of the slab.
        source: Source of the values.
        length: Length along the track.
        width: Width across the track.
        thickness: Thickness h.
        gap: Joint between two slabs.
        fastening_pitch: Seat spacing d, uniform across the joints.
        fastenings: Pairs of fastenings per slab; fastenings times d is the slab pitch.
        E: Young's modulus.
        nu: Poisson's ratio.
        rho: Density.
        elements_x: Elements along the track.
        elements_y: Elements across the track.
        seat_half_spacing: Lateral distance of the seats from the centre line.
    """

    name: str = "slab"
    source: str = ""
    length: Annotated[float, Q("m", gt=0.0, le=200.0)]
    width: Annotated[float, Q("m", gt=0.0)]
    thickness: Annotated[float, Q("m", gt=0.0)]
    gap: Annotated[float, Q("m", ge=0.0)]
    fastening_pitch: Annotated[float, Q("m", ge=0.1, le=10.0)]
    fastenings: Annotated[int, Q("-", ge=1, le=1000)]
    E: Annotated[float, Q("N/m^2", gt=0.0)]
    nu: Annotated[float, Q("-", ge=0.0, lt=0.5)]
    rho: Annotated[float, Q("kg/m^3", gt=0.0)]
    elements_x: Annotated[int, Q("-", ge=1, le=200)] = 9
    elements_y: Annotated[int, Q("-", ge=1, le=100)] = 2
    seat_half_spacing: Annotated[float, Q("m", gt=0.0, validate_default=True)] = 0.7465

    @field_validator("thickness")
    @classmethod
    def _is_thin(cls, value: float, info: ValidationInfo) -> float:
        side = min(info.data.get("length", np.inf), info.data.get("width", np.inf))
        if value > THIN * side:
            raise ValueError(f"must be at most {THIN:g} times length and width for a thin plate, {THIN * side:g} m")
        return value

    @field_validator("fastenings")
    @classmethod
    def _seats_are_uniform(cls, value: int, info: ValidationInfo) -> int:
        known = info.data
        if not {"length", "gap", "fastening_pitch"} <= known.keys():
            return value  # one of them is already refused
        pitch = known["length"] + known["gap"]
        if abs(value * known["fastening_pitch"] - pitch) > 1e-6:
            raise ValueError(
                f"times fastening_pitch is {value * known['fastening_pitch']:.6f} m; "
                f"it must equal length + gap = {pitch:.6f} m"
            )
        if known["fastening_pitch"] <= known["gap"]:
            raise ValueError("the outer seats, fastening_pitch / 2 from the joint's middle, must lie on the slab")
        return value

    @field_validator("elements_y")
    @classmethod
    def _is_not_too_fine(cls, value: int, info: ValidationInfo) -> int:
        dofs = 3 * (info.data.get("elements_x", 1) + 1) * (value + 1)
        if dofs > MOST_DOFS:
            raise ValueError(f"gives the slab {dofs} degrees of freedom with elements_x; must be at most {MOST_DOFS}")
        return value

    @field_validator("seat_half_spacing")
    @classmethod
    def _seats_are_on_the_slab(cls, value: float, info: ValidationInfo) -> float:
        if "width" in info.data and value >= info.data["width"] / 2.0:
            raise ValueError(f"must be less than half the slab's width, {info.data['width'] / 2.0:g} m")
        return value

    @property
    def pitch(self) -> float:
        """Distance between joints, length + gap [m]."""
        return self.length + self.gap

    def slots(self, window: float, cover: bool) -> int:
        """Slabs to keep in memory under a window: the paper's Eq. (16), or all that a moving window can touch.

        Args:
            window: Length [m].
            cover: One slab more than the paper's count, so that every seat of the window stands on one.
        """
        return int(np.floor(window / self.pitch)) + (2 if cover else 1)

    @property
    def mass(self) -> float:
        """Mass of the slab [kg]."""
        return self.rho * self.length * self.width * self.thickness

    @property
    def rigidity(self) -> float:
        """Plate rigidity D_0 = E h^3 / 12 (1 - nu^2) [N m]."""
        return self.E * self.thickness**3 / (12.0 * (1.0 - self.nu**2))

    @property
    def weight_pressure(self) -> float:
        """Pressure rho g h of the slab's weight on its bed [Pa]."""
        return self.rho * GRAVITY * self.thickness

    @property
    def plate_dofs(self) -> int:
        """DOFs of the plate, three per node."""
        return 3 * (self.elements_x + 1) * (self.elements_y + 1)


def slab_names() -> list[str]:
    """List the slabs of the library, sorted."""
    return preset_names("slabs")


def load_slab(name_or_path: str, folder: Path | None = None) -> tuple[Slab, Mortar]:
    """Load slab and mortar of the library or of a TOML file of the same form.

    Args:
        name_or_path: ``"CRTS_III"``, or the path of a file: keys of :class:`Slab` and a table ``[mortar]``.
        folder: Where relative paths start; the working directory if None.

    Returns:
        The slab and its bed.

    Raises:
        InputError: There is no such preset or file, or a value breaks a rule.
    """
    path = find_preset("slabs", name_or_path, folder=folder)
    table = load_toml(path)
    mortar = table.pop("mortar", None)
    if not isinstance(mortar, dict):
        raise InputError(f"{path.stem}.mortar: missing; must be a table of the values of the bed")
    return build(Slab, table, path.stem), build(Mortar, mortar, f"{path.stem}.mortar")
