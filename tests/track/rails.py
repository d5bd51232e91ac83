"""Rails and windows for the tests of the track."""

from __future__ import annotations

import numpy as np

from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import find_preset
from tiengine.parameters.quantity import build
from tiengine.track.rail import Rail

V350 = 350.0 / 3.6  # m/s
LENGTH = 33.5  # m: wheels of a coach and 8 m beyond them
WHEELS = np.array([8.0, 10.5, 23.0, 25.5])


def chn60(**changes: float) -> Rail:
    return build(Rail, {**load_toml(find_preset("rails", "CHN60")), **changes}, "rail")


def uic60() -> Rail:
    """Vertical section of the published moving-load numbers: 60.21 kg/m, 210 GPa, kappa 0.4, G 81 GPa."""
    return chn60(
        mass_per_length=60.21, A=7.67e-3, E=2.1e11, G=8.1e10, rho=60.21 / 7.67e-3, Iy=3.0383e-5, kappa_vertical=0.4
    )
