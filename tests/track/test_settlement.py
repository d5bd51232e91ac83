"""Settled ground: the static shape of rails and slabs, and a train that runs over it."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine import backend
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.track.settled_rail import settled_rail
from tiengine.track.settlement import Settlement, ground_shape
from tiengine.track.slab_matrices import slab_matrices

AT, LENGTH, DEPTH = 100.0, 20.0, 0.01
V = 350.0 / 3.6


def shape_of(settlement: Settlement, **changes: float):
    """Static shape of the default track's rails; ``changes`` are of the slab."""
    parts = load_scenario("default").parts
    backend.start()
    slab = parts.slab.model_copy(update=changes)
    sound = slab_matrices(slab, parts.mortar, (), parts.fastening.baseplate)
    sound_seats = np.ones
    return settled_rail(
        settlement, parts.rail, parts.fastening, slab, parts.mortar.stiffness, lambda i: sound,
        lambda first, count: sound_seats((count, 2)),
    )  # fmt: skip


def test_rails_follow_long_waves_of_the_ground():
    """Slabs of 5.6 m over a cosine of 20 m: within 2 % of its depth of the ground, at their own 0.63 m of the joints.

    A slab of rigidity D on its bed k follows a wave number q by 1/(1 + D q^4/k): all but 2e-4 at 20 m; the joints,
    where slabs end without moment, and the rail across them add up to a per cent.
    """
    settlement = Settlement(kind="cosine", at=AT, length=LENGTH, depth=DEPTH)
    start, end, shape = shape_of(settlement)
    x = np.linspace(start, end, 500)
    assert np.abs(shape(x) - ground_shape(settlement, x)).max() < 0.02 * DEPTH
    heave = shape_of(settlement.model_copy(update={"depth": -DEPTH}))[2]
    np.testing.assert_allclose(heave(x), -shape(x), atol=1e-12)  # rounding of a sparse solution


def test_a_stiff_slab_bridges_a_short_settlement():
    """Ramps of 1 m: slabs a hundred times as stiff stay above the ground in its middle."""
    settlement = Settlement(kind="angles", at=99.225, length=2.0, depth=DEPTH)
    soft, stiff = (shape_of(settlement, E=E)[2](settlement.at) for E in (3.6e10, 3.6e12))
    assert 0.0 < stiff < 0.7 * soft < 0.7 * DEPTH


def test_wheels_over_a_cosine():
    """The kinematics of a rigid wheel: 4.86 Hz and A/2 (2 pi V/L)^2 = 4.66 m/s^2 (a pure wave of 10 mm in 20 m).

    Less what the seats do on even ground, from 3 m beyond either end of the wave, where its acceleration sets in with a
    step. The largest within 5 %: the track gives way under the wheel's own inertia; all along within 15 %: slabs meet
    at a slight angle, since their free ends have no moment.
    """
    changes = ["train.distance=45", "train.start=70", "irregularity.spectrum='none'", "irregularity.taper=5"]
    table = f"track.settlements=[{{kind='cosine', at={AT}, length={LENGTH}, depth={DEPTH}}}]"
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
        ("default", "kind='cosine', at=5000, length=20, depth=0.01", "settlements[0].at = 5000: must lie between"),
        ("default", "kind='cosine', at=100, length=20, depth=1.0", "settlements[0].depth = 1.0: must be less than"),
        ("default", "kind='bump', at=100, length=20, depth=0.01", "settlements[0].kind = 'bump'"),
        ("default", "kind='cosine', at=100, length=20", "settlements[0].depth: missing"),
        ("paper", "kind='cosine', at=100, length=20, depth=0.01", "track.settlements: must be left out with numerics"),
    ],
)
def test_bad_settlements_are_refused(scenario, table, said):
    with pytest.raises(InputError) as caught:
        load_scenario(scenario, [f"track.settlements=[{{{table}}}]"])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
