"""Trains: symmetry, energy, loads, braking, several vehicles, series springs."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import find_preset
from tiengine.vehicle.train import assemble, static_wheel_loads, train_centres
from tiengine.vehicle.vehicle import load_vehicle

from ..reference.vehicles import NAMES, changed, free_of_wheelsets, rigid_motion, tiny_vehicle

ROUNDING = np.finfo(float).eps

WHEEL_LOADS = {"CRH380A_v2": 68.7, "CRH380A_v6": 65.0, "Zhai_coach": 55.9, "CRH2": 61.7, "Manchester": 54.5}
"""Static wheel loads [kN] as printed."""


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("series", [False, True])
def test_symmetry(name, series):
    """M, C, K are symmetric, unchanged by mirroring y and by swapping front and rear; C_speed turns."""
    train = assemble([load_vehicle(name)], series_springs=series)
    n = train.n_dof
    mirror = np.tile([-1.0, 1.0, -1.0, 1.0, -1.0], 7)
    swap = np.concatenate([5 * body + np.arange(5) for body in (0, 2, 1, 6, 5, 4, 3)])
    turn = np.tile([1.0, 1.0, 1.0, -1.0, -1.0], 7)
    inside = np.arange(n, train.n)
    for matrix, reverse in ((train.M, 1), (train.C, 1), (train.K, 1), (train.C_speed, -1)):
        # series springs: compare what the bodies feel of them at very slow motion
        body = matrix[:n, :n]
        if matrix is train.K and len(inside):
            hidden = matrix[np.ix_(inside, inside)]
            body = body - matrix[:n, inside] @ np.linalg.solve(hidden, matrix[inside, :n])
        tolerance = 10.0 * ROUNDING * max(np.abs(matrix).max(), 1.0)  # sums of 16 terms in another order
        assert np.abs(matrix - reverse * matrix.T).max() <= tolerance
        assert np.abs(mirror[:, None] * body * mirror - body).max() <= tolerance
        turned = (turn[:, None] * body * turn)[np.ix_(swap, swap)]
        assert np.abs(turned - reverse * body).max() <= tolerance


def test_energy_is_constant_without_dampers():
    """Springs and gyroscopic pairs at 100 m/s over 2 s, advanced exactly by the matrix exponential."""
    train = assemble([load_vehicle("CRH380A_v2")])
    V, n = 100.0, train.n
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -np.linalg.solve(train.M, train.K)
    A[n:, n:] = -np.linalg.solve(train.M, V * train.C_speed)
    rng = np.random.default_rng(1)
    x = np.concatenate([1e-3 * rng.standard_normal(n), 0.1 * rng.standard_normal(n)])

    def energy(x: NDArray[np.float64]) -> float:
        return 0.5 * float(x[n:] @ train.M @ x[n:] + x[:n] @ train.K @ x[:n])

    # expm of norm 1e5 squares 17 times: rounding 2^17 eps = 3e-11, times the spread of scales in x
    assert energy(expm(2.0 * A) @ x) == pytest.approx(energy(x), rel=1e-8)
    v = rng.standard_normal(n)
    assert v @ train.C_speed @ v == pytest.approx(0.0, abs=n * ROUNDING * np.abs(train.C_speed).max())


def test_gyroscopic_sign_and_size():
    """Conserved angular momentum: rolling at a rate, the axle yaws by Jz yaw'' = (J V / r0) roll'."""
    train = assemble([load_vehicle("CRH380A_v2")])
    _, _, roll, _, yaw = train.wheelset_dof[0]
    V, roll_rate = 80.0, 0.01
    yaw_moment = -V * train.C_speed[yaw, roll] * roll_rate
    assert yaw_moment == pytest.approx(123.0 * V / 0.43 * roll_rate, rel=4 * ROUNDING)
    assert np.count_nonzero(train.C_speed) == 8


@pytest.mark.parametrize("name", NAMES)
def test_static_wheel_loads(name):
    """The published loads within half a unit of their last digit; together the weight."""
    vehicle = load_vehicle(name)
    loads = static_wheel_loads(assemble([vehicle]))
    assert loads == pytest.approx(np.full((4, 2), 1e3 * WHEEL_LOADS[name]), abs=50.5)
    assert loads.sum() == pytest.approx(vehicle.mass * 9.81, rel=1e-12)  # rounding of the static solution


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("series", [False, True])
def test_damping_never_feeds_power(name, series):
    """C has no negative eigenvalue beyond rounding."""
    train = assemble([load_vehicle(name)], series_springs=series)
    eigenvalues = np.linalg.eigvalsh(train.C)
    assert eigenvalues.min() >= -35 * ROUNDING * eigenvalues.max()


