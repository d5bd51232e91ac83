"""Bending moments of a slab: exact where the element is, and against a deflection that leaves free edges free."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve

from tiengine.track.baseplate import seat_rows
from tiengine.track.mortar import Mortar, MortarVoid
from tiengine.track.plate_shapes import W, element_dofs, shapes_at, tabulate_shapes
from tiengine.track.slab import Slab, load_slab
from tiengine.track.slab_matrices import slab_matrices
from tiengine.track.slab_moments import (
    GAUSS_POINTS,
    fine_mesh,
    moment_rows,
    moment_table,
    moments_of_motion,
    moments_of_pressure,
    places,
    plate_matrices,
    pressures_felt,
)  # fmt: skip

PLATE = (0.36, 0.18)


@pytest.fixture(scope="module")
def given() -> tuple[Slab, Mortar]:
    return load_slab("CRTS_III")


def nodal(slab: Slab, x_part: Polynomial, y_part: Polynomial) -> NDArray[np.float64]:
    """Slab coordinates of w = f(x) g(y), from the slab's centre, shape (dofs,)."""
    x = np.linspace(-slab.length / 2, slab.length / 2, slab.elements_x + 1)
    y = np.linspace(-slab.width / 2, slab.width / 2, slab.elements_y + 1)
    x, y = (z.ravel() for z in np.meshgrid(x, y, indexing="ij"))
    rows = [x_part(x) * y_part(y), x_part.deriv()(x) * y_part(y), x_part(x) * y_part.deriv()(y)]
    return np.append(np.stack(rows, axis=1).ravel(), [0.0, 0.0])


ONE, LINE = Polynomial([1.0]), Polynomial([0.0, 1.0])


@pytest.mark.parametrize(
    ("f", "g", "w_xx", "w_yy"),
    [
        (LINE**2, ONE, lambda x, y: 2.0 + 0.0 * x, lambda x, y: 0.0 * x),
        (ONE, LINE**2, lambda x, y: 0.0 * x, lambda x, y: 2.0 + 0.0 * x),
        (LINE, LINE, lambda x, y: 0.0 * x, lambda x, y: 0.0 * x),
        (LINE**3, ONE, lambda x, y: 6.0 * x, lambda x, y: 0.0 * x),
        (LINE, LINE**2, lambda x, y: 0.0 * x, lambda x, y: 2.0 * x),
    ],
    ids=["x2", "y2", "xy", "x3", "xy2"],
)
def test_moments_of_polynomials(given, f, g, w_xx, w_yy):
    """The element holds all cubics: M_x = -D (w,xx + nu w,yy), M_y = -D (w,yy + nu w,xx), to rounding."""
    slab, _ = given
    D, nu = slab.rigidity, slab.nu
    x, y = places(slab, GAUSS_POINTS)
    found = (moment_rows(slab, x, y) @ nodal(slab, f, g)[:-2]).reshape(2, -1)
    expected = -D * np.stack([w_xx(x, y) + nu * w_yy(x, y), w_yy(x, y) + nu * w_xx(x, y)])
    np.testing.assert_allclose(found, expected, atol=1e-10 * D)  # 1/h^2 = 3 / m^2 times rounding of 3 m


def quartic(size: float) -> Polynomial:
    """Zero with its first three derivatives at +- size / 2, one in the middle."""
    return (Polynomial([1.0, 0.0, -4.0 / size**2])) ** 4


def static_error(slab: Slab, mortar: Mortar) -> float:
    """Error of the moments under a load whose deflection is known, over their root mean square.

    w = f(x) g(y) of quartic zeros at the edges leaves no moment, no shear there and no force at the corners, so that it
    is the deflection of a free slab on its bed under q = D (w,xxxx + 2 w,xxyy + w,yyyy) + k w.

    Returns:
        Root mean square of the error at the Gauss points.
    """
    f, g, D = quartic(slab.length), quartic(slab.width), slab.rigidity

    def w(x: NDArray[np.float64], y: NDArray[np.float64], i: int = 0, j: int = 0) -> NDArray[np.float64]:
        return (f.deriv(i) if i else f)(x) * (g.deriv(j) if j else g)(y)

    def load(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        return D * (w(x, y, 4, 0) + 2.0 * w(x, y, 2, 2) + w(x, y, 0, 4)) + mortar.stiffness * w(x, y)

    gauss, weight = np.polynomial.legendre.leggauss(8)
    points = np.array([[a, b] for a in gauss for b in gauss])
    area = np.outer(weight, weight).ravel() * slab.length * slab.width / (4.0 * slab.elements_x * slab.elements_y)
    q = load(*places(slab, points)).reshape(-1, len(points))
    index, shape = element_dofs(slab), tabulate_shapes(slab, points)[:, W]
    m = slab_matrices(slab, mortar)
    F = np.bincount(index.ravel(), ((q * area) @ shape).ravel(), slab.plate_dofs)
    u = np.linalg.solve((m.K_plate + m.K_bed)[:-2, :-2], F)

    x, y = places(slab)
    exact = -D * np.stack([w(x, y, 2, 0) + slab.nu * w(x, y, 0, 2), w(x, y, 0, 2) + slab.nu * w(x, y, 2, 0)])
    found = (moment_rows(slab, x, y) @ u).reshape(2, -1)
    return float(np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2)))


