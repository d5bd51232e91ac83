"""Hertz contact, Kalker's coefficients, saturation of creep forces.

References: the classical table of Hertz's coefficients m, n, r over cos(beta) = |B - A|/(A + B),
recomputed with elliptic integrals by an independent calculation; the same calculation's numbers for a
wheel of 0.43 m under 70 kN; J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact (1990),
table E3, as coded in CONTACT (Apache-2.0), src/m_hertz.f90; Z. Y. Shen, J. K. Hedrick, J. A. Elkins,
8th IAVSD (1983) 591-605; CONTACT's reference output of the Manchester benchmark (see ``manchester``), of
which the normal forces and creepages are used here and the tangential forces are compared.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.contact.hertz import hertz, zhai_G
from tiengine.contact.kalker import kalker
from tiengine.contact.search import transverse_curvature
from tiengine.engine.equilibrium import evaluate_contact
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.parameters.arrays import Reals
from validation.cases.manchester import CONTACT, R0, REFERENCE, placed
from validation.frame.case import Case
from validation.frame.models import paper_model

E, NU, LOAD = 2.06e11, 0.3, 70e3
KALKER = "Kalker (1990), table E3, after CONTACT's source"
HERTZ_TABLE = {
    1: (36.932, 0.13129, 0.12111), 2: (22.243, 0.16919, 0.17931), 5: (11.238, 0.23814, 0.29689),
    10: (6.6115, 0.31098, 0.42801), 15: (4.8077, 0.36571, 0.52526), 20: (3.8160, 0.41215, 0.60384),
    25: (3.1788, 0.45397, 0.66981), 30: (2.7307, 0.49306, 0.72631), 35: (2.3961, 0.53057, 0.77521),
    40: (2.1357, 0.56729, 0.81774), 45: (1.9265, 0.60383, 0.85471), 50: (1.7542, 0.64069, 0.88674),
    55: (1.6094, 0.67830, 0.91426), 60: (1.4858, 0.71710, 0.93759), 65: (1.3788, 0.75749, 0.95699),
    70: (1.2851, 0.79990, 0.97264), 75: (1.2020, 0.84481, 0.98468), 80: (1.1278, 0.89272, 0.99321),
    85: (1.0609, 0.94422, 0.99831), 90: (1.0, 1.0, 1.0),
}  # fmt: skip
"""m, n, r over the angle beta in degrees."""
WHEELS = {
    "cone on R300": ((np.inf, 0.3), (4.954, 6.19, 4.87, 84.2, 1.25)),
    "hollow R450 on R300": ((-0.45, 0.3), (4.102, 5.13, 8.39, 69.7, 1.51)),
    "cone on R80": ((np.inf, 0.08), (5.956, 7.41, 2.45, 101.0, 1.04)),
}
"""Radii of wheel and rail [m]; printed G [1e-8 m/N^(2/3)], a, b [mm], approach [um], stiffness [1e9 N/m]."""
RATIOS = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
NARROW = (  # nu = 0.25, a/b = RATIOS: C11, C22, C23, C33
    (3.31, 3.37, 3.44, 3.53, 3.62, 3.72, 3.81, 3.91, 4.01, 4.12),
    (2.52, 2.63, 2.75, 2.88, 3.01, 3.14, 3.28, 3.41, 3.54, 3.67),
    (0.473, 0.603, 0.715, 0.823, 0.929, 1.03, 1.14, 1.25, 1.36, 1.47),
    (8.28, 4.27, 2.96, 2.32, 1.93, 1.68, 1.50, 1.37, 1.27, 1.19),
)
LONG = (  # nu = 0.25, b/a = RATIOS
    (11.7, 7.78, 6.34, 5.57, 5.10, 4.78, 4.54, 4.36, 4.22, 4.12),
    (12.8, 8.14, 6.40, 5.48, 4.90, 4.50, 4.21, 3.99, 3.81, 3.67),
    (14.6, 6.63, 4.32, 3.24, 2.62, 2.23, 1.95, 1.75, 1.59, 1.47),
    (0.526, 0.601, 0.674, 0.747, 0.819, 0.892, 0.965, 1.04, 1.11, 1.19),
)


CREEP = np.stack([REFERENCE["Fx"], REFERENCE["Fs"]], axis=1) / (0.3 * REFERENCE["Fn"][:, None])
"""CONTACT's longitudinal and lateral creep forces over mu N."""
FLANK = 13  # first of its rows on the flank
FULL_THEORY = f"{CONTACT}, full theory, with its normal forces and creepages prescribed"
SHEN = "a Hertzian ellipse, linear coefficients and one saturation for all creepages: 10 % of mu N is usual"
TABLE = {  # nu = 0 and 0.5: rows as above
    0.0: (
        (
            (2.51, 2.59, 2.68, 2.78, 2.88, 2.98, 3.09, 3.19, 3.29, 3.40),
            (2.51, 2.59, 2.68, 2.78, 2.88, 2.98, 3.09, 3.19, 3.29, 3.40),
            (0.334, 0.483, 0.607, 0.720, 0.827, 0.930, 1.03, 1.13, 1.23, 1.33),
            (6.42, 3.46, 2.49, 2.02, 1.74, 1.56, 1.43, 1.34, 1.27, 1.21),
        ),
        (
            (10.7, 6.96, 5.57, 4.84, 4.37, 4.06, 3.82, 3.65, 3.51, 3.40),
            (10.7, 6.96, 5.57, 4.84, 4.37, 4.06, 3.82, 3.65, 3.51, 3.40),
            (12.2, 5.72, 3.79, 2.88, 2.35, 2.01, 1.76, 1.58, 1.44, 1.33),
            (0.795, 0.828, 0.868, 0.912, 0.958, 1.01, 1.05, 1.10, 1.16, 1.21),
        ),
    ),
    0.25: (NARROW, LONG),
    0.5: (
        (
            (4.85, 4.81, 4.80, 4.82, 4.83, 4.91, 4.97, 5.05, 5.12, 5.20),
            (2.53, 2.66, 2.81, 2.98, 3.14, 3.31, 3.48, 3.65, 3.82, 3.98),
            (0.731, 0.809, 0.889, 0.977, 1.07, 1.18, 1.29, 1.40, 1.51, 1.63),
            (11.7, 5.66, 3.72, 2.77, 2.22, 1.86, 1.60, 1.42, 1.27, 1.16),
        ),
        (
            (12.9, 8.82, 7.34, 6.57, 6.11, 5.80, 5.58, 5.42, 5.30, 5.20),
            (16.0, 9.79, 7.51, 6.31, 5.56, 5.04, 4.67, 4.39, 4.16, 3.98),
            (18.0, 7.89, 5.01, 3.70, 2.96, 2.50, 2.18, 1.94, 1.77, 1.63),
            (0.228, 0.341, 0.446, 0.549, 0.650, 0.751, 0.852, 0.954, 1.06, 1.16),
        ),
    ),
}


