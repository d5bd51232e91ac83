"""Time integration on the paper's case, first second: order, error, mortar explicit or implicit.

References: the same run with a step of 2.5e-5 s. Errors are the largest over all wheels and times relative to
the largest force; orders come from the root mean square differences of successive
halvings; those of the largest differences are listed for information.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from tiengine.parameters.arrays import Reals
from validation.frame.case import Case
from validation.frame.runs import Forces, simulate

FINEST, SAMPLE = 2.5e-5, 2e-4
STEPS = (2e-4, 1e-4, 5e-5)
LARGEST, COMMON = 2.5e-4, 1e-3  # longest step within the bound, used by the speed suite; samples of both runs


def _run(dt: float, mortar: str = "implicit", sample: float = SAMPLE) -> Forces:
    """First second of the paper's case."""
    return simulate(
        "paper",
        "train.distance=97.3",
        f"numerics.time_step={dt}",
        f"output.wheel_interval={sample}",
        f'numerics.mortar="{mortar}"',
    )


def _difference(first: Forces, second: Forces, direction: str) -> Reals:
    """First run minus second at common samples [N], shape (n, wheelsets, 2)."""
    a, b = (getattr(run, direction) for run in (first, second))
    n = min(len(a), len(b))
    if not np.allclose(first.time[:n], second.time[:n], rtol=0.0, atol=1e-9):
        raise ValueError("runs are not sampled at the same times")
    return a[:n] - b[:n]


def _error(first: Forces, second: Forces, direction: str) -> float:
    """Largest difference over the largest force [%]."""
    peak = np.abs(getattr(second, direction)).max()
    return float(100.0 * np.abs(_difference(first, second, direction)).max() / peak)


def _order(direction: str) -> float:
    """Order in dt of the root mean square difference, 2e-4 to 1e-4 against 1e-4 to 5e-5."""
    runs = [_run(dt) for dt in STEPS]
    sizes = [np.sqrt(np.mean(_difference(a, b, direction) ** 2)) for a, b in pairwise(runs)]
    return float(np.log2(sizes[0] / sizes[1]))


def _orders_of_largest() -> list[float]:
    """Order from the largest differences, vertical and lateral."""
    runs, orders = [_run(dt) for dt in STEPS], []
    for direction in ("vertical", "lateral"):
        sizes = [np.abs(_difference(a, b, direction)).max() for a, b in pairwise(runs)]
        orders.append(float(np.log2(sizes[0] / sizes[1])))
    return orders


CASES = (
    *(
        Case(
            name=f"dt-order-{direction}",
            kind="convergence",
            quantity=f"order in dt of the {direction} force, 2e-4, 1e-4, 5e-5 s",
            source="Newmark's average acceleration is of second order",
            reference=1.7,
            rule="at least",
            why="lift-off and flange contact are not smooth in time",
            compute=lambda direction=direction: _order(direction),
        )
        for direction in ("vertical", "lateral")
    ),
    Case(
        name="dt-order-of-largest",
        kind="information",
        quantity="order from the largest differences instead: vertical, lateral",
        source="-",
        reference=(2.0, 2.0),
        why="determined by one instant at a kink (lift-off, arc joint of the flange root)",
        compute=_orders_of_largest,
    ),
    *(
        Case(
            name=f"dt-error-{direction}-{dt:g}",
            kind="convergence",
            quantity=f"largest error of the {direction} force over its peak [%], dt = {dt:g} s",
            source="the same run at 2.5e-5 s",
            reference=0.3,
            rule="at most",
            why=why,
            compute=lambda direction=direction, dt=dt, sample=sample: _error(
                _run(dt, sample=sample), _run(FINEST, sample=sample), direction
            ),
        )
        for direction in ("vertical", "lateral")
        for dt, sample, why in (
            (2e-4, SAMPLE, "a tenth of the error of the number of modes"),
            (1e-4, SAMPLE, "a tenth of the error of the number of modes"),
            (LARGEST, COMMON, "this bound sets the longest step of the speed suite"),
        )
    ),
    *(
        Case(
            name=f"mortar-halves-{direction}",
            kind="convergence",
            quantity=(f"{direction} force, bed explicit minus bed implicit, over the peak [%], 1e-4 s"),
            source="the same equations, split differently",
            reference=0.1,
            rule="at most",
            why="the two passes leave an error of order dt^2 in the explicit part",
            compute=lambda direction=direction: _error(_run(1e-4, "explicit"), _run(1e-4), direction),
        )
        for direction in ("vertical", "lateral")
    ),
)
