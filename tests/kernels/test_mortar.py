"""The mortar bed: voids, and the kernel of its force and pressure."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.kernels import mortar as kernel
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import build
from tiengine.track.mortar import GAUSS, Mortar, MortarVoid, bed_factors
from tiengine.track.slab import Slab, load_slab
from tiengine.track.slab_matrices import SlabMatrices, slab_designs

ROUNDING = np.finfo(float).eps
TRAINS, SLABS, LEAD = 2, 3, 5  # LEAD columns of a train belong to something else
DESIGN = np.array([[0, 1, 2], [2, 0, 1]], np.int32)

VOIDS = [
    MortarVoid(slab=4, x=(0.0, 1.3), y=(-1.25, 1.25)),
    MortarVoid(slab=9, x=(2.1, 3.3), y=(-0.4, 1.1), factor=0.35),
]


@pytest.fixture(scope="module")
def bed() -> tuple[Slab, Mortar, list[SlabMatrices]]:
    """CRTS III: intact, hollow at its rear end, soft in its middle."""
    slab, mortar = load_slab("CRTS_III")
    return slab, mortar, slab_designs(slab, mortar, VOIDS)[0]


def random_motion(designs: list[SlabMatrices], seed: int) -> NDArray[np.float64]:
    """Rows u, v, f; pressures of some 10 kPa, enough to lift from rho g h = 4.9 kPa."""
    motion = np.random.default_rng(seed).normal(size=(3, TRAINS * (LEAD + SLABS * designs[0].n)))
    return motion * np.array([[1e-5], [1e-2], [0.0]])


def apply(
    bed: tuple[Slab, Mortar, list[SlabMatrices]], motion: NDArray[np.float64], explicit: int, no_tension: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Forces of every slab, shape (TRAINS, SLABS, n), and extreme pressures, shape (TRAINS, SLABS, 2)."""
    _, mortar, designs = bed
    n = designs[0].n
    moved = motion.copy()
    pressure = np.zeros((TRAINS, SLABS, 2))
    kernel.add_bed_forces(
        TRAINS,
        LEAD + SLABS * n,
        n,
        (LEAD + n * np.arange(SLABS)).astype(np.int32),
        DESIGN,
        designs[0].bed_index,
        designs[0].bed_shape,
        designs[0].bed_weight,
        np.stack([d.bed_factor for d in designs]),
        np.stack([d.bed_weight_pressure for d in designs]),
        np.stack([d.K_bed[-2:, -2:] for d in designs]),
        np.stack([d.C_bed[-2:, -2:] for d in designs]),
        mortar.stiffness,
        mortar.damping,
        explicit,
        no_tension,
        moved,
        pressure,
    )
    rows = moved.reshape(3, TRAINS, LEAD + SLABS * n)
    np.testing.assert_array_equal(moved[:2], motion[:2])  # the state is read only
    assert not rows[2, :, :LEAD].any()
    return rows[2, :, LEAD:].reshape(TRAINS, SLABS, n), pressure


def slab_states(designs: list[SlabMatrices], motion: NDArray[np.float64]) -> NDArray[np.float64]:
    """Displacements and velocities of every slab, shape (2, TRAINS, SLABS, n)."""
    n = designs[0].n
    return motion[:2].reshape(2, TRAINS, -1)[:, :, LEAD:].reshape(2, TRAINS, SLABS, n)


