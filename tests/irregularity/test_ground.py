"""Settled ground: the static shape of rails and slabs, and a train that runs over it."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from tiengine.engine import backend
from tiengine.irregularity.ground import LATERAL, Ground, ground_shape, reach_of
from tiengine.irregularity.rail_shapes import SettledRail
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.track.settled_rail import settled_rail
from tiengine.track.slab_matrices import slab_matrices

AT, LENGTH, DEPTH = 100.0, 20.0, 0.01
V = 350.0 / 3.6


def shape_of(ground: Ground, **changes: float):
    """Static shape of the default track's rails; ``changes`` are of the slab."""
    parts = load_scenario("default").parts
    backend.start()
    slab = parts.slab.model_copy(update=changes)
    sound = slab_matrices(slab, parts.mortar, (), parts.fastening.baseplate)
    sound_seats = np.ones
    return settled_rail(
        partial(ground_shape, ground), reach_of(ground), parts.rail, parts.fastening, slab, parts.mortar,
        lambda i: sound, lambda first, count: sound_seats((count, 2)),
    )  # fmt: skip


def test_rails_follow_long_waves_of_the_ground():
    """Slabs of 5.6 m over a cosine of 20 m: within 2 % of its depth of the ground, at their own 0.63 m of the joints.

    A slab of rigidity D on its bed k follows a wave number q by 1/(1 + D q^4/k): all but 2e-4 at 20 m; the joints,
    where slabs end without moment, and the rail across them add up to a per cent.
    """
    ground = Ground(kind="cosine", at=AT, length=LENGTH, depth=DEPTH)
    shape = shape_of(ground)
    x = np.linspace(shape.x[0], shape.x[-1], 500)
    assert np.abs(shape(x)[:, 0] - ground_shape(ground, x)).max() < 0.02 * DEPTH
    assert np.abs(shape(x)[:, 1]).max() < 1e-12
    heave = shape_of(ground.model_copy(update={"depth": -DEPTH}))
    np.testing.assert_allclose(heave(x), -shape(x), atol=1e-12)  # rounding of a sparse solution


def test_rails_follow_ground_that_slides():
    """Laterally a slab is rigid: it lies along the chord of the ground under it, the rails bend across the joints.

    A straight line fitted to a cosine of 20 m over 5.6 m leaves y'' L^2/12 = 0.13 of the amplitude at its ends, which
    the rails halve; the lateral shape alone, since nothing couples it with the vertical one.
    """
    ground = Ground(kind="cosine", at=AT, length=LENGTH, lateral=DEPTH)
    shape = shape_of(ground)
    x = np.linspace(shape.x[0], shape.x[-1], 500)
    apart = np.abs(shape(x)[:, 1] - ground_shape(ground, x, LATERAL))
    assert 0.01 * DEPTH < apart.max() < 0.13 * DEPTH
    assert np.abs(shape(x)[:, 0]).max() < 1e-12


def test_behind_a_ramp_the_rails_stay_displaced():
    """A ramp of 10 mm over 10 m: as the ground 10 m behind it, to the decay of the rails on their fastenings."""
    shape = shape_of(Ground(kind="ramp", at=AT, length=10.0, depth=DEPTH, lateral=-DEPTH))
    assert np.abs(shape(AT - 15.0)).max() < 1e-3 * DEPTH
    np.testing.assert_allclose(shape(AT + 15.0), [DEPTH, -DEPTH], atol=1e-3 * DEPTH)
    settled = SettledRail(shape)
    value, slope = settled.both(np.array([0.0, AT + 500.0]))
    np.testing.assert_allclose(value, [[0.0, 0.0], shape(shape.x[-1])], atol=0.0)
    assert not slope.any()


