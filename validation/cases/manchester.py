"""Contact of the Manchester benchmark, case A2.2, right wheel, 21 shifts, against CONTACT.

Iwnicki (ed.), The Manchester benchmarks for rail vehicle simulation (1999); reference output and
profiles of the repository eve70a/CONTACT (Apache-2.0), see the heads of the files in ``data``. Frame: y
right, z down; CONTACT's angle is negative where the rail falls inward.

The yaw in this case grows to 24 mrad. A yawed wheel seen along the rail is the envelope of its circles (the
trace line): station s appears at s cos(psi) - r r' tan(psi) sin(psi) and height sqrt(1 - r'^2
tan^2(psi)) r, exactly, with the touching point r r' tan(psi) ahead of the axle. The engine omits this
second-order effect (yaw of a running wheelset is below 5 mrad: 0.03 mm at the flange); here the
envelope replaces the wheel, so that the rest can be compared closely. At 10 mm shift it moves
the contact by 0.18 mm on the wheel and u by 0.22 mm.

CONTACT's contact point is not the point of least gap but the centre of gravity of the interpenetration,
weighted by the square of its depth (found by trying powers: with depth^2.5 over y, which is depth^2
over the area, all rows fit; 1.5 and 3 do not). Both are compared.

Omitted: the angle and the unweighted station of rows 0 to 2 and 10 to 12, where the two definitions of
the point differ by up to 2.5 mm (jump at 0.2 mm, patches of 15 mm; flange root); the radius of rows 0,
1, 10 and the approach of rows 0, 1, 10 (9 to 30 %), where the gap has two minima within one patch;
CONTACT's tangential forces, which are of its full theory.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from tiengine.contact.hertz import hertz
from tiengine.contact.profile import Profile, load_profile
from tiengine.contact.search import transverse_curvature
from tiengine.contact.table import ContactSettings, WheelRailPair
from tiengine.parameters.arrays import Reals
from validation.frame.case import Case

__all__ = ["CASES", "R0", "RAIL", "REFERENCE", "WHEEL", "approach", "located", "radius"]

DATA = Path(__file__).parents[1] / "data"
R0, B0 = 0.46, 0.75
REFERENCE = np.genfromtxt(DATA / "manchester_contact_a22.csv", delimiter=",", names=True, skip_header=5)
WHEEL = load_profile(DATA / "manchester_s1002.csv", "wheel")
RAIL = load_profile(DATA / "manchester_uic60_canted.csv", "rail", has_cant=True)
SETTINGS = ContactSettings(gauge_depth=0.014, half_spacing=B0, wheel_radius=R0)
CONTACT = "CONTACT (Apache-2.0), mbench_a22_right.ref_out"


@cache
def envelope(yaw: float) -> tuple[Profile, Reals]:
    """The wheel as seen along the rail, and the station behind each of its points."""
    s = np.linspace(*WHEEL.span, 4001)
    r, slope = R0 + WHEEL.height(s), WHEEL.height(s, 1)
    y = s * np.cos(yaw) - r * slope * np.tan(yaw) * np.sin(yaw)
    z = r * np.sqrt(1.0 - (slope * np.tan(yaw)) ** 2) - R0
    keep = (s > -60e-3) & (np.diff(y, prepend=-1.0) > 0.0)  # the flange's back folds over; no contact there
    return Profile("yawed S1002", "wheel", y[keep], z[keep]), s[keep]


def placed(row: int) -> tuple[WheelRailPair, float]:
    """The yawed wheel on the rail and its outward shift."""
    case = REFERENCE[row]
    roll, yaw = case["roll_ws"], case["yaw_ws"]
    u = case["y_ws"] * 1e-3 + B0 * (np.cos(roll) * np.cos(yaw) - 1.0) - R0 * np.sin(roll)
    return WheelRailPair(envelope(yaw)[0], RAIL, SETTINGS), u


@cache
def located(row: int) -> tuple[float, float, float, float]:
    """Station of least gap, CONTACT's weighted station, contact angle, distance of the contact ahead of the axle."""
    case = REFERENCE[row]
    roll, yaw = case["roll_ws"], case["yaw_ws"]
    station = envelope(yaw)[1]
    pair, u = placed(row)
    wheel = pair.wheel
    found = pair.contacts(u, roll)
    s = float(np.interp(found.s_w, wheel.y, station))
    gamma = float(np.arctan(found.tan_gamma))
    ahead = (R0 + float(WHEEL.height(s))) * float(WHEEL.height(s, 1)) * np.tan(yaw)
    return (
        s,
        weighted_station(pair, u, roll, case["approach_mm"] * 1e-3 / np.cos(gamma), station),
        gamma,
        ahead,
    )


def weighted_station(pair: WheelRailPair, u: float, roll: float, depth: float, station: Reals) -> float:
    """Centre of gravity of (interpenetration)^2 for the largest vertical depth given."""
    t = np.linspace(*pair.wheel.span, 40001)
    z = pair.wheel.height(t)
    o = u + B0 - pair.crown_offset + t * np.cos(roll) - z * np.sin(roll)
    first, last = pair.canted_rail.span
    above = t * np.sin(roll) + z * np.cos(roll) - pair.canted_rail.height(np.clip(o, first, last))
    above[(o < first) | (o > last)] = -1.0
    weight = np.maximum(0.0, above - above.max() + depth) ** 2.5 * np.hypot(1.0, pair.wheel.height(t, 1))
    return float(np.interp((t * weight).sum() / weight.sum(), pair.wheel.y, station))