def pressures(mortar: Mortar, m: SlabMatrices, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pressure beyond the weight's at every quadrature point, in NumPy, shape (n_el, n_q)."""
    w, rate = (x[m.bed_index] @ m.bed_shape.T for x in (u, v))
    return m.bed_factor * (mortar.stiffness * w + mortar.damping * rate)


def nodal(m: SlabMatrices, p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Generalised force of a pressure, in NumPy, shape (n,)."""
    forces = (p * m.bed_weight) @ m.bed_shape
    return np.bincount(m.bed_index.ravel(), forces.ravel(), minlength=m.n)


# Kernel


def test_explicit_bed_is_the_implicit_matrix(bed: tuple[Slab, Mortar, list[SlabMatrices]]) -> None:
    """-(K_bed u + C_bed v), lateral bed included, for every design, slab and train."""
    _, _, designs = bed
    motion = random_motion(designs, 1)
    force, _ = apply(bed, motion, explicit=1, no_tension=0)
    u, v = slab_states(designs, motion)
    for b in range(TRAINS):
        for s in range(SLABS):
            m = designs[DESIGN[b, s]]
            exact = -(m.K_bed @ u[b, s] + m.C_bed @ v[b, s])
            scale = np.abs(m.K_bed) @ np.abs(u[b, s]) + np.abs(m.C_bed) @ np.abs(v[b, s])
            # quadrature and assembly sum some 16 x 4 x 12 terms of random sign, in another order
            assert np.all(np.abs(force[b, s] - exact) <= 100 * ROUNDING * scale.max())


def test_implicit_bed_adds_nothing(bed: tuple[Slab, Mortar, list[SlabMatrices]]) -> None:
    """With the bed in the implicit block the kernel adds exactly zero but reports pressures."""
    force, pressure = apply(bed, random_motion(bed[2], 2), explicit=0, no_tension=0)
    assert not force.any()
    assert np.all(pressure[..., 0] > pressure[..., 1])


@pytest.mark.parametrize("no_tension", [0, 1])
def test_pressures_against_numpy(bed: tuple[Slab, Mortar, list[SlabMatrices]], no_tension: int) -> None:
    """Largest and smallest total pressure, weight included; zero where a bed without tension let go."""
    _, mortar, designs = bed
    motion = random_motion(designs, 3)
    u, v = slab_states(designs, motion)
    _, pressure = apply(bed, motion, explicit=0, no_tension=no_tension)
    for b in range(TRAINS):
        for s in range(SLABS):
            m = designs[DESIGN[b, s]]
            total = m.bed_weight_pressure + pressures(mortar, m, u[b, s], v[b, s])
            if no_tension:
                total = np.maximum(total, 0.0)
            assert total.max() > 2.0 * 4905.0  # the state is a demanding one
            # twelve terms, of the size of the largest pressure
            tolerance = 50 * ROUNDING * np.abs(total).max()
            np.testing.assert_allclose(pressure[b, s], [total.max(), total.min()], atol=tolerance)


def test_bed_without_tension_against_numpy(bed: tuple[Slab, Mortar, list[SlabMatrices]]) -> None:
    """Both modes give the same force; it is that of max(0, p_0 + p) - p_0 over the points."""
    _, mortar, designs = bed
    motion = random_motion(designs, 4)
    u, v = slab_states(designs, motion)
    explicit, _ = apply(bed, motion, explicit=1, no_tension=1)
    deviation, _ = apply(bed, motion, explicit=0, no_tension=1)
    assert np.all(np.abs(deviation).max(axis=2) > 1.0)  # every slab has let go somewhere [N]
    for b in range(TRAINS):
        for s in range(SLABS):
            m = designs[DESIGN[b, s]]
            p0 = m.bed_weight_pressure
            carried = np.maximum(p0 + pressures(mortar, m, u[b, s], v[b, s]), 0.0) - np.maximum(p0, 0.0)
            exact = -nodal(m, carried)
            # 768 terms of the size of the largest
            tolerance = 100 * ROUNDING * nodal(m, np.abs(pressures(mortar, m, u[b, s], v[b, s]))).max()
            np.testing.assert_allclose(explicit[b, s, :-2], exact[:-2], atol=tolerance)
            linear = -(m.K_bed @ u[b, s] + m.C_bed @ v[b, s])
            both = linear + deviation[b, s]
            # K_bed with random u sums larger numbers than the pressures' product
            np.testing.assert_allclose(both[:-2], explicit[b, s, :-2], atol=10 * tolerance)
            assert not deviation[b, s, -2:].any()  # the lateral bed stays linear


def test_lifted_slab_carries_its_weight_at_most(bed: tuple[Slab, Mortar, list[SlabMatrices]]) -> None:
    """Lifted by 1 mm, the bed has lost what it carried at rest, m g, and no more."""
    slab, _, designs = bed
    n = designs[0].n
    motion = np.zeros((3, TRAINS * (LEAD + SLABS * n)))
    slab_states(designs, motion)[0, :, :, : slab.plate_dofs : 3] = -1e-3
    force, pressure = apply(bed, motion, explicit=1, no_tension=1)
    uniform = np.zeros(n)
    uniform[: slab.plate_dofs : 3] = 1.0
    for b in range(TRAINS):
        for s in range(SLABS):
            m = designs[DESIGN[b, s]]
            total = np.sum(m.bed_weight * np.maximum(m.bed_weight_pressure, 0.0))
            assert force[b, s] @ uniform == pytest.approx(total, rel=1e-12)  # rounding of 288 terms
    assert force[0, 0] @ uniform == pytest.approx(slab.mass * 9.81, rel=1e-12)
    assert not pressure.any()


def test_pressed_slab_is_linear(bed: tuple[Slab, Mortar, list[SlabMatrices]]) -> None:
    """Pressed down everywhere, a bed without tension is the linear bed to the last bit."""
    slab, _, designs = bed
    motion = np.zeros((3, TRAINS * (LEAD + SLABS * designs[0].n)))
    slab_states(designs, motion)[0, :, :, : slab.plate_dofs : 3] = 1e-3
    force, _ = apply(bed, motion, explicit=0, no_tension=1)
    assert not force[DESIGN == 0].any()


def test_damping_takes_power(bed: tuple[Slab, Mortar, list[SlabMatrices]]) -> None:
    """v f < 0 for every slab with no displacement: the bed's damper never feeds."""
    motion = random_motion(bed[2], 5)
    motion[0] = 0.0
    force, _ = apply(bed, motion, explicit=1, no_tension=0)
    assert np.all(np.sum(slab_states(bed[2], motion)[1] * force, axis=-1) < 0.0)


def test_a_second_run_gives_the_same_bits(bed: tuple[Slab, Mortar, list[SlabMatrices]]) -> None:
    """The force is summed in a fixed order, without atomics."""
    motion = random_motion(bed[2], 6)
    first, second = (apply(bed, motion, explicit=1, no_tension=1) for _ in range(2))
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


# Voids


def test_void_area_is_exact_wherever_it_lies() -> None:
    """Sum of (1 - factor) dA = (1 - factor) A_void for a hundred random rectangles and meshes."""
    rng = np.random.default_rng(7)
    length, width = 5.6, 2.5
    weight = np.polynomial.legendre.leggauss(GAUSS)[1]
    for _ in range(100):
        n_x, n_y = (int(n) for n in rng.integers(1, 12, 2))
        x = np.sort(rng.uniform(0.0, length, 2))
        y = np.sort(rng.uniform(-width / 2, width / 2, 2))
        f = rng.uniform(0.0, 2.0)
        void = MortarVoid(slab=0, x=(x[0], x[1]), y=(y[0], y[1]), factor=f)
        factor = bed_factors(length, width, (n_x, n_y), [void])
        area = np.outer(weight, weight).ravel() * length * width / (4 * n_x * n_y)
        missing = np.sum((1.0 - factor) * area)
        exact = (1.0 - f) * (x[1] - x[0]) * (y[1] - y[0])
        assert missing == pytest.approx(exact, abs=1000 * ROUNDING * length * width)  # up to 2000 points


def test_voids_side_by_side_are_one_void() -> None:
    """Two voids that touch within a cell equal their union; under a void the factor is 0."""
    left = MortarVoid(slab=0, x=(0.5, 2.0), y=(-1.0, 0.13))
    right = MortarVoid(slab=0, x=(0.5, 2.0), y=(0.13, 1.25))
    union = MortarVoid(slab=0, x=(0.5, 2.0), y=(-1.0, 1.25))
    ours = bed_factors(5.6, 2.5, (9, 2), [left, right])
    np.testing.assert_allclose(ours, bed_factors(5.6, 2.5, (9, 2), [union]), atol=10 * ROUNDING)
    inside = bed_factors(5.6, 2.5, (9, 2), [union])[2 * 2 + 1]  # x 1.24...1.87, y 0...1.25
    np.testing.assert_allclose(inside, 0.0, atol=10 * ROUNDING)
    assert np.all(bed_factors(5.6, 2.5, (9, 2), [union])[2 * 8] == 1.0)  # far from it


# Errors


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"slab": -1}, r"void\.slab = -1: must be greater than or equal to 0"),
        ({"factor": 11.0}, r"void\.factor = 11\.0: must be less than or equal to 10"),
        ({"x": (float("nan"), 2.0)}, r"void\.x\[0\] = nan: "),
    ],
)
def test_bad_voids_are_refused(change: dict[str, float], message: str) -> None:
    table = {"slab": 3, "x": (1.0, 2.0), "y": (-1.0, 1.0), **change}
    with pytest.raises(InputError, match=message):
        build(MortarVoid, table, "void")


