"""Slabs: assembled matrices, plate frequencies, bed, voids, seats, the library."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import build
from tiengine.track.mortar import Mortar, MortarVoid
from tiengine.track.slab import Slab, load_slab, slab_names
from tiengine.track.slab_matrices import SlabMatrices, slab_designs, slab_matrices
from validation.closed_forms.plate_ritz import frequencies

ROUNDING = np.finfo(float).eps

CUBICS = [(i, j) for i in range(4) for j in range(4) if i + j <= 3]
"""Powers (x, y) of the fields that every ACM mesh represents exactly."""


def node_field(slab: Slab, i: int, j: int) -> NDArray[np.float64]:
    """DOFs of w = x^i y^j about the slab's centre, lateral DOFs zero, shape (n,)."""
    x = np.linspace(-slab.length / 2, slab.length / 2, slab.elements_x + 1)
    y = np.linspace(-slab.width / 2, slab.width / 2, slab.elements_y + 1)
    x, y = (z.ravel() for z in np.meshgrid(x, y, indexing="ij"))
    w_x = i * x ** max(i - 1, 0) * y**j
    w_y = j * x**i * y ** max(j - 1, 0)
    return np.append(np.stack([x**i * y**j, w_x, w_y], axis=1).ravel(), [0.0, 0.0])


def refined(slab: Slab, elements_x: int, elements_y: int) -> Slab:
    return slab.model_copy(update={"elements_x": elements_x, "elements_y": elements_y})


def free_frequencies(slab: Slab, m: SlabMatrices, modes: int) -> NDArray[np.float64]:
    """Circular frequencies of the plate in free space [rad/s]."""
    K, M = m.K_plate[:-2, :-2], m.M[:-2, :-2]
    return np.sqrt(np.abs(scipy.linalg.eigvalsh(K, M, subset_by_index=(0, modes - 1))))


@pytest.fixture(scope="module")
def slab_and_mortar() -> tuple[Slab, Mortar]:
    return load_slab("CRTS_III")


@pytest.fixture(scope="module")
def matrices(slab_and_mortar: tuple[Slab, Mortar]) -> SlabMatrices:
    return slab_matrices(*slab_and_mortar)


# Assembly


def test_designs_keep_their_own_bed(slab_and_mortar: tuple[Slab, Mortar]) -> None:
    """Built together or alone, a design is the same to the last bit; voids do not touch the plate."""
    voids = [
        MortarVoid(slab=3, x=(1.0, 2.0), y=(-1.0, 0.5)),
        MortarVoid(slab=8, x=(0.0, 0.6), y=(-1.25, 1.25), factor=0.3),
    ]
    designs, which = slab_designs(*slab_and_mortar, voids)
    assert which == {3: 1, 8: 2}
    for design, alone in zip(designs, [(), voids[:1], voids[1:]], strict=True):
        single = slab_matrices(*slab_and_mortar, alone)
        for name in ("M", "K_plate", "K_bed", "C_bed", "bed_factor", "bed_weight_pressure"):
            np.testing.assert_array_equal(getattr(design, name), getattr(single, name))
    np.testing.assert_array_equal(designs[0].K_plate, designs[2].K_plate)


def test_matrices_are_symmetric_and_not_negative(matrices: SlabMatrices) -> None:
    """Symmetric to the last bit; no negative eigenvalue."""
    for K in (matrices.M, matrices.K_plate, matrices.K_bed, matrices.C_bed):
        np.testing.assert_array_equal(K, K.T)
        eigenvalues = np.linalg.eigvalsh(K)
        assert eigenvalues[0] > -100 * ROUNDING * eigenvalues[-1]  # rounding of 92 x 92 numbers


# Plate


