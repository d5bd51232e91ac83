"""Slabs warped by a temperature gradient: closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine import backend
from tiengine.scenario.scenario import load_scenario
from tiengine.track.mortar import Mortar
from tiengine.track.plate_shapes import WXX, WYY, element_dofs, tabulate_shapes
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import slab_matrices
from tiengine.track.slab_moments import nodes
from tiengine.track.slab_warp import SlabWarp, curvature_of
from tiengine.track.warp_load import warp_load

CURVATURE = 90.0 * 1e-5  # 1/m


@pytest.fixture(scope="module")
def slab() -> tuple[Slab, Mortar]:
    """The slab of MODEL section 14: 5.6 x 2.5 x 0.2 m of E 36 GPa, nu 0.2."""
    backend.start()
    parts = load_scenario("default").parts
    slab = parts.slab.model_copy(update={"E": 36e9, "nu": 0.2})
    assert (slab.length, slab.width, slab.thickness) == (5.6, 2.5, 0.2)
    return slab, parts.mortar


def test_a_free_slab_bends_to_a_bowl(slab: tuple[Slab, Mortar]) -> None:
    """Corner against centre alpha T' (x^2 + y^2)/2 = 4.23 mm, all over the bowl: the element has all quadratics."""
    K = slab_matrices(*slab).K_plate[:-2, :-2]
    w = np.linalg.lstsq(K, CURVATURE * warp_load(slab[0]), rcond=1e-12)[0]
    x, y = nodes(slab[0])
    bowl = 0.5 * CURVATURE * (x**2 + y**2)
    rigid = np.column_stack([np.ones_like(x), x, y])
    left = w[::3] - bowl
    left -= rigid @ np.linalg.lstsq(rigid, left, rcond=None)[0]
    assert np.abs(left).max() < 1e-9 * bowl.max()  # rounding of the least squares
    assert bowl.max() == pytest.approx(4.23e-3, abs=5e-6)


def test_a_slab_held_flat_has_a_uniform_moment(slab: tuple[Slab, Mortar]) -> None:
    """D (1 + nu) alpha T' = 27 kN m/m both ways: the work on unit curvatures is the moment times the area."""
    s = slab[0]
    x, y = nodes(s)
    load = CURVATURE * warp_load(s)
    for place, bent in ((1, x), (2, y)):
        motion = np.zeros((len(x), 3))
        motion[:, 0], motion[:, place] = 0.5 * bent**2, bent
        moment = float(load @ motion.ravel()) / (s.length * s.width)
        assert moment == pytest.approx(s.rigidity * (1.0 + s.nu) * CURVATURE, rel=1e-12)
        assert moment == pytest.approx(27.0e3, rel=1e-9)


def test_the_load_does_no_work_on_rigid_motion_and_twist(slab: tuple[Slab, Mortar]) -> None:
    s = slab[0]
    x, y = nodes(s)
    load, one, none = warp_load(s), np.ones_like(x), np.zeros_like(x)
    for motion in ((one, none, none), (x, one, none), (y, none, one), (x * y, y, x)):
        assert abs(load @ np.stack(motion, axis=1).ravel()) < 1e-9 * np.abs(load).max()


def test_the_free_slab_has_no_moments(slab: tuple[Slab, Mortar]) -> None:
    """Curvatures at every element's middle equal alpha T'."""
    s = slab[0]
    w = np.linalg.lstsq(slab_matrices(*slab).K_plate[:-2, :-2], CURVATURE * warp_load(s), rcond=1e-12)[0]
    table = tabulate_shapes(s, np.zeros((1, 2)))[0]
    curvatures = w[element_dofs(s)] @ table[[WXX, WYY]].T
    np.testing.assert_allclose(curvatures, CURVATURE, rtol=1e-8)  # rounding, second derivatives


def test_warps_by_slab() -> None:
    warps = (SlabWarp(gradient=50.0), SlabWarp(gradient=-20.0, slabs=(3, 4), expansion=2e-5))
    found = [curvature_of(warps, slab) for slab in range(6)]
    np.testing.assert_allclose(found, [5e-4, 5e-4, 5e-4, 1e-4, 1e-4, 5e-4])