def _coefficients() -> Reals:
    """m, n, r of every row of the table."""
    total = 2.0
    difference = total * np.cos(np.radians(np.array(list(HERTZ_TABLE), dtype=np.float64)))
    a, b, G = hertz(0.5 * (total - difference), 0.5 * (total + difference), E, NU)
    unit = (3.0 * (1.0 - NU**2) / (2.0 * E * total)) ** (1.0 / 3.0)
    approach = ((1.5 * (1.0 - NU**2) / E) ** 2 * total) ** (1.0 / 3.0)
    return np.stack([a / unit, b / unit, G / approach], axis=1)


def _wheel(wheel: float, rail: float) -> list[float]:
    a, b, G = (float(x) for x in hertz(0.5 / 0.43, 0.5 * (1.0 / wheel + 1.0 / rail), E, NU))
    third = LOAD ** (1.0 / 3.0)
    approach = G * third**2
    return [G * 1e8, a * third * 1e3, b * third * 1e3, approach * 1e6, 1.5e-9 * LOAD / approach]


def _steel() -> Reals:
    """1/C at nu = 0.3 through 0, 0.25, 0.5 by Lagrange's polynomial, a/b = 1."""
    weights = np.array([-0.08, 0.96, 0.12])
    columns = ((3.40, 4.12, 5.20), (3.40, 3.67, 3.98), (1.33, 1.47, 1.63), (1.21, 1.19, 1.16))
    return np.array([1.0 / (weights @ (1.0 / np.array(column))) for column in columns])