def test_rigid_motions_carry_no_energy(slab_and_mortar: tuple[Slab, Mortar], matrices: SlabMatrices) -> None:
    """w = 1, x, y: no force, and exactly three zero frequencies."""
    slab, _ = slab_and_mortar
    for power in ((0, 0), (1, 0), (0, 1)):
        u = node_field(slab, *power)
        force = matrices.K_plate @ u
        # sums of up to 27 products, of the largest stiffness with the largest DOF
        assert np.abs(force).max() < 27 * ROUNDING * np.abs(matrices.K_plate).max() * np.abs(u).max()
    omega = free_frequencies(slab, matrices, 4)
    assert omega[2] < 1e-4 * omega[3]  # the root of rounding, 1.5e-8, times the span of the spectrum


@pytest.mark.parametrize(("i", "j"), [(2, 0), (0, 2), (1, 1)])
def test_patch_of_constant_curvature(i: int, j: int) -> None:
    """Inner nodes stay free of force; the energy is D/2 times area times the curvatures' form."""
    slab = refined(load_slab("CRTS_III")[0], 5, 4)
    m = slab_matrices(slab, load_slab("CRTS_III")[1])
    u = node_field(slab, i, j)
    force = (m.K_plate @ u)[:-2].reshape(6, 5, 3)
    curvature = {(2, 0): 4.0, (0, 2): 4.0, (1, 1): 2.0 * (1.0 - slab.nu)}[(i, j)]
    energy = 0.5 * slab.rigidity * slab.length * slab.width * curvature
    # 27 products of numbers up to max|K| max|u| are summed
    scale = np.abs(m.K_plate).max() * np.abs(u).max()
    assert np.abs(force[1:-1, 1:-1]).max() < 27 * ROUNDING * scale
    assert 0.5 * u @ m.K_plate @ u == pytest.approx(energy, rel=1e-11)


def test_mass_and_inertia_are_exact(slab_and_mortar: tuple[Slab, Mortar], matrices: SlabMatrices) -> None:
    """m, m (L^2 + h^2)/12 and m (B^2 + h^2)/12: Eq. (10) with rotary inertia is the solid's own inertia."""
    slab, _ = slab_and_mortar
    h = slab.thickness
    expected = {(0, 0): 1.0, (1, 0): (slab.length**2 + h**2) / 12.0, (0, 1): (slab.width**2 + h**2) / 12.0}
    for power, radius in expected.items():
        u = node_field(slab, *power)
        assert u @ matrices.M @ u == pytest.approx(slab.mass * radius, rel=1e-12)  # rounding of 4000 terms
    assert matrices.M[-2, -2] == pytest.approx(slab.mass, rel=1e-12)
    assert matrices.M[-1, -1] == pytest.approx(slab.mass * (slab.length**2 + slab.width**2) / 12.0, rel=1e-12)


def test_ritz_reference_has_leissa_frequencies() -> None:
    """Free square plate, nu = 0.3: omega a^2 sqrt(rho h / D) = 13.47, 19.60, 24.27, 34.80, 34.80 (Leissa)."""
    found = frequencies(1.0, 1.0, 1.0, 0.3, 1.0, 0.0, 14)[3:8]
    np.testing.assert_allclose(found, [13.47, 19.60, 24.27, 34.80, 34.80], atol=0.005)  # printed digits


def test_square_plate_converges_as_h_squared() -> None:
    """Error of the first three frequencies: order h^2; thickness a/1000, so rotary inertia is below 1e-6."""
    square = Slab(
        length=1.0,
        width=1.0,
        thickness=1e-3,
        gap=0.0,
        fastening_pitch=0.5,
        fastenings=2,
        E=3e10,
        nu=0.3,
        rho=2500.0,
        seat_half_spacing=0.3,
    )
    exact = frequencies(1.0, 1.0, 1.0, 0.3, 1.0, 0.0, 16)[3:8]
    errors = []
    for n in (8, 16):
        slab = refined(square, n, n)
        m = slab_matrices(slab, load_slab("CRTS_III")[1])
        omega = free_frequencies(slab, m, 8)[3:]
        errors.append(omega * np.sqrt(slab.rho * slab.thickness / slab.rigidity) / exact - 1.0)
    order = np.log2(errors[0][:3] / errors[1][:3])
    # next term of the series: h^4, and at 8 x 8 it is not yet small
    assert np.all(order > 1.75), order
    assert np.all(order < 2.05), order
    # (1/16)^2 times a constant of 0.15; modes 4 and 5 change the error's sign between the meshes
    assert np.all(np.abs(errors[1]) < 0.15 / 16**2), errors[1]