def test_moments_of_a_slab_on_its_bed_converge(given):
    """At the Gauss points at least with the square of the element's size.

    Meshes of 12, 18 and 27 elements: order 2 to 3 means a ratio of 2.25 to 3.4. Measured: 2.6, 0.9 and 0.3 %.
    """
    slab, mortar = given
    errors = np.array(
        [
            static_error(slab.model_copy(update={"elements_x": nx, "elements_y": ny}), mortar)
            for nx, ny in ((12, 8), (18, 12), (27, 18))
        ]
    )
    ratio = errors[:-1] / errors[1:]
    assert np.all((1.5**2 < ratio) & (ratio < 1.5**3))


def test_a_load_in_the_middle_stretches_the_underside(given):
    """Sign: the slab sags under a force down, on both axes."""
    slab, mortar = given
    m = slab_matrices(slab, mortar)
    index, table = shapes_at(slab, np.zeros(1), np.zeros(1))
    force = np.zeros(m.n)
    force[index[0]] = 1e5 * table[0, W]
    u = np.linalg.solve((m.K_plate + m.K_bed)[:-2, :-2], force[:-2])
    x, y = places(slab)
    nearest = np.argmin(np.hypot(x, y))
    assert np.all((moment_rows(slab, x, y) @ u).reshape(2, -1)[:, nearest] > 0.0)


# Recovery on the fine mesh


def answer(
    slab: Slab, mortar: Mortar, force: NDArray[np.float64], couple: NDArray[np.float64], s: complex = 0.0,
    voids: tuple[MortarVoid, ...] = (),
) -> NDArray[np.complex128]:  # fmt: skip
    """Moments at a table's places by F_V and M_b of the seats that go as exp(s t), from the motion of the step's mesh.

    Args:
        slab: The slab with the step's mesh.
        mortar: Its bed.
        force: Left ones first, shape (2 seats,).
        couple: Same shape.
        s: i omega [1/s].
        voids: Voids of the bed.
    """
    m = slab_matrices(slab, mortar, voids, PLATE)
    F = np.zeros(m.n)
    for k, (f, c) in enumerate(zip(force, couple, strict=True)):
        side, j = divmod(k, slab.fastenings)
        F[m.seat_index[j, side]] += f * m.seat_w[j, side] + c * m.seat_slope[j, side]
    A = m.K_plate + m.K_bed + s * m.C_bed + s**2 * m.M
    u = np.append(np.linalg.solve(A[:-2, :-2], F[:-2] + 0j), [0.0, 0.0])
    by_pressure = moment_table(slab, None, PLATE) if voids else None
    operator = moments_of_motion(slab, mortar, m, moment_table(slab, mortar, PLATE), by_pressure)
    return np.einsum("kn,knp->p", np.stack([u, s * u, s**2 * u]), operator)


def direct(
    fine: Slab, mortar: Mortar, force: NDArray[np.float64], couple: NDArray[np.float64], s: complex = 0.0
) -> NDArray[np.complex128]:
    """The same from the motion of a fine mesh itself; arguments as for :func:`answer`."""
    K, M, B = plate_matrices(fine)
    seat_x = (np.arange(fine.fastenings) - (fine.fastenings - 1) / 2.0) * fine.fastening_pitch
    x, y = np.tile(seat_x, 2), fine.seat_half_spacing * np.repeat([-1.0, 1.0], fine.fastenings)
    index, w, slope = seat_rows(fine, x, y, PLATE)
    F = np.bincount(index.ravel(), (force[:, None] * w + couple[:, None] * slope).ravel(), fine.plate_dofs)
    u = spsolve(sp.csc_array(K + (mortar.stiffness + s * mortar.damping) * B + s**2 * M), F + 0j)
    return moment_rows(fine, *moment_table(fine, mortar, PLATE, fine).places) @ u


def doubled(slab: Slab) -> Slab:
    """The slab with a mesh twice as fine."""
    return slab.model_copy(update={"elements_x": 2 * slab.elements_x, "elements_y": 2 * slab.elements_y})


