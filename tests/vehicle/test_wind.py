"""Wind: forces by hand, the gust's shape, moments about the centre of gravity, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import build
from tiengine.scenario.scenario import load_scenario
from tiengine.vehicle.force_history import BodyForce, ForceLoads
from tiengine.vehicle.train import assemble
from tiengine.vehicle.vehicle import load_vehicle
from tiengine.vehicle.wind import Aerodynamics, Wind, WindLoads, WindyCar
from tiengine.vehicle.wind_gust import GUST_FACTOR

TRAIN = assemble([load_vehicle("CRH380A_v2")])
SHAPE = Aerodynamics(yaw_angle=(0.0, 30.0, 60.0), side=(0.0, 4.0, 6.0), lift=(0.0, 2.0, 3.0), roll=(0.0, 3.0, 4.0))
CAR = WindyCar(dof=0, x=0.0, length=25.0, height=1.6)
V = 70.0


def forces(wind: Wind, x: float = 0.0, time: float = 0.0) -> np.ndarray:
    """y, z, roll, pitch, yaw on the car body."""
    loads = WindLoads(wind, SHAPE, TRAIN, [CAR])(*(np.array([each]) for each in (time, x, V, 0.0)))
    assert not loads.force[0, :, 5:].any()
    return loads.force[0, 0, :5]


def test_forces_by_hand():
    """An angle of attack of 30 degrees: q A c; the roll moment about the centre of gravity is less by height x side."""
    U = V * np.tan(np.pi / 6.0)
    q = 0.5 * 1.225 * (V**2 + U**2) * 10.0
    wanted = [4.0 * q, -2.0 * q, 3.0 * 3.0 * q - 1.6 * 4.0 * q, 0.0, 0.0]
    np.testing.assert_allclose(forces(Wind(speed=U)), wanted, rtol=1e-12)
    np.testing.assert_allclose(forces(Wind(speed=-U)), np.array(wanted) * [-1, 1, -1, 1, 1], rtol=1e-12)


def test_wind_from_ahead_is_faster():
    """At 60 degrees to the direction of travel half of the wind adds to the speed."""
    y = forces(Wind(speed=20.0, angle=60.0))[0]
    ahead, across = V + 10.0, 20.0 * np.sin(np.pi / 3.0)
    c = SHAPE.coefficients(np.array(np.arctan2(across, ahead)))[0]
    assert y == pytest.approx(0.5 * 1.225 * (ahead**2 + across**2) * 10.0 * c, rel=1e-12)


def test_rows_over_chainage_and_time():
    """Between rows it rises without overshoot, beyond them it holds."""
    rows = ((100.0, 0.0), (200.0, 10.0))
    over_x, over_t = Wind(speed=rows), Wind(speed=rows, over="time")
    x = np.linspace(50.0, 250.0, 101)
    found = over_x.at(x, np.zeros(101), 25.0)
    assert found[0] == 0.0
    assert found[-1] == 10.0
    assert (np.diff(found) >= 0.0).all()
    np.testing.assert_array_equal(over_t.at(np.zeros(101), x, 25.0), found)


def test_the_gust_is_a_hat():
    """Symmetric about its top; 1.6946 times the mean for a car that is short against it, less for a long one."""
    wind = Wind(speed=12.0, gust="en14067", gust_at=100.0)
    x = np.linspace(0.0, 200.0, 401)
    point, car = (wind.at(x, np.zeros(401), length) for length in (1e-3, 25.0))
    assert GUST_FACTOR == pytest.approx(1.6946, abs=1e-4)
    assert point.max() == pytest.approx(12.0 * GUST_FACTOR, rel=1e-4)
    np.testing.assert_allclose(car, car[::-1], rtol=1e-12)
    assert 12.0 * 1.2 < car.max() < point.max()
    assert car[0] == pytest.approx(12.0, rel=1e-3)
    assert point.argmax() == car.argmax() == 200


def test_given_forces(tmp_path):
    """From rows over the chainage of a bogie, and from a file over time."""
    path = tmp_path / "hammer.csv"
    path.write_text("time [s], force [N]\n0.0, 0.0\n0.1, 1000.0\n# end\n0.2, 0.0\n")
    over_time = BodyForce(motion="z", file=str(path), scale=2.0)
    over_x = BodyForce(body="frame 1", motion="y", over="chainage", rows=((100.0, 0.0), (110.0, 50.0)))
    loads = ForceLoads([over_time, over_x], [(0, 0.0), (5, 8.75)], TRAIN)
    found = loads(np.array([0.05, 0.5]), np.array([95.0, 400.0]), np.full(2, V), np.zeros(2)).force[0]
    np.testing.assert_allclose(found[:, 1], [1000.0, 0.0])
    np.testing.assert_allclose(found[:, 5], [5.0 * 3.75, 50.0])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"wind.gust": "en14067"}, ("wind.gust", "gust_at")),
        ({"wind.angle": 30.0}, ("wind.speed", "missing")),
        ({"wind.speed": 500.0}, ("wind.speed = 500", "less than or equal to 100")),
        ({"wind.speed": [[0.0, 1.0], [0.0, 2.0]]}, ("wind.speed", "rising")),
        ({"wind.speed": 10.0, "wind.vehicles": [2]}, ("wind.vehicles = 2", "from 1 to 1")),
        ({"wind.speed": 10.0, "wind.aerodynamics": "EMU_led"}, ("wind.aerodynamics = 'EMU_led'", "'EMU_lead'")),
        ({"train.forces": [{"motion": "z"}]}, ("train.forces.rows", "file")),
        ({"train.forces": [{"motion": "x", "rows": [[0.0, 1.0], [1.0, 1.0]]}]}, ("forces[0].motion = 'x'",)),
        (
            {"train.forces": [{"motion": "y", "body": "roof", "rows": [[0.0, 1.0], [1.0, 1.0]]}]},
            ("forces[0].body = 'roof'", "no such body"),
        ),
        ({"train.forces": [{"motion": "y", "rows": [[1.0, 1.0], [0.0, 1.0]]}]}, ("train.forces.rows", "larger")),
    ],
)
def test_refused(changes, words):
    """One line with key, value and rule."""
    with pytest.raises(InputError) as caught:
        load_scenario("smooth", changes)
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_coefficients_that_are_refused():
    """Their number, and angles that do not rise from zero."""
    for change in ({"lift": (1.0, 2.0)}, {"yaw_angle": (10.0, 20.0, 30.0)}):
        with pytest.raises(InputError, match="must"):
            build(Aerodynamics, {"yaw_angle": (0.0, 30.0, 60.0), "side": (0.0, 4.0, 6.0)} | change)