def test_slab_frequencies_converge_to_ritz(slab_and_mortar: tuple[Slab, Mortar]) -> None:
    """CRTS III, six elastic modes (25 to 129 Hz) with rotary inertia: 9 x 2, 18 x 4 and 36 x 8 elements."""
    slab, mortar = slab_and_mortar
    rotary = slab.rho * slab.thickness**3 / 12.0
    per_area = slab.rho * slab.thickness
    exact = frequencies(slab.length, slab.width, slab.rigidity, slab.nu, per_area, rotary, 14)[3:9]
    assert exact[0] / (2 * np.pi) == pytest.approx(25.0, abs=0.5)  # printed 25 Hz for this slab
    errors = []
    for factor in (1, 2, 4):
        fine = refined(slab, 9 * factor, 2 * factor)
        errors.append(free_frequencies(fine, slab_matrices(fine, mortar), 9)[3:] / exact - 1.0)
    # the largest error falls as h^2 from the second mesh on; two elements across are not in that range yet
    largest = np.abs(errors).max(axis=1)
    assert np.log2(largest[1] / largest[2]) == pytest.approx(2.0, abs=0.3)
    # default mesh: h = 1.25 m across, where a transverse half wave of mode 6 spans 1.9 m; others (h k)^2/100
    assert np.all(np.abs(errors[0][:5]) < 0.006), errors[0]
    assert abs(errors[0][5]) < 0.015, errors[0]


# Plate on its bed


def test_bounce_on_the_bed_is_exact(matrices: SlabMatrices, slab_and_mortar: tuple[Slab, Mortar]) -> None:
    """w = 1 is an eigenvector with omega^2 = k / rho h: 252 Hz printed for 1.25e9 N/m^3."""
    slab, mortar = slab_and_mortar
    u = node_field(slab, 0, 0)
    omega2 = mortar.stiffness / (slab.rho * slab.thickness)
    residual = (matrices.K_plate + matrices.K_bed - omega2 * matrices.M) @ u
    assert np.abs(residual).max() < 100 * ROUNDING * np.abs(matrices.K_plate).max()  # cancelling plate forces
    assert np.sqrt(omega2) / (2 * np.pi) == pytest.approx(252.0, abs=0.5)  # printed digits


def test_uniform_pressure_sinks_the_slab_by_p_over_k(
    slab_and_mortar: tuple[Slab, Mortar], matrices: SlabMatrices
) -> None:
    """Static deflection p/k at every node, no slopes."""
    slab, mortar = slab_and_mortar
    element_load = 1000.0 * (matrices.bed_weight @ matrices.bed_shape)
    index = matrices.bed_index
    load = np.bincount(index.ravel(), np.tile(element_load, len(index)), minlength=matrices.n)
    w = np.linalg.solve(matrices.K_plate + matrices.K_bed, load)
    exact = 1000.0 / mortar.stiffness * node_field(slab, 0, 0)
    # rounding times the condition number of the plate on its bed, 336 (the lateral DOFs stand apart)
    np.testing.assert_allclose(w, exact, atol=1e3 * ROUNDING * exact.max())