def test_a_file_is_the_same_as_the_formula(tmp_path):
    """A cosine in rows of 0.5 m, in mm, semicolons and decimal commas: the spline is within 1e-5 of its depth.

    Its error is 5/384 h^4 times the fourth derivative, 1/2 (2 pi/20)^4, that is 4e-6, and more at the cosine's ends,
    where the curvature jumps: 1/2 (2 pi/20)^2 h^2/8, that is 1.5e-3; so the middle is compared, and all to 2e-3.
    """
    formula = Ground(kind="cosine", at=AT, length=LENGTH, depth=DEPTH, lateral=-0.5 * DEPTH)
    x = np.arange(60.0, 140.01, 0.5)
    rows = [
        f"{a:.3f};{1e3 * ground_shape(formula, a):.9f};{1e3 * ground_shape(formula, a, LATERAL):.9f}".replace(".", ",")
        for a in x
    ]
    path = tmp_path / "levels.csv"
    path.write_text("\n".join(["x [m];vertical [mm];alignment [mm]", *rows]))
    ground = Ground(kind="file", file=str(path))
    assert reach_of(ground) == (60.0, 140.0)
    at = np.linspace(70.0, 130.0, 1001)
    inner = np.abs(at - AT) < 0.5 * LENGTH - 3.0
    for direction in range(2):
        apart = np.abs(ground_shape(ground, at, direction) - ground_shape(formula, at, direction)) / DEPTH
        assert apart.max() < 2e-3
        assert apart[inner].max() < 1e-5
    twice = ground.model_copy(update={"scale": 2.0})
    np.testing.assert_allclose(ground_shape(twice, at), 2.0 * ground_shape(ground, at), rtol=1e-12)


def test_a_stiff_slab_bridges_a_short_settlement():
    """Ramps of 1 m: slabs a hundred times as stiff stay above the ground in its middle."""
    ground = Ground(kind="angles", at=99.225, length=2.0, depth=DEPTH)
    soft, stiff = (shape_of(ground, E=E)(ground.at)[0] for E in (3.6e10, 3.6e12))
    assert 0.0 < stiff < 0.7 * soft < 0.7 * DEPTH


def test_wheels_over_a_cosine():
    """The kinematics of a rigid wheel: 4.86 Hz and A/2 (2 pi V/L)^2 = 4.66 m/s^2 (a pure wave of 10 mm in 20 m).

    Less what the seats do on even ground, from 3 m beyond either end of the wave, where its acceleration sets in with a
    step. The largest within 5 %: the track gives way under the wheel's own inertia; all along within 15 %: slabs meet
    at a slight angle, since their free ends have no moment.
    """
    changes = ["train.distance=45", "train.start=70", "irregularity.spectrum='none'", "irregularity.taper=5"]
    table = f"track.ground=[{{kind='cosine', at={AT}, length={LENGTH}, depth={DEPTH}}}]"
    lead = []
    for more in ([], [table]):
        with run(load_scenario("default", [*changes, *more, "output.run_in=0"])) as result:
            body = result.body()
        lead.append(body["acceleration"][:, 3, 1])  # car body, two frames, then the leading wheelset: vertical
    wheel = body["position"] + 8.75 + 1.25
    inner = np.abs(wheel - AT) < 0.5 * LENGTH - 3.0
    found, expected = (lead[1] - lead[0])[inner], 0.5 * DEPTH * (2.0 * np.pi * V / LENGTH) ** 2
    assert expected == pytest.approx(4.66, abs=0.01)
    assert pytest.approx(4.86, abs=0.005) == V / LENGTH
    wave = -expected * np.cos(2.0 * np.pi * (wheel[inner] - AT) / LENGTH)
    assert found.min() == pytest.approx(-expected, rel=0.05)
    assert np.abs(found - wave).max() < 0.15 * expected


@pytest.mark.parametrize(
    ("scenario", "table", "said"),
    [
        ("default", "kind='cosine', at=5000, length=20, depth=0.01", "ground[0].at = 5000: must lie between"),
        ("default", "kind='cosine', at=100, length=20, depth=1.0", "ground[0].depth = 1.0: must be less than"),
        ("default", "kind='bump', at=100, length=20, depth=0.01", "ground[0].kind = 'bump'"),
        (
            "default",
            "kind='cosine', at=100, length=20",
            "ground.depth: missing; kind = 'cosine' needs depth, lateral or both",
        ),
        ("default", "kind='ramp', length=20, depth=0.01", "ground.at: missing; kind = 'ramp' needs at, length"),
        ("default", "kind='file', depth=0.01", "ground.file: missing; kind = 'file' needs file"),
        (
            "default",
            "kind='file', file='x.csv', depth=0.01",
            "ground.depth = 0.01: must be left out with kind = 'file'",
        ),
        ("default", "kind='angles', at=100, length=20, lateral=0.01, taper=3", "ground.taper = 3.0: must be left out"),
        ("paper", "kind='cosine', at=100, length=20, depth=0.01", "track.ground: must be left out with numerics"),
    ],
)
def test_bad_displacements_are_refused(scenario, table, said):
    with pytest.raises(InputError) as caught:
        load_scenario(scenario, [f"track.ground=[{{{table}}}]"])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
