"""P2 resonance: the unsprung mass of a wheel and the rail below it vibrating together on the fastenings.

H. H. Jenkins, J. E. Stephenson, G. A. Clayton, G. W. Morland, D. Lyon, The effect of track and vehicle parameters on
wheel/rail vertical dynamic forces, Railway Engineering Journal 3(1) (1974) 2-16: two masses, the wheel's m_u and the
rail's m_r, joined by the contact spring k_H; the rail on a spring k_t. The rail is a beam EI of mass m per length on a
foundation k per length; under a load it takes the shape exp(-x)(cos x + sin x), x = beta |s|, beta^4 = k/(4 EI). So

    k_t = 8 EI beta^3,    m_r = 3 m/(2 beta).

P2 is the lower natural frequency, P1 the upper. On slab track k is the fastenings' stiffness over their pitch, since
slab and bed are much stiffer. Without damping and shear of the rail, P2 is within about 10 % of the peak of the wheel
force
(``validation/wheel_spectrum.py``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tiengine.contact.hertz import hertz, zhai_G
from tiengine.contact.search import transverse_curvature
from tiengine.contact.table import SMALLEST_CURVATURE, ContactSettings, WheelRailPair
from tiengine.vehicle.train import assemble, static_wheel_loads

if TYPE_CHECKING:
    from tiengine.scenario.parts import Parts

__all__ = ["contact_stiffness", "p2_frequency", "p2_of"]


def p2_frequency(
    unsprung: float, contact: float, bending_stiffness: float, mass_per_length: float, foundation: float
) -> float:
    """Compute the undamped P2 frequency [Hz].

    Args:
        unsprung: Mass of a wheel and half its axle m_u [kg].
        contact: Stiffness of the contact k_H [N/m].
        bending_stiffness: Bending stiffness EI of the rail [N m^2].
        mass_per_length: Mass per length m of the rail [kg/m].
        foundation: Stiffness per length of the foundation k [N/m^2].
    """
    beta = (foundation / (4.0 * bending_stiffness)) ** 0.25
    k_t, m_r = 8.0 * bending_stiffness * beta**3, 1.5 * mass_per_length / beta
    # m_u m_r x^2 - (m_u (k_H + k_t) + m_r k_H) x + k_H k_t = 0 in x = omega^2
    half = 0.5 * (unsprung * (contact + k_t) + m_r * contact)
    x = contact * k_t / (half + np.sqrt(half**2 - unsprung * m_r * contact * k_t))
    return float(np.sqrt(x) / (2.0 * np.pi))


def contact_stiffness(parts: Parts, settings: ContactSettings, load: float) -> float:
    """Compute the slope of Hertz' law for a centred wheelset, 1.5 N^(1/3)/G [N/m], at the first left wheel.

    Args:
        parts: Parts of the scenario, of which the profiles are used.
        settings: Placement and material of the contact.
        load: Normal force N [N].
    """
    pair = WheelRailPair(parts.wheel_profiles[0][0], parts.rail_profiles[0], settings)
    touching = pair.contacts(np.zeros(1), np.zeros(1))
    across = np.maximum(
        transverse_curvature(pair.wheel, pair.canted_rail, touching, settings.curvature_span), SMALLEST_CURVATURE
    )
    along = 0.5 / ((settings.wheel_radius + touching.dz_w) * np.hypot(1.0, touching.tan_gamma))
    if settings.hertz == "exact":
        G = float(hertz(along, across, settings.E, settings.nu)[2][0])
    else:
        G = float(zhai_G(settings.hertz, settings.wheel_radius))
    return 1.5 * float(load ** (1.0 / 3.0)) / G


def p2_of(parts: Parts, settings: ContactSettings) -> float:
    """Compute the P2 frequency of the leading wheelset on a scenario's track [Hz].

    Args:
        parts: Vehicles, profiles, rail, slab and fastening.
        settings: Placement and material of the contact.
    """
    train, rail = assemble(parts.vehicles, parts.centres), parts.rail
    return p2_frequency(
        unsprung=0.5 * float(train.wheelset_mass[0]),
        contact=contact_stiffness(parts, settings, float(static_wheel_loads(train)[0].mean())),
        bending_stiffness=rail.E * rail.Iy,
        mass_per_length=rail.mass_per_length,
        foundation=parts.fastening.vertical_stiffness / parts.slab.fastening_pitch,
    )
