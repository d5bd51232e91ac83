"""Trains over warped slabs, gaps under slabs and hanging seats."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run

BASE = [
    "train.distance=22", "train.start=60", "irregularity.spectrum='none'", "irregularity.taper=1", "output.run_in=0",
    "track.mortar_no_tension=true",
]  # fmt: skip
SEATS = "track.failed_fastenings=[{{rail='left', seats=[121, 122], {}}}]"  # chainage 76.5 m, the leading wheel at 68.75
VOID = "track.mortar_voids=[{{slab=13, x=[1.8666666666666667, 3.7333333333333333], y=[-1.25, 1.25], {}}}]"


@cache
def normal_forces(*changes: str) -> np.ndarray:
    """N of every wheel at every step [N], shape (steps, W, 2)."""
    with run(load_scenario("default", [*BASE, *changes])) as result:
        return np.asarray(result.wheel()["normal_force"])


def largest_difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max())


@pytest.mark.slow
def test_seats_that_hang_by_nothing_are_sound_and_by_much_have_failed() -> None:
    sound, failed = normal_forces(), normal_forces(SEATS.format("factor=0.0"))
    np.testing.assert_array_equal(normal_forces(SEATS.format("gap=0.0")), sound)
    np.testing.assert_array_equal(normal_forces(SEATS.format("gap=0.1")), failed)
    assert largest_difference(sound, failed) > 1e4
    half = normal_forces(SEATS.format("gap=5e-4"))
    assert 1e3 < largest_difference(half, sound) < 0.5 * largest_difference(failed, sound)


@pytest.mark.slow
def test_a_bed_with_a_gap_of_nothing_is_sound_and_with_a_huge_one_a_void() -> None:
    """An open bed is explicit, a void is not in the implicit block at all: 3e-4 of N apart, the passes' error."""
    sound, void = normal_forces(), normal_forces(VOID.format("factor=0.0"))
    np.testing.assert_array_equal(normal_forces(VOID.format("gap=0.0")), sound)
    assert largest_difference(normal_forces(VOID.format("gap=0.1")), void) < 3e-4 * sound.mean()
    assert largest_difference(sound, void) > 3e3
    part = normal_forces(VOID.format("gap=5e-5"))
    assert 0.0 < largest_difference(part, sound) < 0.5 * largest_difference(void, sound)


def test_the_start_is_in_equilibrium_on_warped_slabs() -> None:
    """The first millisecond moves N as little as the seats' passing does on sound slabs."""
    warped = normal_forces("track.slab_warps=[{gradient=-45}]")
    assert np.abs(np.diff(warped[:5], axis=0)).max() < 3.0 * np.abs(np.diff(normal_forces()[:5], axis=0)).max()
    assert np.ptp(warped[300:]) > 2.0 * np.ptp(normal_forces()[300:])


@pytest.mark.slow
def test_a_settlement_on_a_bed_without_tension() -> None:
    """2 mm over 8 m, which slabs bridge in part until the wheels press them down: other forces, of the same order."""
    ground = "track.ground=[{kind='cosine', at=80, length=8, depth=0.002}]"
    bridged, pulled = normal_forces(ground), normal_forces(ground, "track.mortar_no_tension=false")
    assert 1e3 < largest_difference(bridged, pulled) < np.ptp(pulled)
    assert np.ptp(bridged) == pytest.approx(np.ptp(pulled), rel=0.3)


@pytest.mark.slow
def test_trains_together_have_the_bits_of_one_alone() -> None:
    """Wider vectors, other lanes: nothing else."""
    found = []
    for size in (1, 3):
        changes = [
            "track.slab_warps=[{gradient=-40, slabs=[10, 16]}]",
            SEATS.format("gap=2e-4"),
            f"ensemble.size={size}",
        ]
        with run(load_scenario("default", [*BASE, *changes, "irregularity.spectrum='german_low'"])) as result:
            found.append(np.asarray(result["trains/000/wheel/normal_force"][:]))
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["track.slab_warps=[{gradient=-45}]"], "track.slab_warps: needs a bed that transmits no tension"),
        ([VOID.format("gap=1e-3")], "track.mortar_voids[0].gap: needs a bed that transmits no tension"),
        ([SEATS.format("gap=1e-3")], "track.failed_fastenings[0].gap: needs a bed that transmits no tension"),
        (
            ["track.slab_warps=[{gradient=300}]"],
            "track.slab_warps[0].gradient = 300: must be less than or equal to 200",
        ),
        (["track.slab_warps=[{}]"], "track.slab_warps[0].gradient: missing"),
        ([BASE[-1], "track.slab_warps=[{gradient=9, slabs=[4, 3]}]"], "slabs = [4, 3]: must be [first, last] with"),
        (
            [BASE[-1], "track.slab_warps=[{gradient=9, slabs=[900, 999]}]"],
            "slabs = [900, 999]: must begin between 0 and",
        ),
        ([VOID.format("gap=1.0")], "track.mortar_voids[0].gap = 1.0: must be less than or equal to 0.1 m"),
        ([SEATS.format("gap=-1.0")], "track.failed_fastenings[0].gap = -1.0: must be greater than or equal to 0 m"),
        (
            [BASE[-1], "numerics.trial_functions='sines'", "track.slab_warps=[{gradient=9}]"],
            "track.slab_warps: must be left out with numerics.trial_functions",
        ),
    ],
)
def test_bad_gaps_are_refused(changes: list[str], said: str) -> None:
    with pytest.raises(InputError) as caught:
        load_scenario("default", ["train.distance=22", "train.start=60", *changes])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
