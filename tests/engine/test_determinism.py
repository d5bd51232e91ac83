"""The same bits again: second run, threads, launches; and the same numbers without Taichi's optimiser."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiengine.kernels import layout as at
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate

from ..reference.stepping import History, model_of, run_steps

PROGRAM = Path(__file__).parents[1] / "reference" / "run_bits.py"
DURATION = 0.05


@pytest.fixture(scope="module")
def once() -> History:
    """The paper's case, serial, one train."""
    return run_steps("paper", dt=1e-4, duration=DURATION)


def assert_same_bits(a: History, b: History) -> None:
    """Every recorded number and the whole final motion."""
    np.testing.assert_array_equal(a.wheel, b.wheel)
    np.testing.assert_array_equal(a.body, b.body)
    np.testing.assert_array_equal(a.state.motion[:3], b.state.motion[:3])


@pytest.mark.parametrize("options", [{}, {"public": True}], ids=["again", "public"])
def test_same_bits(once, options):
    """A second run; public launches: the same machine code on the same numbers."""
    assert_same_bits(once, run_steps("paper", dt=1e-4, duration=DURATION, **options))


def test_parallel_loop_agrees_to_rounding(once):
    """The parallel kernels are other machine code, whose sums are associated otherwise (fast math): 4e-10 N measured.

    So the bits of a run depend on whether its loop is the parallel one, never on the number of threads.
    """
    parallel = run_steps("paper", dt=1e-4, duration=DURATION, parallel=True)
    np.testing.assert_allclose(parallel.vertical, once.vertical, atol=1e-6)
    np.testing.assert_allclose(parallel.lateral, once.lateral, atol=1e-6)


def test_public_launch_of_a_run():
    """The setting of ``run`` gives the same file contents."""
    scenario = load_scenario("paper", ["train.distance=2", "output.precision='double'"])
    with simulate.run(scenario) as a, simulate.run(scenario, public_launch=True) as b:
        for group in ("wheel", "body"):
            mine, other = a.group(group), b.group(group)
            for name in mine:
                np.testing.assert_array_equal(mine[name], other[name])


def in_a_process(threads: int, optimised: bool, steps: int) -> dict[str, Any]:
    """Output of ``run_bits``."""
    command = [sys.executable, str(PROGRAM), str(threads), str(int(optimised)), str(steps)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def test_same_bits_in_other_processes_and_for_two_threads():
    """One and two Taichi threads, each in a process of its own, the parallel loop in both."""
    assert in_a_process(1, True, 200)["digest"] == in_a_process(2, True, 200)["digest"]


@pytest.mark.slow
def test_same_numbers_without_the_optimiser():
    """Taichi 1.7.4 miscompiles some loops; compiled plainly, 50 steps agree to rounding.

    Sums reassociated by the optimiser differ by 1e-14 of their terms; stiffnesses of 1e10 N/m on 1e-3 m amplify that,
    over 50 steps, to less than 1e-3 N of 7e4 N.
    """
    plain, optimised = (np.array(in_a_process(1, way, 50)["forces"]) for way in (False, True))
    np.testing.assert_allclose(plain, optimised, atol=1e-3)


def test_two_equal_trains(once):
    """Both trains of a group get the same bits; a group of one differs by rounding.

    BLAS sums products for one right-hand side in another order than for several. Rounding of wheel forces
    (1e-16 of elastic forces of 1e7 N) grows with the start's oscillations: below 1e-4 N after 500 steps.
    """
    found = []

    def each(i: int, stepper) -> None:
        if i in (99, 499):
            row = i % 500
            found.append(stepper.chunk.wheel[:, row].copy())

    two = run_steps("paper", dt=1e-4, duration=DURATION, model=model_of("paper", dt=1e-4, trains=2), each=each)
    for block in ("vertical", "lateral", "slabs", "vehicles"):
        for row in (at.U, at.V, at.A):
            both = two.state.view(row, block)
            np.testing.assert_array_equal(both[0], both[1])
    for wheel in found:
        np.testing.assert_array_equal(wheel[0], wheel[1])
    np.testing.assert_allclose(two.vertical, once.vertical, atol=1e-4)
    np.testing.assert_allclose(two.lateral, once.lateral, atol=1e-4)
