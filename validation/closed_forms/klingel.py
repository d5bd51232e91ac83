"""Kinematic waves of conical wheels on rails with round heads, and the conicity that a cone has there.

J. Klingel, Ueber den Lauf der Eisenbahnwagen auf gerader Bahn, Organ fuer die Fortschritte des Eisenbahnwesens 20
(1883) 113-123: a free wheelset that rolls without slip, y' = psi and psi' = -lambda y/(r b) over distance, moves along
a sine of L = 2 pi sqrt(r b/lambda). Two wheelsets held parallel and square in a bogie of wheelbase 2a must slip; at
vanishing speed their creep forces balance, and L = 2 pi sqrt(r (b^2 + a^2 f22/f11)/(lambda b)), Klingel's own for
rigid bogies if f22 = f11. K. Knothe, S. Stichel, Rail Vehicle Dynamics (2017), ch. 6.

Effect of a shift on cones of slope delta on heads of radius R (A. H. Wickens, Fundamentals of Rail Vehicle Dynamics
(2003), ch. 2): the wheelset rolls by phi = -delta y/(b - r delta), so that its contacts shift by
y - r phi = y b/(b - r delta), and lambda = delta (b + R delta)/(b - r delta). Rolling without slip is y b/(b - r delta)
following psi; so delta (1 + R delta/b) replaces lambda in Klingel's formula, and the wheelset's roll cancels.
"""

from __future__ import annotations

import numpy as np

__all__ = ["cone_conicity", "free_wheelset", "rigid_bogie", "track_conicity"]


def cone_conicity(delta: float, r: float, b: float, head_radius: float) -> float:
    """Change of rolling radius per shift of the axle, lambda [-].

    Args:
        delta: Slope of the cones [-].
        r: Rolling radius [m].
        b: Half distance of the contacts [m].
        head_radius: Radius R of the railheads [m].
    """
    return delta * (b + head_radius * delta) / (b - r * delta)


def track_conicity(delta: float, b: float, head_radius: float) -> float:
    """Change of rolling radius per shift of the contacts, delta (1 + R delta/b) [-]."""
    return delta * (1.0 + head_radius * delta / b)


def free_wheelset(conicity: float, r: float, b: float) -> float:
    """Klingel's wavelength [m].

    Args:
        conicity: Conicity by the contacts' shift, :func:`track_conicity` [-].
        r: Rolling radius [m].
        b: Half distance of the contacts [m].
    """
    return float(2.0 * np.pi * np.sqrt(r * b / conicity))


def rigid_bogie(conicity: float, r: float, b: float, a: float, creep_ratio: float = 1.0) -> float:
    """Wavelength of two wheelsets held parallel and square [m].

    Args:
        conicity: Conicity by the contacts' shift [-].
        r: Rolling radius [m].
        b: Half distance of the contacts [m].
        a: Half wheelbase [m].
        creep_ratio: f22/f11, lateral over longitudinal creep stiffness.
    """
    return float(2.0 * np.pi * np.sqrt(r * (b**2 + creep_ratio * a**2) / (conicity * b)))
