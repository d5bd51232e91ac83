"""Vehicles: frequencies with wheelsets held, rigid motions, energy, static loads.

References: calculations from the same published data sheets, independent of this program and made when the sheets
were collected (with their printed digits): CRH380A v2 and v6 after a public MATLAB code, Zhai's
coach, CRH2 after Huo and Dai, Shock and Vibration 2019, 2015465.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, expm

from tiengine.parameters.arrays import Reals
from tiengine.vehicle.train import TrainModel, assemble, static_wheel_loads
from tiengine.vehicle.vehicle import load_vehicle
from validation.frame.case import Case

INDEPENDENT = "independent calculation from the same data sheet"
PRINTED = {
    "CRH380A_v2": ".431 .637 .680 .891 .909 7.33 8.29 12.2 16.7 32.4",
    "CRH380A_v6": ".579 .762 .853 .913 1.178 7.62 9.44 12.55 17.16 29.41",
    "Zhai_coach": ".509 .767 .929 1.027 1.199 5.07 6.08 7.61 7.70 13.34 23.24",
}
LOADS = {"CRH380A_v6": 65.0, "CRH380A_v2": 68.7, "Zhai_coach": 55.9, "CRH2": 61.7, "Manchester": 54.5}


def _train(name: str) -> TrainModel:
    return assemble([load_vehicle(name)], series_springs=False)


def _held(name: str) -> Reals:
    """Frequencies [Hz] nearest to the printed ones, which give one number for pairs of the two frames."""
    train = _train(name)
    free = np.setdiff1d(np.arange(train.n), train.wheelset_dof)
    own = np.sqrt(eigh(train.K[np.ix_(free, free)], train.M[np.ix_(free, free)], eigvals_only=True)) / (2.0 * np.pi)
    printed = _printed(name)
    return own[np.abs(own[:, None] - printed).argmin(axis=0)]


def _printed(name: str) -> Reals:
    return np.array([float(text) for text in PRINTED[name].split()])


def _unit(name: str) -> Reals:
    """One unit of the last printed digit."""
    return np.array([10.0 ** -len(text.partition(".")[2]) for text in PRINTED[name].split()])


def _rigid_motions() -> int:
    """Number of zero frequencies of the free vehicle."""
    train = _train("CRH380A_v2")
    omega2 = eigh(train.K, train.M, eigvals_only=True)
    return int(np.sum(np.abs(omega2) < 1e-8 * omega2[-1]))


def _energy_change() -> float:
    """Relative change of energy over 10 s at 350 km/h without dampers, from a random state."""
    train, V = _train("CRH380A_v2"), 350.0 / 3.6
    n = train.n
    inverse = np.linalg.inv(train.M)
    held = train.K + 1e6 * np.diag(np.isin(np.arange(n), train.wheelset_dof))  # no drift of the rigid motions
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ held, -inverse @ (V * train.C_speed)]])
    state = np.random.default_rng(1).standard_normal(2 * n) * np.repeat([1e-3, 1e-2], n)

    def energy(x: Reals) -> float:
        return float(0.5 * (x[n:] @ train.M @ x[n:] + x[:n] @ held @ x[:n]))

    step, before = expm(0.01 * A), energy(state)
    for _ in range(1000):
        state = step @ state
    return energy(state) / before - 1.0


CASES = (
    *(
        Case(
            name=f"vehicle-{name}",
            kind="validation",
            quantity=f"{len(text.split())} undamped frequencies, wheelsets held, {name} [Hz]",
            source=INDEPENDENT,
            reference=lambda name=name: _printed(name),
            atol=_unit(name),
            why="one unit of the last printed digit",
            compute=lambda name=name: _held(name),
        )
        for name, text in PRINTED.items()
    ),
    Case(
        name="vehicle-rigid",
        kind="verification",
        quantity="zero frequencies of a free vehicle",
        source=(
            "y, z, roll, yaw of the whole vehicle (pitch needs the omitted longitudinal motion), spin of four wheelsets"
        ),
        reference=8,
        why="a count",
        compute=_rigid_motions,
    ),
    Case(
        name="vehicle-energy",
        kind="verification",
        quantity="relative change of energy in 10 s without dampers, wheelsets spinning at 350 km/h",
        source="springs and a skew gyroscopic pair do no work",
        reference=0.0,
        atol=1e-8,
        why="rounding of the matrix exponential, stiffness to 1e9, 1000 times",
        compute=_energy_change,
    ),
    Case(
        name="vehicle-loads",
        kind="validation",
        quantity=f"static wheel load of {', '.join(LOADS)} [kN]",
        source="weights of the data sheets, calculated by hand",
        reference=tuple(LOADS.values()),
        atol=0.05,
        why="printed digits",
        compute=lambda: [1e-3 * float(static_wheel_loads(_train(name)).mean()) for name in LOADS],
    ),
)
