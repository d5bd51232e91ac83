"""Rails and wheels that are not perfect: shapes of single rails, wheels out of round (MODEL §14).

A wheel's radius deviation is a periodic table over its rotation angle, cubic between its points. The angle is that of
rolling without slip on the nominal radius, which the host gives, less the wheelset's pitch: pitch is the perturbation
of the spin -V/r0, so that slip, changes of speed and a resume need nothing beyond the state.
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array


@ti.func
def radius_deviation(number: int, angle: float, constants: Array):
    """Deviation of a wheel's radius [m] and its derivative by the angle [m/rad].

    Args:
        number: Number of the table, -1 for a round wheel.
        angle: Rotation angle [rad], any size.
        constants: Numbers, then the tables: (deviation, derivative by angle) of each point.
    """
    value, slope = 0.0, 0.0
    if number >= 0:
        pitch = ti.static(2.0 * 3.141592653589793 / at.ROUND_POINTS)
        x = angle / pitch
        cell = ti.floor(x)
        f = x - cell
        i = ti.cast(cell - ti.floor(cell / at.ROUND_POINTS) * at.ROUND_POINTS, ti.i32)
        i = ti.min(i, at.ROUND_POINTS - 1)
        a = at.N_CONSTANTS + 2 * (number * at.ROUND_POINTS + i)
        b = at.N_CONSTANTS + 2 * (number * at.ROUND_POINTS + (i + 1) % at.ROUND_POINTS)
        rise = constants[b] - constants[a]
        first, last = pitch * constants[a + 1], pitch * constants[b + 1]
        c2, c3 = 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise
        value = constants[a] + f * (first + f * (c2 + f * c3))
        slope = (first + f * (2.0 * c2 + f * 3.0 * c3)) / pitch
    return value, slope


@ti.func
def shaped_channels_at(
    b: int, step: int, wheelset: int, pitch: float, irregularity: Array, wheel: Array, constants: Array
):
    """Track channels under a wheelset with the shapes of either rail and wheel, see ``layout``.

    Args:
        b: Train.
        step: Row of the chunk.
        wheelset: Its number.
        pitch: Pitch of the wheelset [rad].
        irregularity: Track channels of the host, shape (trains, steps, wheelsets, N_SHAPED).
        wheel: Numbers of each wheelset, shape (wheelsets, N_WHEEL_NUMBERS).
        constants: Numbers and the wheels' tables.
    """
    channels = ti.Vector.zero(ti.f64, at.N_FELT)
    for m in ti.static(range(at.RAIL_RIGHT_SLOPE + 1)):
        channels[m] = irregularity[b, step, wheelset, m]
    angle = irregularity[b, step, wheelset, at.TURNED] - pitch
    grown, growing = irregularity[b, step, wheelset, at.GROWN], irregularity[b, step, wheelset, at.GROWN_SLOPE]
    for side in ti.static(range(2)):
        number = ti.cast(wheel[wheelset, at.ROUND_LEFT + side], ti.i32)
        value, slope = radius_deviation(number, angle, constants)
        channels[at.WHEEL_LEFT + side] = grown * value
        channels[at.WHEEL_LEFT_SLOPE + side] = grown * slope / wheel[wheelset, at.NOMINAL_RADIUS] + growing * value
    return channels