SIDEWAYS = np.geomspace(1e-3, 3.0, 12)  # m/s of a wheelset that slides at 350 km/h: tau from 0.1 to beyond 3


def _sliding() -> tuple[Reals, Reals]:
    """Creep force T' of the kernel, and calculated from its N, creepages and coefficients [N], shape (24,)."""
    model, V = paper_model(), 350.0 / 3.6
    wheelsets = len(model.wheel)
    u = np.zeros((len(SIDEWAYS), wheelsets, 5))
    u[..., 1] = 1e-4  # pressed 0.1 mm into the rail: about 80 kN
    v = np.zeros_like(u)
    v[..., 0] = SIDEWAYS[:, None]
    smooth = np.zeros((1, wheelsets, at.N_IRREGULARITY))
    found = evaluate_contact(model, V, smooth, u, v, np.zeros((*u.shape[:2], 2, 9)))
    state, local = found.contact[:, 0], found.local[:, 0]
    N = local[..., 0]
    f11, f22, f23 = (state[..., k] * N**p for k, p in ((wr.K11, 2 / 3), (wr.K22, 2 / 3), (wr.K23, 1.0)))
    T = np.hypot(f11 * state[..., wr.XI_X], f22 * state[..., wr.XI_Y] + f23 * state[..., wr.XI_S])
    tau = T / (0.3 * N)
    exact = 0.3 * N * np.where(tau <= 3.0, tau - tau**2 / 3.0 + tau**3 / 27.0, 1.0)
    return np.hypot(local[..., 1], local[..., 2]).ravel(), exact.ravel()


@cache
def _beside_contact() -> Reals:
    """Creep forces over mu N under CONTACT's normal forces and creepages, shape (21 shifts, 2)."""
    G, nu, mu = 82e9, 0.28, 0.3
    forces = []
    for row, case in enumerate(REFERENCE):
        pair, u = placed(row)
        found = pair.contacts(np.array([u]), case["roll_ws"])
        A = 0.5 / ((R0 + found.dz_w) * np.hypot(1.0, found.tan_gamma))
        B = transverse_curvature(pair.wheel, pair.canted_rail, found, 4e-3)
        a, b, _ = (x[0] * case["Fn"] ** (1.0 / 3.0) for x in hertz(A, B, 2.0 * G * (1.0 + nu), nu))
        C11, C22, C23, _ = kalker(a / b, nu)
        spin = 1e3 * case["cphi"]  # printed per mm
        T = -G * a * b * np.array([C11 * case["cksi"], C22 * case["ceta"] + np.sqrt(a * b) * C23 * spin])
        size = np.hypot(*T)
        tau = size / (mu * case["Fn"])
        forces.append(T / size * (tau - tau**2 / 3.0 + tau**3 / 27.0 if tau <= 3.0 else 1.0))
    return np.array(forces)