def radius(row: int) -> float:
    """Height of the rail's surface at CONTACT's point, ahead of the axle [m]: r - x^2/2r less the depth."""
    case = REFERENCE[row]
    _s, _weighted, gamma, ahead = located(row)
    height = float(WHEEL.height(case["ycp_w"] * 1e-3))
    return height - ahead**2 / (2.0 * (R0 + height)) - case["approach_mm"] * 1e-3 / np.cos(gamma)


def approach(row: int, span: float) -> float:
    """Hertz's approach under CONTACT's normal force [m], curvature taken over ``span`` to either side [m]."""
    case = REFERENCE[row]
    pair, u = placed(row)
    found = pair.contacts(np.array([u]), case["roll_ws"])
    B = transverse_curvature(pair.wheel, pair.canted_rail, found, span)
    A = 0.5 / ((R0 + found.dz_w) * np.hypot(1.0, found.tan_gamma))
    G = hertz(A, B, E=2.0 * 82e9 * 1.28, nu=0.28)[2][0]
    return float(G * case["Fn"] ** (2.0 / 3.0))


TREAD, FLANK = tuple(range(3, 10)), tuple(range(13, 21))
ALL_BUT_JUMP = tuple(row for row in range(21) if row != 10)
WITH_RADIUS = tuple(row for row in range(21) if row not in (0, 1, 10))
HERTZIAN = (*range(2, 10), *range(11, 21))


def _column(name: str, rows: tuple[int, ...], sign: float = 1.0) -> Reals:
    return sign * REFERENCE[name][list(rows)]


CASES = (
    Case(
        name="manchester-station",
        kind="validation",
        quantity="contact on the wheel, weighted by depth squared, 20 shifts [mm]",
        source=CONTACT,
        reference=_column("ycp_w", ALL_BUT_JUMP),
        atol=0.010,
        why="CONTACT's grid of 0.2 mm, and its splines",
        compute=lambda: [1e3 * located(row)[1] for row in ALL_BUT_JUMP],
    ),
    Case(
        name="manchester-jump",
        kind="validation",
        quantity="the same at 5.0 mm, one patch over tread and flange root [mm]",
        source=CONTACT,
        reference=_column("ycp_w", (10,)),
        atol=0.05,
        why="0.5 % of the distance of 10 mm between the two regions",
        compute=lambda: [1e3 * located(10)[1]],
    ),
    Case(
        name="manchester-tread-point",
        kind="validation",
        quantity="point of least gap on the wheel, 1.5 to 4.5 mm [mm]",
        source=CONTACT,
        reference=_column("ycp_w", TREAD),
        atol=0.1,
        why="1 % of the patch, since CONTACT's point is a weighted centre",
        compute=lambda: [1e3 * located(row)[0] for row in TREAD],
    ),
    Case(
        name="manchester-flank-point",
        kind="validation",
        quantity="point of least gap on the wheel, 6.5 to 10 mm [mm]",
        source=CONTACT,
        reference=_column("ycp_w", FLANK),
        atol=0.005,
        why="patches of 1 mm, for which both definitions of the point agree",
        compute=lambda: [1e3 * located(row)[0] for row in FLANK],
    ),
    Case(
        name="manchester-tread-angle",
        kind="validation",
        quantity="contact angle, 1.5 to 4.5 mm [mrad]",
        source=CONTACT,
        reference=_column("deltcp", TREAD, -1e3),
        atol=1.2,
        why="0.1 mm between the points, on a curvature of 10 /m",
        compute=lambda: [1e3 * located(row)[2] for row in TREAD],
    ),
    Case(
        name="manchester-flank-angle",
        kind="validation",
        quantity="contact angle, 6.5 to 10 mm [mrad]",
        source=CONTACT,
        reference=_column("deltcp", FLANK, -1e3),
        atol=0.3,
        why="5 um between the points, on R13 to R20",
        compute=lambda: [1e3 * located(row)[2] for row in FLANK],
    ),
    Case(
        name="manchester-radius",
        kind="validation",
        quantity="rolling radius at the contact less r0, less the approach, 18 shifts [mm]",
        source=CONTACT,
        reference=_column("zcp_w", WITH_RADIUS),
        atol=0.012,
        why="the depth at a weighted point is not the largest depth",
        compute=lambda: [1e3 * radius(row) for row in WITH_RADIUS],
    ),
    *(
        Case(
            name=f"manchester-approach-{name}",
            kind="validation",
            quantity=f"Hertzian approach at 10 kN [um], {words}",
            source=CONTACT,
            reference=_column("approach_mm", rows, 1e3),
            rtol=rtol,
            why=why,
            compute=lambda rows=rows, span=span: [1e6 * approach(row, span) for row in rows],
        )
        for name, words, rows, span, rtol, why in (
            ("tread", "point curvature, tread", TREAD, 0.5e-3, 0.005, "three or four printed digits"),
            ("flank", "point curvature, flank", FLANK, 0.5e-3, 0.013, "CONTACT's patch bends around R13"),
            (
                "patch",
                "curvature over 8 mm as in the engine",
                HERTZIAN,
                4e-3,
                0.07,
                "patches shorter than that",
            ),
        )
    ),
)
