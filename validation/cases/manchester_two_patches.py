"""Two contact patches of the Manchester benchmark, case A2.2 at 5.0 mm, right wheel, against CONTACT.

Reference output of the repository eve70a/CONTACT (Apache-2.0), ``mbench_a22_varfric.ref_out``, case 3: set-up as in
:mod:`validation.cases.manchester`, but patches further apart than 6 mm are kept apart, and friction falls with the
inclination of the surface. CONTACT finds 1536 N on the tread and 8244 N in the flange root; their creep forces support
618 N of the wheel's 10 kN. Of the creep forces only their ratio to the normal forces is taken from CONTACT, 0.258 and
0.219: nearly friction.

How the load is shared depends on the difference of the two gaps, 21.8 um of an approach of 28 um: 1 um moves 190 N.
With the curvature at the point the shares agree; with the curvature over 8 mm that the engine takes, since it carries
50 to 100 kN on larger patches, the approach in the root is 5 % smaller and the tread lighter by that.

CONTACT's points are centres of gravity of the interpenetration of each patch. Its angles are not those of the
surfaces: where patches are between 6 and 9 mm apart it turns the plane of each towards their mean, weighted with
the interpenetration, in proportion to the distance (``turn_cpatch_refangle``), here by three quarters. The surfaces
have 0.132 and 0.298 rad, with which the engine calculates.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from tiengine.contact.hertz import hertz
from tiengine.contact.search import Contacts, transverse_curvature
from tiengine.parameters.arrays import Reals
from validation.cases.manchester import B0, R0, REFERENCE, envelope, placed
from validation.frame.case import Case

__all__ = ["CASES", "normal_forces", "patches", "turned"]

ROW = 10
LOAD = 10e3
CREEP = (396.3 / 1536.0, 1805.0 / 8244.0)
"""Lateral creep force over normal force, tread and root; they support the wheel."""
SEPARATE, TURNED = 6.0e-3, 9.0e-3
"""Distances [m] up to which CONTACT combines patches, and up to which it turns their planes."""
E, NU = 2.0 * 82e9 * 1.28, 0.28
CONTACT = "CONTACT (Apache-2.0), mbench_a22_varfric.ref_out, case 3"


class Patch(NamedTuple):
    """One region of interpenetration.

    Attributes:
        station: Centre of gravity on the wheel [m].
        angle: Mean inclination [rad].
        weight: Interpenetration that it contains, in CONTACT's measure.
        ends: Its ends (y, z) on the rail, outer and inner [m].
    """

    station: float
    angle: float
    weight: float
    ends: Reals


@cache
def patches() -> tuple[Contacts, Contacts]:
    """Contacts of tread and root, arrays of one."""
    pair, u = placed(ROW)
    at = np.array([u]), np.array([float(REFERENCE[ROW]["roll_ws"])])
    first = pair.contacts(*at)
    second = pair.second_contacts(*at, first)
    if second.share[0] < 1.0:
        raise ValueError(f"share of the second patch = {second.share[0]}: 1 expected, patches are 10 mm apart")
    return second.at, first


@cache
def normal_forces(span: float) -> tuple[float, float]:
    """Normal forces of tread and root under 10 kN [N], curvature taken over ``span`` to either side [m]."""
    pair, _ = placed(ROW)
    found = patches()
    angle = [float(np.arctan(c.tan_gamma[0])) for c in found]
    G = []
    for c in found:
        B = transverse_curvature(pair.wheel, pair.canted_rail, c, span)
        G.append(float(hertz(0.5 / ((R0 + c.dz_w) * np.hypot(1.0, c.tan_gamma)), B, E, NU)[2][0]))
    lowest = float(found[1].gap[0])

    def forces(depth: float) -> list[float]:
        depths = [max(depth + lowest - float(c.gap[0]), 0.0) for c in found]
        return [(p * np.cos(a) / g) ** 1.5 for p, a, g in zip(depths, angle, G, strict=True)]

    def excess(depth: float) -> float:
        supports = (N * (np.cos(a) + T * np.sin(a)) for N, a, T in zip(forces(depth), angle, CREEP, strict=True))
        return sum(supports) - LOAD

    tread, root = forces(float(brentq(excess, 1e-6, 1e-4)))
    return tread, root


@cache
def regions() -> tuple[Patch, Patch]:
    """Regions of interpenetration of tread and root at CONTACT's depth, 2.714e-2 mm normal to the root's plane."""
    pair, u = placed(ROW)
    roll = float(REFERENCE[ROW]["roll_ws"])
    station = envelope(float(REFERENCE[ROW]["yaw_ws"]))[1]
    t = np.linspace(-35e-3, -10e-3, 40001)
    z = pair.wheel.height(t)
    o = u + B0 - pair.crown_offset + t * np.cos(roll) - z * np.sin(roll)
    above = t * np.sin(roll) + z * np.cos(roll) - pair.canted_rail.height(o)
    depth = np.maximum(above - above.max() + 2.714e-5 / np.cos(0.293), 0.0)
    weight = depth**2.5 * np.hypot(1.0, pair.wheel.height(t, 1))
    middle = 0.5 * float(patches()[0].s_w[0] + patches()[1].s_w[0])
    found = []
    for inside in (t > middle, t <= middle):
        w, touching = weight[inside], depth[inside] > 0.0
        angle = -np.arctan(pair.canted_rail.height(o[inside], 1))
        ends = np.array([o[inside][touching][[-1, 0]], pair.canted_rail.height(o[inside][touching][[-1, 0]])])
        place = float(np.interp((t[inside] * w).sum() / w.sum(), pair.wheel.y, station))
        found.append(Patch(place, float((angle * w).sum() / w.sum()), float(w.sum()), ends))
    return found[0], found[1]


def turned() -> tuple[float, float]:
    """Inclinations of both planes as CONTACT turns them [rad]."""
    tread, root = regions()
    distance = float(np.hypot(*(tread.ends[:, 1] - root.ends[:, 0])))
    mean = (tread.angle * tread.weight + root.angle * root.weight) / (tread.weight + root.weight)
    part = (TURNED - distance) / (TURNED - SEPARATE)
    return tread.angle + part * (mean - tread.angle), root.angle + part * (mean - root.angle)


CASES = (
    Case(
        name="two-patches-forces",
        kind="validation",
        quantity="normal forces of tread and flange root under 10 kN, curvature at the point [N]",
        source=CONTACT,
        reference=(1536.0, 8244.0),
        atol=60.0,
        why="190 N per um of the gaps' difference, of which profiles printed to 0.1 um leave 0.3",
        compute=lambda: normal_forces(0.5e-3),
    ),
    Case(
        name="two-patches-forces-patch",
        kind="validation",
        quantity="the same, curvature over 8 mm as in the engine [N]",
        source=CONTACT,
        reference=(1536.0, 8244.0),
        atol=450.0,
        why="7 % of the root's approach (manchester-approach-patch) are 2 um, at 215 N per um",
        compute=lambda: normal_forces(4e-3),
    ),
    Case(
        name="two-patches-stations",
        kind="validation",
        quantity="patches on the wheel, weighted by depth squared [mm]",
        source=CONTACT,
        reference=(-18.3517, -28.5350),
        atol=0.020,
        why="CONTACT's grid of 0.2 mm and its splines; the tread's patch has ten elements across",
        compute=lambda: [1e3 * each.station for each in regions()],
    ),
    Case(
        name="two-patches-angles",
        kind="validation",
        quantity="inclinations of the planes, turned as CONTACT turns them [mrad]",
        source=CONTACT,
        reference=(248.0, 293.0),
        atol=(8.0, 1.5),
        why="a distance of 0.2 mm, its grid, turns the tread's plane by 8 mrad and the root's by 0.4",
        compute=lambda: [1e3 * each for each in turned()],
    ),
)