def test_lateral_bed(slab_and_mortar: tuple[Slab, Mortar], matrices: SlabMatrices) -> None:
    """k A and k A L^2/12 on lateral displacement and yaw, uncoupled; the plate does not feel them."""
    slab, mortar = slab_and_mortar
    area = slab.length * slab.width
    for K, k in ((matrices.K_bed, mortar.lateral_stiffness), (matrices.C_bed, mortar.lateral_damping)):
        exact = k * area * np.diag([1.0, slab.length**2 / 12.0])
        np.testing.assert_allclose(K[-2:, -2:], exact, atol=300 * ROUNDING * exact.max())  # 288 terms
        assert not K[:-2, -2:].any()


def test_void_takes_its_share_of_the_bed(slab_and_mortar: tuple[Slab, Mortar], matrices: SlabMatrices) -> None:
    """Total stiffness and damping fall by (1 - factor) k A_void, edges anywhere, laterally as well."""
    slab, mortar = slab_and_mortar
    void = MortarVoid(slab=0, x=(0.123, 2.71), y=(-1.11, 0.4567), factor=0.2)
    m = slab_matrices(slab, mortar, [void])
    lost = (1.0 - 0.2) * (2.71 - 0.123) * (0.4567 + 1.11)
    u = node_field(slab, 0, 0)
    y = np.eye(m.n)[-2]
    for direction, k, c in (
        (u, mortar.stiffness, mortar.damping),
        (y, mortar.lateral_stiffness, mortar.lateral_damping),
    ):
        missing = direction @ (matrices.K_bed - m.K_bed) @ direction
        assert missing == pytest.approx(k * lost, rel=1e-12)  # rounding of 4000 terms
        missing = direction @ (matrices.C_bed - m.C_bed) @ direction
        assert missing == pytest.approx(c * lost, rel=1e-12)
    # the void is behind the centre: the bed pushes ahead of it, so y and yaw are coupled
    arm = (0.123 + 2.71) / 2.0 - slab.length / 2.0
    cell = slab.length / slab.elements_x * 0.3261  # largest cell; a void's edge inside it moves its centroid
    assert m.K_bed[-2, -1] == pytest.approx(-mortar.lateral_stiffness * lost * arm, rel=cell / abs(arm))


def test_weight_stays_in_balance_over_a_void(slab_and_mortar: tuple[Slab, Mortar]) -> None:
    """The bed carries m g; rho g h everywhere without voids, nothing under a void, more beside it."""
    slab, mortar = slab_and_mortar
    void = MortarVoid(slab=0, x=(2.0, 3.0), y=(-1.25, 1.25))
    m = slab_matrices(slab, mortar, [void])
    carried = np.sum(m.bed_weight * m.bed_weight_pressure)
    assert carried == pytest.approx(slab.mass * GRAVITY, rel=1e-10)  # a solve of condition 1e3
    assert m.bed_weight_pressure[m.bed_factor == 0.0].max() == 0.0
    assert m.bed_weight_pressure.max() > slab.weight_pressure
    intact = slab_matrices(slab, mortar)
    assert np.all(intact.bed_weight_pressure == slab.weight_pressure)


# Seats


def test_seat_rows_reproduce_a_field(slab_and_mortar: tuple[Slab, Mortar], matrices: SlabMatrices) -> None:
    """w and dw/dy at every seat of each cubic; x from the centre, left seat at -0.7465 m."""
    slab, _ = slab_and_mortar
    x = matrices.seat_x[:, None]
    y = slab.seat_half_spacing * np.array([-1.0, 1.0])
    for i, j in CUBICS:
        u = node_field(slab, i, j)
        w = np.sum(matrices.seat_w * u[matrices.seat_index], axis=-1)
        slope = np.sum(matrices.seat_slope * u[matrices.seat_index], axis=-1)
        # twelve products of numbers up to 2.8^3
        np.testing.assert_allclose(w, x**i * y**j, atol=1000 * ROUNDING)
        np.testing.assert_allclose(slope, x**i * j * y ** max(j - 1, 0), atol=4000 * ROUNDING)


