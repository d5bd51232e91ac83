"""Checks of the shapes of rails, wheels and ground against a run."""

from __future__ import annotations

from tiengine.irregularity.ground import check_ground
from tiengine.irregularity.rail_shapes import check_rail_shapes
from tiengine.irregularity.wheel_shapes import check_wheel_shapes
from tiengine.parameters.errors import InputError
from tiengine.scenario.tables import Numerics, Track, Train

__all__ = ["check_shapes"]


def check_shapes(
    track: Track, train: Train, numerics: Numerics, wheelsets: int, begin: float, no_tension: bool
) -> None:
    """Check that shapes of rails and wheels belong to rails and wheels of the run, and that its step knows them.

    Args:
        track: Has the shapes of rails.
        train: Has the shapes of wheels.
        numerics: Tell the kind of step.
        wheelsets: Wheelsets of the train.
        begin: Chainage of the leading wheel at the start [m].
        no_tension: Whether the slab's bed transmits no tension.

    Raises:
        InputError: Names the key, its value and the rule.
    """
    check_rail_shapes(track.rail_shapes, begin=begin, end=begin + train.distance)
    check_ground(track.ground, begin=begin, end=begin + train.distance)
    check_wheel_shapes(train.wheel_shapes, wheelsets)
    _check_gaps(track, numerics, no_tension)
    for key, given in (
        ("track.rail_shapes", track.rail_shapes),
        ("track.ground", track.ground),
        ("track.base_motion", track.base_motion.file),
        ("train.wheel_shapes", train.wheel_shapes),
    ):
        if given and numerics.trial_functions == "sines":
            raise InputError(f'{key}: must be left out with numerics.trial_functions = "sines"; splines know them')


def _check_gaps(track: Track, numerics: Numerics, no_tension: bool) -> None:
    """Check that a run with gaps or warped slabs has a bed that lets go, and rails that can follow."""
    names = [f"track.mortar_voids[{i}].gap" for i, void in enumerate(track.mortar_voids) if void.gap is not None]
    failed = track.failed_fastenings
    names += [f"track.failed_fastenings[{i}].gap" for i, row in enumerate(failed) if row.gap is not None]
    names += ["track.slab_warps"] if track.slab_warps else []
    for name in names:
        if not no_tension:
            raise InputError(f"{name}: needs a bed that transmits no tension; set track.mortar_no_tension = true")
        if numerics.trial_functions == "sines":
            raise InputError(f'{name}: must be left out with numerics.trial_functions = "sines"; splines know it')
