"""A vehicle linearised about steady rolling on rigid, straight rails: eigenvalues and linear critical speed.

A wheelset keeps both wheels on the rails: z is zero and the roll follows the shift, phi = -kappa y. With Kalker's
linear theory at the static load N (two wheels a wheelset), b the half distance of the contacts, prime = d/dt,

  lateral slip       xi_y = (1 + r0 kappa) y'/V - psi,    spin  xi_s = psi'/V - (+-) gamma / r0,
  longitudinal slip  xi_x = -(+-) (lambda y / r0 + b psi'/V),
  work on y          -(1 + r0 kappa) [2 f22 xi_y + 2 f23 (psi'/V - Gamma y/r0)] - 2 N c y,
  moment about z     -2 f11 b (lambda y/r0 + b psi'/V) + 2 f23 xi_y - 2 f33 (psi'/V - Gamma y/r0)
                     + 2 N b tan(gamma_0) psi.

lambda (rolling radii), kappa (roll), Gamma (contact angles) and c (height of the axle, z = -c y^2/2) are those of
equivalent linearisation at one amplitude A of a harmonic shift: f(y) -> (2/A) <f(A sin t) sin t>. K. Knothe,
S. Stichel, Rail Vehicle Dynamics (2017), ch. 6 and 10; A. H. Wickens, Fundamentals of Rail Vehicle Dynamics (2003),
ch. 2.

Differences from the engine: rigid rails, no seats; linear profiles, suspension (dampers at their initial slope) and
creep (no saturation, coefficients of the centred wheelset); hence no limit cycle and no influence of the size of the
disturbance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from tiengine.contact.conicity import wheelset_position
from tiengine.contact.table import ContactTable, WheelRailPair
from tiengine.parameters.arrays import Reals
from tiengine.vehicle.train import TrainModel

__all__ = ["EquivalentContact", "critical_speed", "equivalent_contact", "fastest_growth"]

PHASES = 64
MASSLESS = 1e6  # 1/s: eigenvalues beyond belong to coordinates without mass


@dataclass(frozen=True)
class EquivalentContact:
    """A wheelset's linear contact.

    Attributes:
        conicity: lambda = d(rolling radius)/dy.
        roll: kappa = -d(roll)/dy [1/m].
        angle: Gamma = d tan(gamma)/dy [1/m].
        rise: c, curvature of the axle's rise over y [1/m].
        slope: tan(gamma_0) of the centred wheelset.
        half_base: b, half distance of the contacts [m].
        f11: Kalker's longitudinal coefficient [N].
        f22: Lateral coefficient [N].
        f23: Coefficient from spin to lateral force [N m].
        f33: Coefficient from spin to moment [N m^2].
    """

    conicity: float
    roll: float
    angle: float
    rise: float
    slope: float
    half_base: float
    f11: float
    f22: float
    f23: float
    f33: float


def equivalent_contact(pair: WheelRailPair, table: ContactTable, load: float, amplitude: float) -> EquivalentContact:
    """Equivalent linearisation of a pair of profiles.

    Args:
        pair: Wheel and rail.
        table: Their contact table; its creep coefficients at the centre are used.
        load: Static wheel load N [N].
        amplitude: A [m].
    """
    sine = np.sin((np.arange(PHASES) + 0.5) * (2.0 * np.pi / PHASES))
    nudge = 1e-3 * amplitude

    def harmonic(values: Reals) -> float:
        return float(2.0 * (values * sine).mean() / amplitude)

    at = wheelset_position(pair, amplitude * sine)
    shifted = [wheelset_position(pair, amplitude * sine + step) for step in (nudge, -nudge)]
    height = [0.5 * (position.right.gap + position.left.gap) for position in shifted]  # of the axle, down
    centre = dict(zip(table.COLUMNS, table.lookup(0.0, 0.0), strict=True))
    return EquivalentContact(
        conicity=harmonic(0.5 * (at.right.dz_w - at.left.dz_w)),
        roll=-harmonic(at.roll),
        angle=harmonic(0.5 * (at.right.tan_gamma - at.left.tan_gamma)),
        rise=-harmonic((height[0] - height[1]) / (2.0 * nudge)),
        slope=float(centre["tan_gamma"]),
        half_base=pair.settings.half_spacing + float(centre["s_w"]),
        f11=float(centre["c11"]) * load ** (2.0 / 3.0),
        f22=float(centre["c22"]) * load ** (2.0 / 3.0),
        f23=float(centre["c23"]) * load,
        f33=float(centre["c33"]) * load ** (4.0 / 3.0),
    )


def fastest_growth(train: TrainModel, contact: EquivalentContact, load: float, V: float) -> complex:
    """Eigenvalue with the largest real part.

    Args:
        train: Source of M, C, C_speed, K; nonlinear elements at their initial slope.
        contact: Contact of every wheelset.
        load: Static wheel load N [N].
        V: Speed [m/s].

    Returns:
        Growth and circular frequency s [1/s]; the imaginary part is not negative.
    """
    M, C, K = _matrices(train, contact, load, V)
    n = len(M)
    I, zero = np.eye(n), np.zeros((n, n))
    s = scipy.linalg.eigvals(np.block([[zero, I], [-K, -C]]), np.block([[I, zero], [zero, M]]))
    s = s[np.isfinite(s) & (np.abs(s) < MASSLESS)]
    first = s[np.argmax(s.real)]
    return complex(first.real, abs(first.imag))


def critical_speed(
    train: TrainModel, contact: EquivalentContact, load: float, top: float = 1000.0, step: float = 5.0
) -> float:
    """Lowest speed [km/h] of a grid at which a motion grows; infinite if none does up to ``top``."""
    for kmh in np.arange(50.0, top + step, step):
        if fastest_growth(train, contact, load, kmh / 3.6).real > 0.0:
            return float(kmh)
    return float("inf")


def _matrices(train: TrainModel, contact: EquivalentContact, load: float, V: float) -> tuple[Reals, Reals, Reals]:
    """M, C, K without the wheelsets' z, roll and pitch, contact included."""
    y, z, roll, pitch, yaw = train.wheelset_dof.T
    T = np.eye(train.n)
    T[roll, y] = -contact.roll
    gone = np.concatenate([z, roll, pitch])
    T = np.delete(T, gone, axis=1)
    left = np.delete(np.arange(train.n), gone)
    M, C, K = (T.T @ A @ T for A in (train.M, train.C + V * train.C_speed, train.K))
    C_wheelset, K_wheelset = _wheelset(contact, load, V, float(train.wheel_radius[0]))
    for first, second in zip(np.searchsorted(left, y), np.searchsorted(left, yaw), strict=True):
        own = np.ix_([first, second], [first, second])
        C[own] += C_wheelset
        K[own] += K_wheelset
    return M, C, K


def _wheelset(contact: EquivalentContact, load: float, V: float, r0: float) -> tuple[Reals, Reals]:
    """Damping and stiffness of both contacts of a wheelset on (y, psi)."""
    c, b = contact, contact.half_base
    lever = 1.0 + r0 * c.roll
    spin = c.angle / r0
    C = np.array([[c.f22 * lever**2, c.f23 * lever], [-c.f23 * lever, c.f11 * b**2 + c.f33]])
    K = np.array(
        [
            [load * c.rise - c.f23 * lever * spin, -c.f22 * lever],
            [c.f11 * b * c.conicity / r0 - c.f33 * spin, c.f23 - load * b * c.slope],
        ]
    )
    return 2.0 / V * C, 2.0 * K