def test_voids_must_fit_their_slab() -> None:
    """Turned round, beyond the slab's end or side, or over another void."""

    def void(**change: tuple[float, float]) -> MortarVoid:
        table = {"slab": 7, "x": (1.0, 2.0), "y": (-1.0, 1.0), **change}
        return build(MortarVoid, table)

    with pytest.raises(InputError, match=r"slab 7\.x = \[1\.0, 6\.0\]: must .* <= 5\.6 m \(the slab's length\)"):
        bed_factors(5.6, 2.5, (9, 2), [void(x=(1.0, 6.0))])
    with pytest.raises(InputError, match=r"slab 7\.y = \[-1\.0, 1\.3\]: must .* <= 1\.25 m \(the slab's width\)"):
        bed_factors(5.6, 2.5, (9, 2), [void(y=(-1.0, 1.3))])
    with pytest.raises(InputError, match=r"slab 7\.y = \[1\.0, -1\.0\]: must be \[from, to\]"):
        bed_factors(5.6, 2.5, (9, 2), [void(y=(1.0, -1.0))])
    with pytest.raises(InputError, match=r"slab 7\.x = \[1\.5, 3\.0\]: overlaps the void from x = 1 to 2 m"):
        bed_factors(5.6, 2.5, (9, 2), [void(), void(x=(1.5, 3.0))])