@pytest.mark.parametrize("effort", ["axles", "wheels"])
@pytest.mark.parametrize("name", ["CRH380A_v2", "Zhai_coach", "CRH2", "Manchester"])
def test_braking_moves_load_to_the_front(name, effort):
    """Equilibrium of moments about the axles, or about the rail with the effort at the wheels' rims.

    The load that the front wheels gain times their arms is -Vdot sum m h, h from the axle or from the rail,
    and with the rims -Vdot sum J/r0 besides. Longitudinal springs are softened a thousandfold: without a
    longitudinal coordinate they hold the pitch of car and frames (by up to 5 %), which is not equilibrium.
    """
    soft = {key: {"kx": 1e-3 * load_toml(find_preset("vehicles", name))[key]["kx"]} for key in ("primary", "secondary")}
    vehicle = changed(name, **soft)
    train = assemble([vehicle], effort=effort)
    level = vehicle.wheel_radius if effort == "axles" else 0.0
    moment = sum(body.mass * (body.height - level) for body in vehicle.body)
    if effort == "wheels":
        moment += (train.wheelset_spin_inertia / train.wheel_radius).sum()
    transfer = static_wheel_loads(train, speed_rate=-1.0) - static_wheel_loads(train)
    # what is left of the springs' hold is a thousandth of 5 %
    assert transfer.sum(axis=1) @ train.wheelset_x == pytest.approx(moment, rel=2e-4)
    assert transfer.sum() == pytest.approx(0.0, abs=1e-6 * transfer.max())  # the solution's rounding
    assert (transfer[0] > 0.0).all()


@pytest.mark.parametrize("effort", ["axles", "wheels"])
@pytest.mark.parametrize("name", ["CRH380A_v2", "Zhai_coach", "CRH2", "Manchester"])
def test_push_of_the_longitudinal_inertia_leaves_no_moment_over(name, effort):
    """Its work on a pitch of the whole vehicle is that of m Vdot at the bodies' heights."""
    vehicle = load_vehicle(name)
    train = assemble([vehicle], effort=effort)
    r0 = vehicle.wheel_radius
    work = sum(body.mass * (body.height - r0) for body in vehicle.body)
    if effort == "wheels":
        work += vehicle.mass * r0 + (train.wheelset_spin_inertia / r0).sum()
    # least squares over springs of stiffness up to 400 times apart
    assert train.acceleration_force @ rigid_motion(vehicle, pitch=1.0) == pytest.approx(work, rel=1e-10)


def test_braking_pitches_the_car_nose_down():
    """Right-handed pitch lifts the nose, so braking makes it negative; frames follow."""
    train = assemble([load_vehicle("CRH380A_v2")])
    free = free_of_wheelsets(train)
    u = np.zeros(train.n)
    u[free] = np.linalg.solve(train.K[np.ix_(free, free)], -train.acceleration_force[free])
    assert u[train.dof("car", "pitch")] < 0.0
    assert u[train.dof("frame 1", "pitch")] < 0.0
    assert u[train.dof("frame 1", "z")] > 0.0 > u[train.dof("frame 2", "z")]  # front bogie is pressed down


def test_spin_inertia_keeps_the_absolute_spin():
    """With no moment about the axle the spin -V/r0 + pitch' stays constant: pitch'' = Vdot/r0."""
    train = assemble([load_vehicle("CRH380A_v2")], effort="axles")
    spin = train.wheelset_dof[:, 3]
    pitch = train.acceleration_force[spin] / train.wheelset_spin_inertia
    assert pitch == pytest.approx(1.0 / 0.43, rel=4 * ROUNDING)


def test_effort_at_the_wheels_is_newtons_law():
    """Creep forces m_s Vdot at the rims hold the wheelsets' spin rate at Vdot/r0: pitch'' = 0."""
    vehicle = load_vehicle("Zhai_coach")
    train = assemble([vehicle], effort="wheels")
    share = vehicle.mass / 4.0
    moment = train.acceleration_force[train.wheelset_dof[:, 3]] + share * vehicle.wheel_radius
    assert moment == pytest.approx(np.zeros(4), abs=1e-12 * share)
    # the torques of two wheelsets have their reaction on the frame between them
    reaction = train.acceleration_force - assemble([vehicle], effort="axles").acceleration_force
    torque = share * vehicle.wheel_radius + 140.0 / vehicle.wheel_radius
    frames = [train.dof(f"frame {i}", "pitch") for i in (1, 2)]
    assert reaction[frames] == pytest.approx([2.0 * torque] * 2, rel=1e-12)
    assert reaction.sum() == pytest.approx(0.0, abs=1e-9 * torque)


