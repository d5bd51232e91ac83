"""Seats that press on a rectangle: means over it, whatever the mesh; what does not fit is refused."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.track.baseplate import seat_rows
from tiengine.track.plate_shapes import WY, W, shapes_at
from tiengine.track.slab import Slab, load_slab
from tiengine.track.slab_matrices import slab_matrices

PLATE = (0.36, 0.18)
X, Y = np.array([-2.52, 0.0, 0.63]), np.array([-0.7465, 0.7465, -0.7465])


@pytest.fixture
def slab() -> Slab:
    return load_slab("CRTS_III")[0]


def _field(slab: Slab, i: int, j: int) -> np.ndarray:
    """Plate coordinates of w = x^i y^j."""
    x = np.repeat(np.linspace(-slab.length / 2, slab.length / 2, slab.elements_x + 1), slab.elements_y + 1)
    y = np.tile(np.linspace(-slab.width / 2, slab.width / 2, slab.elements_y + 1), slab.elements_x + 1)
    slopes = (i * x ** max(i - 1, 0) * y**j, j * x**i * y ** max(j - 1, 0))
    return np.stack([x**i * y**j, *slopes], axis=1).ravel()


@pytest.mark.parametrize("mesh", [(9, 2), (18, 4), (13, 7)])
@pytest.mark.parametrize("rectangle", [PLATE, (0.9, 0.6)])
def test_means_of_polynomials(slab, mesh, rectangle):
    """Mean of x^i y^j = (x^i + i (i-1)/2 x^(i-2) L^2/12)(...); slope: 12/B^2 times the mean of (y - y0) w; rounding."""
    slab = slab.model_copy(update=dict(zip(("elements_x", "elements_y"), mesh, strict=True)))
    index, w, slope = seat_rows(slab, X, Y, rectangle)
    L, B = rectangle
    mean = [lambda x, a: x**0, lambda x, a: x, lambda x, a: x**2 + a**2 / 12, lambda x, a: x**3 + x * a**2 / 4]
    turn = [0.0 * Y, 1.0 + 0.0 * Y, 2.0 * Y, 3.0 * Y**2 + 3.0 / 20.0 * B**2]
    for i, j in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3)):
        u = _field(slab, i, j)
        np.testing.assert_allclose(np.sum(w * u[index], axis=1), mean[i](X, L) * mean[j](Y, B), atol=1e-12)
        np.testing.assert_allclose(np.sum(slope * u[index], axis=1), mean[i](X, L) * turn[j], atol=1e-11)


def test_a_small_rectangle_is_a_point(slab):
    """A rectangle of 2 x 2 mm and a point differ by its square over the element's."""
    index, w, slope = seat_rows(slab, X, Y, (2e-3, 2e-3))
    at, table = shapes_at(slab, X, Y)
    for k in range(len(X)):
        dense = np.zeros((4, slab.plate_dofs))
        dense[0, index[k]], dense[1, index[k]] = w[k], slope[k]
        dense[2, at[k]], dense[3, at[k]] = table[k, W], table[k, WY]
        np.testing.assert_allclose(dense[:2], dense[2:], atol=1e-4)


def test_seats_of_the_step_lie_within_an_element():
    """A baseplate over two elements would widen the slabs' band: the library's meshes have one element a seat."""
    for name in ("CRTS_I", "CRTS_II", "CRTS_III", "Zhai_slab"):
        slab, mortar = load_slab(name)
        assert slab_matrices(slab, mortar, (), PLATE).seat_index.shape == (slab.fastenings, 2, 12), name


@pytest.mark.parametrize(
    ("fastening", "said"),
    [
        ("baseplate_length=0.6", "track.fastening.baseplate_length = 0.6: must be at most 0.56 m"),
        ("baseplate_width=1.01", "baseplate_width = 1.01: must be less than or equal to 1"),
        ("baseplate_width=0.0", "baseplate_width = 0.0: must be 0 if baseplate_length is"),
        ("baseplate_length=0.0", "baseplate_width = 0.18: must be 0 if baseplate_length is"),
    ],
)
def test_what_does_not_fit_is_refused(fastening, said):
    with pytest.raises(InputError) as caught:
        load_scenario("default", [f"track.fastening={{like='ACE2021', {fastening}}}"])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