def one_seat(slab: Slab, seat: int, force: float = 3e4) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """F_V and M_b of all seats: a force on one."""
    loads = np.zeros((2, 2 * slab.fastenings))
    loads[0, seat] = force
    return loads[0], loads[1]


@pytest.mark.parametrize("name", ["CRTS_I", "CRTS_III"])
@pytest.mark.parametrize("seat", [0, 4])
def test_moments_under_a_seat_are_converged(name, seat):
    """At the slab's end and in its middle, from the step's mesh: within 4 % of a mesh that is twice as fine itself.

    The required bound is 5 % (MODEL 15). The mesh of 0.1 m has 1 to 3 % in the middle of a baseplate, as the place
    within its element happens to be. Read off the step's mesh itself the moments are 55 % off.
    """
    slab, mortar = load_slab(name)
    loads = one_seat(slab, seat)
    found, exact = answer(slab, mortar, *loads).real, direct(doubled(fine_mesh(slab)), mortar, *loads).real
    for along, other in zip(np.split(found, 2), np.split(exact, 2), strict=True):
        assert other.max() == other[6 * seat]  # of three places across, six a seat
        assert np.abs(along - other).max() < 0.04 * other.max()


def test_a_seat_on_a_point_has_no_converged_moment(given):
    """Twice as fine a mesh raises it by (1 + nu) log(2)/(4 pi) of the load, by 7 %."""
    slab, mortar = given
    fine = fine_mesh(slab)
    coarse, finer = (moment_table(slab, mortar, fine=mesh).matrix[4, 24] for mesh in (fine, doubled(fine)))
    rise = (1.0 + slab.nu) / (4.0 * np.pi) * np.log(2.0)
    assert finer - coarse == pytest.approx(rise, rel=0.5)  # places within the elements differ


def test_recovered_moments_of_a_vibrating_slab(given):
    """Seat forces at 60 to 250 Hz on the 9 x 2 mesh: moments as those of the fine mesh that vibrates itself, to 6 %.

    At 60 and 150 Hz within 1.5 %. The first bending across is at 400 Hz on the bed; the step's mesh has it 10 % too
    low, so that its inertia is off from about 250 Hz on, where a train's forces have faded.
    """
    slab, mortar = given
    rng = np.random.default_rng(5)
    loads = 3e4 * rng.random(2 * slab.fastenings), 500.0 * rng.standard_normal(2 * slab.fastenings)
    for frequency in (60.0, 150.0, 250.0):
        s = 2j * np.pi * frequency
        exact = direct(fine_mesh(slab), mortar, *loads, s)
        allowed = 0.06 if frequency > 200.0 else 0.02
        assert np.abs(answer(slab, mortar, *loads, s) - exact).max() < allowed * np.abs(exact).max()


def test_moments_over_a_void(given):
    """The pressure that a void lacks is among the loads: as those of a step's mesh twice as fine, to 3 %."""
    slab, mortar = given
    void = MortarVoid(slab=0, x=(0.0, 4 * slab.length / 9), y=(-slab.width / 2, slab.width / 2))
    loads = one_seat(slab, 2)
    found, exact = (answer(each, mortar, *loads, voids=(void,)).real for each in (slab, doubled(slab)))
    assert np.abs(found - exact).max() < 0.03 * np.abs(exact).max()
    sound = answer(slab, mortar, *loads).real
    assert np.abs(found).max() > 2.0 * np.abs(sound).max()


def test_moments_on_a_bed_that_does_not_pull(given):
    """Given a slab's motion, a bed that loses its pull has the seats press as much more: as a void that does so."""
    slab, mortar = given
    edge = 4 * slab.length / 9
    void = MortarVoid(slab=0, x=(0.0, edge), y=(-slab.width / 2, slab.width / 2))
    sound, holed = slab_matrices(slab, mortar, (), PLATE), slab_matrices(slab, mortar, [void], PLATE)
    table, on_bed = moment_table(slab, None, PLATE), moment_table(slab, mortar, PLATE)
    u = np.random.default_rng(3).standard_normal((3, sound.n))
    whole, without = (
        np.einsum("kn,knp->p", u, moments_of_motion(slab, mortar, m, on_bed, table)) for m in (sound, holed)
    )
    felt = (mortar.stiffness * u[0] + mortar.damping * u[1]) @ pressures_felt(sound)
    lost = (holed.bed_factor.ravel() - 1.0) * felt
    found = whole + lost @ moments_of_pressure(slab, sound, table)
    assert np.abs(found - without).max() < 1e-9 * np.abs(without).max()
