"""The full-length model: its parts against the engine's, and its forces against the moving window's."""

from functools import cache

import numpy as np
import pytest

from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.track.mortar import MortarVoid
from tiengine.track.slab import load_slab
from tiengine.track.slab_matrices import slab_matrices
from validation.msm.plate import _Mesh, _plate, modal_slab
from validation.msm.seats import SeatTransform
from validation.msm.simulate import FullLength, run_full_length

SHORT = (
    "train.distance=15",
    "train.start=30",
    "numerics.time_step=1e-4",
    "numerics.modes_per_metre=2",
    "irregularity.taper=10",
    'output.precision="double"',
)
ALL = 200  # more plate modes than the mesh has


@pytest.mark.parametrize("modes", [5, 9, 13, 14, 33])
def test_seat_sums_are_those_of_the_sines(modes):
    """Modes below, at and beyond the number of seats; tolerance: rounding of sums of up to 33 terms of order one."""
    seats = 7
    transform = SeatTransform.of(seats, modes)
    sines = np.sin(np.outer(np.arange(1, modes + 1), np.pi * (np.arange(seats) + 0.5) / seats))
    a = np.random.default_rng(1).standard_normal((6, modes))
    f = np.random.default_rng(2).standard_normal((6, seats))
    folded = np.zeros((6, seats))
    np.add.at(folded.T, transform.target, (a * transform.sign).T)
    assert np.allclose(transform.to_seats(folded), a @ sines, rtol=0.0, atol=1e-12)
    assert np.allclose(transform.from_seats(f)[:, transform.target] * transform.sign, f @ sines.T, rtol=0.0, atol=1e-12)


def test_plate_is_the_engines_plate_assembled_apart():
    """Both codes have the same element, from monomials and from shape functions; tolerance: rounding of K's spread."""
    slab, mortar = load_slab("CRTS_III")
    ours = slab_matrices(slab, mortar)
    mesh = _Mesh(slab.elements_x, slab.elements_y, slab.length / 18, slab.width / 4)
    K, M, bed = _plate(slab, mesh, [])
    for mine, engine in ((K, ours.K_plate), (M, ours.M), (mortar.stiffness * bed, ours.K_bed)):
        engine = engine[:-2, :-2]
        assert np.abs(mine - engine).max() < 1e-11 * np.abs(engine).max()


@pytest.mark.parametrize("baseplate", [(0.0, 0.0), (0.36, 0.18), (0.5, 0.9)])
def test_seats_feel_a_slab_on_all_its_modes_as_on_its_mesh(baseplate):
    """Compliance of the bedded slab between its seats, on points, on a rectangle within an element, and on one that
    spans two across; 1e-8: eigenvectors of a problem with a spread of 1e8.
    """
    slab, mortar = load_slab("CRTS_III")
    slab = slab.model_copy(update={"elements_y": 3})
    element = slab.length / slab.elements_x  # a void of whole elements: the engine's Gauss cells blur other edges
    void = MortarVoid(slab=0, x=(3 * element, 5 * element), y=(-slab.width / 2, slab.width / 2))
    mesh, modal = slab_matrices(slab, mortar, [void], baseplate), modal_slab(slab, mortar, [void], ALL, baseplate)
    m = len(modal.omega)
    for side in range(2):
        rows, turn = np.zeros((2, slab.fastenings, mesh.n))
        for j in range(slab.fastenings):
            rows[j, mesh.seat_index[j, side]] = mesh.seat_w[j, side]
            turn[j, mesh.seat_index[j, side]] = mesh.seat_slope[j, side]
        K = mesh.K_plate + mesh.K_bed
        for engine_rows, seat in ((rows, modal.seat[0, side]), (turn, modal.seat[1, side])):
            engine = engine_rows @ np.linalg.solve(K, engine_rows.T)
            ours = seat.T @ np.linalg.solve(modal.stiffness[:m, :m], seat)
            assert np.allclose(ours, engine, rtol=0.0, atol=1e-8 * engine.max())