def test_bad_mortar_is_refused() -> None:
    table = {"stiffness": 0.0, "damping": 0.0, "lateral_stiffness": 0.0, "lateral_damping": 0.0}
    with pytest.raises(InputError, match=r"mortar\.stiffness = 0\.0: must be greater than 0 N/m\^3"):
        build(Mortar, table, "mortar")


@pytest.mark.parametrize("damping", [0.0, 3e4])
def test_a_closing_gap_makes_no_energy(bed: tuple[Slab, Mortar, list[SlabMatrices]], damping: float) -> None:
    """A free slab thrown onto a bed 20 um below it, without weight: it comes back with the energy it brought, or less.

    Central differences at a tenth of the shortest period of slab and bed keep energy within 1 %.
    """
    slab, mortar, designs = bed
    m, n, gap, dt = designs[0], designs[0].n, 2e-5, 2e-6
    motion = np.zeros((3, n))
    motion[1, :-2:3] = 0.2 * (1.0 + 0.3 * np.arange(slab.plate_dofs // 3) / slab.plate_dofs)
    area, rest = np.full((1, 2, 2), 0.0), np.full((1, *m.bed_factor.shape), -mortar.stiffness * gap)
    inverse = np.linalg.inv(m.M)
    energies = []
    for _ in range(1500):
        motion[2] = -m.K_plate @ motion[0]
        kernel.add_bed_forces(
            1, n, n, np.zeros(1, np.int32), np.zeros((1, 1), np.int32), m.bed_index, m.bed_shape, m.bed_weight,
            np.ones_like(rest), rest, area, area, mortar.stiffness, damping, 1, 1, motion, np.zeros((1, 1, 2)),
        )  # fmt: skip
        w = np.einsum("ei,qi->eq", motion[0][m.bed_index], m.bed_shape)
        spring = 0.5 * mortar.stiffness * np.sum(m.bed_weight * np.maximum(w - gap, 0.0) ** 2)
        energies.append(0.5 * (motion[1] @ m.M @ motion[1] + motion[0] @ m.K_plate @ motion[0]) + spring)
        motion[1] += dt * (inverse @ motion[2])
        motion[0] += dt * motion[1]
    energies = np.array(energies)
    assert np.any(w < gap - 1e-5)  # it has left the bed again
    assert energies.max() < 1.01 * energies[0]
    if damping:
        assert energies[-1] < 0.97 * energies[0]
    else:
        assert energies.min() > 0.99 * energies[0]