@pytest.mark.parametrize("name", slab_names())
def test_seats_are_uniform_across_joints(name: str) -> None:
    """Seat j stands at (j + 1/2) d from the middle of the joint; the spacing goes on over the next slab."""
    slab, mortar = load_slab(name)
    m = slab_matrices(slab, mortar)
    two_slabs = np.concatenate([m.seat_x, m.seat_x + slab.pitch])
    np.testing.assert_allclose(np.diff(two_slabs), slab.fastening_pitch, atol=2e-6)  # the rule's own 1e-6 m
    assert np.abs(m.seat_x).max() < slab.length / 2
    assert m.seat_x[0] + slab.pitch / 2 == pytest.approx(slab.fastening_pitch / 2, rel=1e-12)  # rounding


# Library and errors


def test_library_slabs() -> None:
    """Published masses: 7000 kg for CRTS III of 0.2 m, 8224 kg for CRTS II; printed pitches."""
    assert set(slab_names()) >= {"CRTS_I", "CRTS_II", "CRTS_III", "Zhai_slab"}
    pitch = {"CRTS_I": 5.032, "CRTS_II": 6.50, "CRTS_III": 5.67, "Zhai_slab": 4.95}
    for name, value in pitch.items():
        slab, mortar = load_slab(name)
        assert slab.pitch == pytest.approx(value, abs=1e-9)  # sums of decimals
        assert slab.source
        assert mortar.lateral_stiffness == 1e8
    assert load_slab("CRTS_III")[0].mass == pytest.approx(7000.0, rel=1e-12)  # rounding
    assert load_slab("CRTS_II")[0].mass == pytest.approx(8224.0, abs=0.5)  # printed digits
    assert load_slab("CRTS_III")[0].rigidity == pytest.approx(2.5e7, rel=1e-12)  # E h^3 / 12 (1 - 0.04)


def test_unknown_slab_names_the_nearest() -> None:
    with pytest.raises(InputError, match=r"slabs = 'crts_3': no such preset; did you mean 'CRTS_I"):
        load_slab("crts_3")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length": -1.0}, r"test\.length = -1\.0: must be greater than 0"),
        ({"thickness": 0.3}, r"test\.thickness = 0\.3: .*thin plate, 0\.25 m"),
        (
            {"fastenings": 8},
            r"test\.fastenings = 8: .*5\.040000 m; it must equal length \+ gap = 5\.670000 m",
        ),
        ({"seat_half_spacing": 1.3}, r"test\.seat_half_spacing = 1\.3: .*1\.25 m"),
        ({"width": 1.45, "thickness": 0.1}, r"test\.seat_half_spacing = 0\.7465: .*0\.725 m"),
        ({"elements_y": 0}, r"test\.elements_y = 0: "),
        ({"elements_z": 2}, r"test\.elements_z: unknown key; did you mean 'elements_"),
        (
            {"length": 0.1, "gap": 0.7, "fastening_pitch": 0.4, "fastenings": 2, "thickness": 0.01},
            "on the slab",
        ),
    ],
)
def test_bad_slabs_are_refused(change: dict[str, float], message: str) -> None:
    slab = load_slab("CRTS_III")[0]
    table = {**slab.model_dump(exclude={"seat_half_spacing"}), **change}
    with pytest.raises(InputError, match=message):
        build(Slab, table, "test")


def test_slab_file_without_mortar(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("length = 5.6\n")
    with pytest.raises(InputError, match=r"mine\.mortar: missing"):
        load_slab(str(path))


def test_voids_of_several_slabs_are_no_single_design(slab_and_mortar: tuple[Slab, Mortar]) -> None:
    voids = [MortarVoid(slab=i, x=(0.0, 1.0), y=(0.0, 1.0)) for i in (0, 1)]
    with pytest.raises(InputError, match="mortar void on slab 1: every void must be on slab 0"):
        slab_matrices(*slab_and_mortar, voids)