@cache
def _full(*overrides: str):
    with run_full_length(load_scenario("paper", [*SHORT, *overrides]), FullLength(60.0, 2.0, ALL, 1e-4)) as result:
        return result.wheel()


@cache
def _window(*overrides: str):
    with run(load_scenario("paper", [*SHORT, *overrides])) as result:
        return result.wheel()


@pytest.mark.parametrize("direction", ["vertical_force", "lateral_force"])
def test_window_and_full_length_agree(direction):
    """Forces agree within 0.2 % of the peak, the effect of the window's ends, at the same modes per metre (MODEL 9).

    No wheel lifts off in these 15 m: at an impact the step errors of both programs would dominate.
    """
    full, window = _full()[direction], _window()[direction]
    assert len(full) == len(window) > 1400
    assert np.ptp(full) > 0.1 * full.max()
    assert np.abs(full - window).max() < 2e-3 * np.abs(full).max()


def test_failed_fastenings_and_a_void_act_alike():
    """They agree likewise over three failed fastenings and four elements without mortar, on a smooth track."""
    defects = (
        "irregularity.spectrum='none'",
        'track.failed_fastenings=[{rail="left", seats=[62, 64], factor=0.0}]',
        f"track.mortar_voids=[{{slab=8, x=[0.0, {4 * 5.6 / 9}], y=[-1.25, 1.25], factor=0.0}}]",
    )
    full, window = (x["vertical_force"] for x in (_full(*defects), _window(*defects)))
    peak = np.abs(full).max()
    assert np.abs(full - window).max() < 2e-3 * peak
    assert np.ptp(full) > peak / 3.0  # the defects have an effect


@pytest.mark.slow
def test_two_patches_act_alike():
    """Normal forces of both patches, to 1 % of the peak: a share is more sensitive than the sum (190 N per um).

    S1002 on 60E1, the gauge narrowed by as much as the tape circles are closer together than in its own track: wheels
    run about the jump of the contact on the tread, where both slots of the table carry.
    """
    words = (
        "contact.patches=2", "train.wheel_profile=S1002", "track.rail_profile=60E1", "track.gauge=1.428",
        "track.gauge_depth=0.014",
    )  # fmt: skip
    scenario = load_scenario("paper", [*SHORT, *words])
    with run_full_length(scenario, FullLength(60.0, 2.0, ALL, 1e-4)) as full, run(scenario) as window:
        N, other = (each.patch()["normal_force"] for each in (full, window))
    assert (N > 1e3).all(axis=-1).any()
    assert np.abs(N - other).max() < 1e-2 * N.max()


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("train.speed_kmh=[[0.0, 300.0], [500.0, 280.0]]", "train.speed_kmh"),
        ('numerics.start="zero"', "numerics.start"),
        ("track.mortar_no_tension=true", "mortar_no_tension"),
    ],
)
def test_what_the_full_length_model_has_not_is_refused(override, said):
    with pytest.raises(InputError, match=said):
        run_full_length(load_scenario("paper", [*SHORT, override]), FullLength(60.0))


def test_displaced_ground_is_refused():
    ground = "track.ground=[{kind='cosine', at=40, length=10, depth=0.01}]"
    with pytest.raises(InputError, match=r"track\.ground: must be left out in the full-length model"):
        run_full_length(load_scenario("default", [ground]), FullLength(60.0))


@pytest.mark.slow
def test_wheels_and_rails_that_differ_act_alike():
    """Radii, profiles and rails of their own in both models: 1 % of the peak, as for rails that are alike."""
    words = (
        "train.wheel_profiles=[{wheelsets=[1], side='right', radius_difference=-3e-4},"
        " {wheelsets=[3], profile='S1002'}]",
        "track.rail_profile_left='60E1'",
    )
    for name in ("vertical_force", "lateral_force"):
        full, window, alike = (x[name] for x in (_full(*words), _window(*words), _window()))
        assert np.abs(full - window).max() < 1e-2 * np.abs(full).max()
        assert np.abs(window - alike).max() > 1e-2 * np.abs(full).max()