def test_trains_are_block_diagonal():
    """Two vehicles: their own matrices, names and positions; wheelsets are numbered through."""
    vehicles = [load_vehicle("CRH380A_v6"), load_vehicle("Zhai_coach")]
    train = assemble(vehicles, series_springs=False)
    one, two = (assemble([vehicle], series_springs=False) for vehicle in vehicles)
    for key in ("M", "C", "K", "C_speed"):
        assert np.array_equal(getattr(train, key), block_diag(getattr(one, key), getattr(two, key)))
    for key in ("gravity", "acceleration_force", "wheel_radius", "half_spacing", "element_linear"):
        both = np.concatenate([getattr(one, key), getattr(two, key)])
        assert getattr(train, key) == pytest.approx(both, rel=1e-12, abs=1e-6)  # one least-squares solution
    assert train.body_names[6:10] == ("wheelset 4", "v2 car", "v2 frame 1", "v2 frame 2")
    assert train.body_names[10] == "wheelset 5"
    assert len(set(train.body_names)) == 14
    assert train.wheelset_x == pytest.approx(np.append(one.wheelset_x, two.wheelset_x - 25.788), abs=1e-12)
    assert train.wheelset_vehicle.tolist() == [0] * 4 + [1] * 4
    assert train.element_index[len(one.element_kind) :].max() >= 35


def test_coupled_centres():
    """Half of both lengths between neighbours."""
    vehicles = [load_vehicle("CRH380A_v2"), load_vehicle("Manchester"), load_vehicle("CRH2")]
    assert train_centres(vehicles) == pytest.approx([0.0, -25.7, -51.4], abs=1e-12)


def test_series_springs_add_states_at_the_end():
    """CRH380A v6 has 8 + 4 + 4 dampers with end stiffness, as its source: 51 equations."""
    train = assemble([load_vehicle("CRH380A_v6")] * 2, series_springs=True)
    assert (train.n_dof, train.n) == (70, 70 + 2 * 16)
    assert not train.M[70:].any()
    assert (np.diag(train.C)[70:] > 0.0).all()
    slow = assemble([load_vehicle("CRH380A_v6")], series_springs=False)
    inner = np.linalg.solve(train.K[70:, 70:], train.K[70:, :70])
    # the springs carry nothing at rest
    rest = train.K[:70, :70] - train.K[:70, 70:] @ inner
    assert np.abs(rest[:35, :35] - slow.K).max() <= 100 * ROUNDING * np.abs(train.K).max()
    assert train.acceleration_force[:35] == pytest.approx(slow.acceleration_force, rel=1e-12, abs=1e-6)


@pytest.mark.parametrize("frequency", [0.1, 3.0, 100.0])
def test_series_spring_has_the_maxwell_stiffness(frequency):
    """k i w c / (k + i w c), closed form of a spring in series with a damper."""
    k, c = 2.0e5, 7.0e3
    damper = {"direction": "z", "v": [0.0], "c": [c], "k_series": k}
    vehicle = tiny_vehicle(spring=[{"kx": 1.0}], damper=[damper])
    train = assemble([vehicle], series_springs=True)
    w = 2.0 * np.pi * frequency
    dynamic = -(w**2) * train.M + 1j * w * train.C + train.K
    seen = dynamic[1, 1] - dynamic[1, 10] * dynamic[10, 1] / dynamic[10, 10]
    exact = -(w**2) * 1000.0 + k * 1j * w * c / (k + 1j * w * c)
    assert seen == pytest.approx(exact, rel=1e-13)  # a dozen operations
    assert len(train.element_kind) == 0  # a straight line needs no element


def test_bad_trains_are_refused():
    """Centres that do not fall, no vehicle, an unknown effort."""
    vehicle = load_vehicle("CRH2")
    with pytest.raises(InputError, match=r"train\.centres = \[0\.0, 25\.0\]: must fall"):
        assemble([vehicle, vehicle], np.array([0.0, 25.0]))
    with pytest.raises(InputError, match=r"train\.centres = \[0\.0\]: expected 2 finite numbers"):
        assemble([vehicle, vehicle], np.zeros(1))
    with pytest.raises(InputError, match="a train needs a vehicle"):
        assemble([])
    with pytest.raises(InputError, match=r"train\.effort = 'rail': must be"):
        assemble([vehicle], effort="rail")  # type: ignore[arg-type]
