"""Wheels out of round, dipped joints, wind and coupled cars: closed forms, receptances, a rail wave for a wheel's."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.linalg import eigh

from tiengine.indices.p2_resonance import contact_stiffness
from tiengine.irregularity.wheel_shapes import WheelShape, flat_depth, radius_deviation
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY
from tiengine.scenario.contact_settings import contact_settings
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.vehicle.connector import Spring
from tiengine.vehicle.coupling import Coupling
from tiengine.vehicle.train import assemble, static_wheel_loads
from tiengine.vehicle.vehicle import load_vehicle
from validation.closed_forms.floquet import Seats
from validation.closed_forms.receptance import receptance
from validation.closed_forms.timoshenko import Beam
from validation.frame.case import Case

__all__ = ["CASES"]

QUIET = {
    "output.precision": "double", "output.envelopes": False, "output.deflection_interval": "none",
    "irregularity.taper": 5.0, "output.body_interval": "step",
}  # fmt: skip
R0 = 0.43
ORDER, AMPLITUDE, SPEED = 10, 1e-5, 60.0  # waves of 0.27 m at 60 m/s: 222 Hz


@cache
def _polygon() -> float:
    """Amplitude of the force of a wheelset whose wheels have ten waves [N], at the frequency of the waves."""
    shape = {"kind": "harmonics", "wheelsets": [1], "order": [ORDER], "amplitude": [AMPLITUDE]}
    changes = QUIET | {
        "train.speed_kmh": 3.6 * SPEED, "train.distance": 30.0, "train.wheel_shapes": [shape],
        "numerics.time_step": 1e-4,
    }  # fmt: skip
    with run(load_scenario("smooth", changes)) as result:
        wheel, body = result.wheel(), result.group("body")
    turned = (wheel["position"] - wheel["position"][0]) / R0
    angle = turned - np.interp(wheel["time"], body["time"], body["displacement"][:, 3, 3])
    late = wheel["position"] - wheel["position"][0] > 10.0
    whole = late & (angle < angle[late][0] + 2.0 * np.pi * np.floor((angle[-1] - angle[late][0]) / (2.0 * np.pi)))
    force = wheel["normal_force"][whole, 0, :].mean(axis=1)
    return float(2.0 * np.abs(np.mean((force - force.mean()) * np.exp(-1j * ORDER * angle[whole]))))


def _fastening_on_slab(omega: float) -> complex:
    """Dynamic stiffness of a fastening on its share of the slab and the mortar, which bounces at 250 Hz [N/m]."""
    parts = load_scenario("smooth").parts
    slab, mortar, fastening = parts.slab, parts.mortar, parts.fastening
    bed = mortar.stiffness - slab.rho * slab.thickness * omega**2 + 1j * omega * mortar.damping
    under = 0.5 * slab.fastening_pitch * slab.width * bed
    seat = fastening.vertical_stiffness + 1j * omega * fastening.vertical_damping
    return complex(seat * under / (seat + under))


def _by_receptances() -> float:
    """A/|alpha_w + alpha_c + alpha_r| of half a wheelset, the Hertz spring and the rail on its supports [N]."""
    scenario = load_scenario("smooth")
    parts = scenario.parts
    rail, train = parts.rail, assemble(parts.vehicles)
    f = ORDER * SPEED / (2.0 * np.pi * R0)
    omega = 2.0 * np.pi * f
    beam = Beam(rail.E * rail.Iy, rail.kappa_vertical * rail.G * rail.A, rail.mass_per_length, rail.rho * rail.Iy)
    support = _fastening_on_slab(omega)
    seats = Seats(parts.slab.fastening_pitch, support.real, support.imag / omega)
    of_rail = np.mean([receptance(beam, seats, 0.0, x * seats.pitch, np.array([f]))[0] for x in (0.0, 0.25, 0.5, 0.75)])
    load = float(static_wheel_loads(train)[0].mean())
    of_contact = 1.0 / contact_stiffness(parts, contact_settings(scenario, train), load)
    of_wheel = -1.0 / (0.5 * float(train.wheelset_mass[0]) * omega**2)
    return float(AMPLITUDE / abs(of_wheel + of_contact + of_rail))


def _fall() -> Reals:
    """Fall of the centre over a new flat of 50 mm at 0, 10, 20 and 24 mm from its middle [mm]."""
    s = np.array([0.0, 0.010, 0.020, 0.024])
    return -1e3 * radius_deviation(WheelShape(kind="flat", length=0.05), R0, s / R0)


@cache
def _peak(speed: float, table: str, length: float) -> float:
    """Largest vertical force of the leading left wheel over a new flat, or over a joint [kN].

    Shapes grow in ahead of the leading wheel's start: the third wheelset would not come so far in 12 m.
    """
    changes = QUIET | {"train.speed_kmh": speed, "train.distance": 12.0, "numerics.time_step": "auto"}
    if table == "flat":
        shape = {"kind": "flat", "wheelsets": [1], "side": "left", "length": length, "angle": 18.0}
        changes |= {"train.wheel_shapes": [shape], "numerics.time_step": 1e-5}
    else:
        changes |= {"track.rail_shapes": [{"kind": "joint", "at": 36.0, "length": 2.0, "depth": length}]}
    with run(load_scenario("smooth", changes)) as result:
        return float(1e-3 * result.wheel()["vertical_force"][:, 0, 0].max())


PLACES = np.array([-0.02, -0.01, 0.0, 0.01, 0.02])  # m from the middle of the flat


def _walk() -> Reals:
    """Fall of a wheelset that rolls over new flats of 50 mm on both its wheels at 1 km/h, at ``PLACES`` [mm]."""
    shape = {"kind": "flat", "wheelsets": [1], "length": 0.05, "angle": 0.1 / R0}
    changes = QUIET | {
        "train.speed_kmh": 1.0, "train.distance": 0.2, "irregularity.taper": 1e-3, "train.wheel_shapes": [shape],
        "numerics.time_step": 2e-4,
    }  # fmt: skip
    with run(load_scenario("smooth", changes)) as result:
        body = result.body()
    motion = body["displacement"][:, list(body["body"]).index("wheelset 1")]
    rolled = body["position"] - body["position"][0] - R0 * motion[:, 3]
    return np.asarray(1e3 * np.interp(0.1 + PLACES, rolled, motion[:, 1] - motion[0, 1]), np.float64)


def _felt_fall() -> Reals:
    """Fall by the chord as a patch of 6 mm feels it, |H|^2 = 1/(1 + pi/4 (2 pi a/wave)^3), at ``PLACES`` [mm]."""
    n, round_ = 4096, 2.0 * np.pi * R0
    x = round_ / n * (np.arange(n) - n // 2)
    fall = np.maximum(0.025 - np.abs(x), 0.0) ** 2 / (2.0 * R0)
    waves = 2.0 * np.pi * np.fft.rfftfreq(n, round_ / n)
    felt = np.fft.irfft(np.fft.rfft(fall) / np.sqrt(1.0 + 0.25 * np.pi * (6e-3 * waves) ** 3), n)
    return np.asarray(1e3 * np.interp(PLACES, x, felt), np.float64)


def _group_standard() -> float:
    """P2 = Q + 0.02 V sqrt(Mu/(Mu + Mz)) [1 - pi Cz/(4 sqrt(Kz (Mu + Mz)))] sqrt(Kz Mu) at 160 km/h [kN]."""
    train = assemble(load_scenario("smooth").parts.vehicles)
    load, Mu = float(train.gravity.sum()) / 8.0, 0.5 * float(train.wheelset_mass[0])
    Kz, Cz, Mz = 62e6, 55.4e3, 245.0
    share = np.sqrt(Mu / (Mu + Mz)) * (1.0 - np.pi * Cz / (4.0 * np.sqrt(Kz * (Mu + Mz))))
    return float(1e-3 * (load + 0.02 * (160.0 / 3.6) * share * np.sqrt(Kz * Mu)))


DIP = 5e-3  # m over ramps of 1 m: the ramps meet at 0.01 rad


def _jenkins() -> float:
    """P2 = P0 + 2 alpha V sqrt(Kt Mu) sqrt(Mu/(Mu + Mt)) [1 - pi Ct/(4 sqrt(Kt (Mu + Mt)))] [kN]."""
    scenario = load_scenario("smooth")
    parts, train = scenario.parts, assemble(scenario.parts.vehicles)
    rail, pitch = parts.rail, parts.slab.fastening_pitch
    EI, foundation = rail.E * rail.Iy, parts.fastening.vertical_stiffness / pitch
    beta = (foundation / (4.0 * EI)) ** 0.25
    load, Mu = float(train.gravity.sum()) / 8.0, 0.5 * float(train.wheelset_mass[0])
    Mt, Kt = 1.5 * rail.mass_per_length / beta, 8.0 * EI * beta**3
    Ct = 1.5 * parts.fastening.vertical_damping / pitch / beta
    share = np.sqrt(Mu / (Mu + Mt)) * (1.0 - np.pi * Ct / (4.0 * np.sqrt(Kt * (Mu + Mt))))
    return float(1e-3 * (load + 2.0 * DIP * (100.0 / 3.6) * share * np.sqrt(Kt * Mu)))


def _wind() -> Reals:
    """Moment of the wheels' forces over the wind's; sum of Y over its side force; relief of Q over its lift."""
    scenario = load_scenario(
        "smooth",
        QUIET | {"wind.speed": 12.0, "train.speed_kmh": 250.0, "train.distance": 15.0, "numerics.time_step": 2e-4},
    )
    with run(scenario) as result:
        names = ("vertical_force", "lateral_force", "contact_position_wheel")
        Q, Y, place = (result.wheel()[name][-400:].mean(axis=0) for name in names)
        y = result.group("body")["displacement"][-400:, :, 0].mean(axis=0)
    V, U = 250.0 / 3.6, 12.0
    assert scenario.parts.aerodynamics is not None
    side, lift, roll = scenario.parts.aerodynamics.coefficients(np.array(np.arctan2(U, V)))[:3]
    q = 0.5 * 1.225 * (V**2 + U**2) * 10.0
    vehicle = scenario.parts.vehicles[0]
    arm = (
        np.array([-1.0, 1.0]) * (vehicle.half_spacing + place) + y[3:, None]
    )  # of either wheel, from the track's centre
    weight = GRAVITY * np.array([body.mass for body in vehicle.body])
    moment = (Q * arm).sum() - weight @ y
    return np.array([moment / (3.0 * q * roll), Y.sum() / (q * side), (GRAVITY * vehicle.mass - Q.sum()) / (q * lift)])


CHAIN = 2e5  # N/m


def _chain() -> Reals:
    """Frequencies of eight car bodies on the couplings between them [Hz], without the rigid motion."""
    end = (0.0, 0.0, 1.0)
    coupling = Coupling(spring=(Spring(a="car", b="car", point_a=end, point_b=end, kz=CHAIN),))
    train = assemble([load_vehicle("CRH380A_v2")] * 8, couplings=[(k, coupling) for k in range(7)])
    z = [train.dof(f"v{i + 1} car", "z") for i in range(8)]
    K = np.zeros((train.n, train.n))
    for e in np.flatnonzero(train.element_between_cars):
        row = np.zeros(train.n)
        np.add.at(row, train.element_index[e], train.element_row[e])
        K += train.element_table[e, 1, 1] * np.outer(row, row)
    omega2 = eigh(K[np.ix_(z, z)], train.M[np.ix_(z, z)], eigvals_only=True)
    return np.asarray(np.sqrt(omega2[1:]) / (2.0 * np.pi), np.float64)


def _chain_closed() -> Reals:
    m = load_vehicle("CRH380A_v2").body[0].mass
    return np.asarray(np.sqrt(CHAIN / m) / np.pi * np.sin(np.arange(1, 8) * np.pi / 16.0), np.float64)


CASES = (
    Case(
        name="line-flat-depth",
        kind="verification",
        quantity="fall of the wheel's centre over a new flat of 50 mm on R 430, 0, 10, 20, 24 mm from its middle [mm]",
        source="a wheel that turns about the edge of a chord: (l/2 - |x|)^2/(2 r0); l^2/(8 r0) = 0.727 mm",
        reference=(0.7267, 0.26163, 0.02907, 0.00116),
        rtol=3e-3,
        why="the closed form leaves out (l/r0)^4, and digits of the smallest",
        compute=_fall,
    ),
    Case(
        name="line-flat-depth-formula",
        kind="verification",
        quantity="depth of that flat [mm]",
        source="l^2/(8 r0)",
        reference=0.727,
        rtol=1e-3,
        why="printed digits",
        compute=lambda: 1e3 * flat_depth(0.05, R0),
    ),
    Case(
        name="line-polygon-receptance",
        kind="verification",
        quantity="force amplitude of ten waves of 0.01 mm on both wheels of a wheelset at 60 m/s, 222 Hz [N]",
        source="A/|alpha_w + alpha_c + alpha_r|: half the wheelset, Hertz, a Timoshenko rail on its seats and slabs",
        reference=_by_receptances,
        rtol=0.05,
        why="the closed form has a rail at rest: waves run at 1 to 2 km/s, the wheel at 60 m/s; one wheelset, no bogie",
        compute=_polygon,
    ),
    Case(
        name="line-flat-rises",
        kind="verification",
        quantity="peak force over new flats of 30 and 40 mm less that of 20 and 30 mm, 60 km/h [kN]",
        source="force rises with depth",
        reference=(5.0, 5.0),
        rule="at least",
        why="a sign; 5 kN are beyond what differs from seat to seat",
        compute=lambda: np.diff([_peak(60.0, "flat", length) for length in (0.02, 0.03, 0.04)]),
        quick=False,
    ),
    Case(
        name="line-flat-walk",
        kind="verification",
        quantity="fall of a wheelset over new flats of 50 mm at 1 km/h, -20, -10, 0, 10, 20 mm from their middle [mm]",
        source="the chord, (l/2 - |x|)^2/(2 r0), as a contact patch of 6 mm feels it (model page, section 6)",
        reference=_felt_fall,
        atol=0.02,
        why="between seats the rail sinks by 0.01 mm more than over them; a wheel load that changes by 1 kN, 0.01 mm",
        compute=_walk,
    ),
    Case(
        name="line-flat-P2-order",
        kind="verification",
        quantity="common logarithm of the peak force over a new flat of 50 mm at 160 km/h, over P2",
        source="order of magnitude only: P2 = 227 kN after the British group standard GM/TT0088, for a joint of"
        " 0.02 rad (K 62 MN/m, C 55.4 kN s/m, M 245 kg); a flat of 50 mm would bend the wheel's path by 0.12 rad",
        reference=0.0,
        atol=0.5,
        why="half an order of magnitude: the formula is one for joints, and states nothing about flats",
        compute=lambda: np.log10(_peak(160.0, "flat", 0.05) / _group_standard()),
        quick=False,
    ),
    Case(
        name="line-joint-P2",
        kind="verification",
        quantity="largest force over a joint of two ramps of 5 mm/m at 100 km/h [kN]",
        source="Jenkins et al. 1974, P2 = 132 kN with the track's own k_t, m_r and damping of the fastenings",
        reference=_jenkins,
        rtol=0.08,
        why="the formula has one degree of freedom and no contact spring; it is a design rule, good to some per cent",
        compute=lambda: _peak(100.0, "joint", DIP),
        quick=False,
    ),
    Case(
        name="line-wind-static",
        kind="verification",
        quantity="moment of Q less that of the displaced weights, sum of Y, relief of Q, over moment, side force, lift"
        " of a steady wind",
        source="balance of forces and moments of the train",
        reference=(1.0, 1.0, 1.0),
        rtol=0.02,
        why="contacts lie some mm below the top of the rail; cars stand centimetres off the middle",
        compute=_wind,
    ),
    Case(
        name="line-chain-of-cars",
        kind="verification",
        quantity="frequencies of eight car bodies on springs between them [Hz]",
        source="f_j = (1/pi) sqrt(k/m) sin(j pi/16)",
        reference=_chain_closed,
        rtol=1e-9,
        why="rounding",
        compute=_chain,
    ),
)