CASES = (
    Case(
        name="hertz-table",
        kind="validation",
        quantity="m, n, r of Hertz's ellipse at 20 ratios of curvature",
        source="classical table, by elliptic integrals",
        reference=tuple(HERTZ_TABLE.values()),
        rtol=5e-6 / 0.12,
        why="half a unit of the last digit of the smallest entry",
        compute=_coefficients,
    ),
    *(
        Case(
            name=f"hertz-{name.split()[0]}-{name.split()[-1]}",
            kind="validation",
            quantity=f"{name}, r0 = 0.43 m, 70 kN: G [1e-8], a, b [mm], approach [um], stiffness [1e9 N/m]",
            source="independent calculation",
            reference=printed,
            rtol=5e-3,
            why="three printed digits",
            compute=lambda radii=radii: _wheel(*radii),
        )
        for name, (radii, printed) in WHEELS.items()
    ),
    Case(
        name="hertz-zhai",
        kind="validation",
        quantity="Zhai's G for R = 0.43 m, coned and worn wheel [1e-8 m/N^(2/3)]",
        source="4.57 R^-0.149, 3.86 R^-0.115, calculated by hand",
        reference=(5.182, 4.253),
        atol=5e-4,
        why="printed digits",
        compute=lambda: [1e8 * zhai_G("zhai_cone", 0.43), 1e8 * zhai_G("zhai_worn", 0.43)],
    ),
    *(
        Case(
            name="kalker-table" if nu == 0.25 else f"kalker-table-{nu:g}",
            kind="validation",
            quantity=f"C11, C22, C23, C33 at nu = {nu:g}, 20 ratios of axes",
            source=KALKER,
            reference=np.concatenate([np.transpose(narrow), np.transpose(long)]),
            rtol=1e-12,
            why="rounding: interpolation at its own nodes",
            compute=lambda nu=nu: kalker(np.concatenate([RATIOS, 1.0 / RATIOS]), nu),
        )
        for nu, (narrow, long) in TABLE.items()
    ),
    Case(
        name="kalker-steel",
        kind="verification",
        quantity="C11, C22, C23, C33 at nu = 0.3, a/b = 1",
        source="quadratic in 1/C through nu = 0, 0.25, 0.5, calculated by hand",
        reference=_steel,
        rtol=1e-12,
        why="rounding",
        compute=lambda: kalker(1.0, 0.3),
    ),
    Case(
        name="kalker-steel-linear",
        kind="validation",
        quantity="the same against a public code's constants for nu = 0.3",
        source="VTCM_simulation (GitHub), hard-coded, linear between nu = 0.25 and 0.5",
        reference=(4.336, 3.732, 1.502, 1.184),
        rtol=1e-2,
        why="linear against quadratic interpolation in nu",
        compute=lambda: kalker(1.0, 0.3),
    ),
    Case(
        name="saturation",
        kind="verification",
        quantity="creep force of a wheel sliding at 0.001 to 3 m/s under 350 km/h, both wheels [N]",
        source="Shen, Hedrick and Elkins (1983): mu N (tau - tau^2/3 + tau^3/27), else mu N",
        reference=lambda: _sliding()[1],
        rtol=1e-9,
        why="rounding; 1e-12 N is added to T in the kernel",
        compute=lambda: _sliding()[0],
    ),
    Case(
        name="contact-creep-tread",
        kind="validation",
        quantity=(
            "longitudinal and lateral creep forces over mu N, Manchester wheelset on tread and flange root, 0 to 6 mm"
        ),
        source=FULL_THEORY,
        reference=CREEP[:FLANK],
        atol=0.1,
        why=SHEN,
        compute=lambda: _beside_contact()[:FLANK],
    ),
    Case(
        name="contact-creep-flank",
        kind="validation",
        quantity="resultant creep force over mu N on the flank, 6.5 to 10 mm",
        source=FULL_THEORY,
        reference=np.hypot(*CREEP[FLANK:].T),
        atol=0.1,
        why=SHEN,
        compute=lambda: np.hypot(*_beside_contact()[FLANK:].T),
    ),
    Case(
        name="contact-creep-flank-parts",
        kind="validation",
        quantity="its longitudinal parts (eight), then its lateral parts (eight)",
        source=FULL_THEORY,
        reference=CREEP[FLANK:].T,
        atol=0.105,
        why=(
            "about 10 %, to two digits: at tau > 40 spin turns the direction of the full theory's force, which a"
            " common saturation does not do"
        ),
        compute=lambda: _beside_contact()[FLANK:].T,
    ),
)
