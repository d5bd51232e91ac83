"""Results of trains of several vehicles made by hand: what tables and figures by vehicle are checked against."""

from __future__ import annotations

from typing import Any

import numpy as np

from tiengine.scenario.scenario import Scenario

from . import hand_made as by

PITCH = 25.0  # m, between the cars CRH380A_v2
STATIC = 70e3  # N, about the static load of a wheel


def train_of(cars: int, **overrides: Any) -> Scenario:
    """The default scenario with several cars, without run-in unless it is given."""
    return by.scenario(train__vehicles=["CRH380A_v2"] * cars, **overrides)


def offsets(cars: int) -> np.ndarray:
    """Wheelsets relative to the first car's centre [m], shape (4 cars,)."""
    return (by.OFFSET - PITCH * np.arange(cars)[:, None]).ravel()


def body_names(cars: int) -> tuple[str, ...]:
    """Bodies of the train, car by car."""
    own = [[f"v{k + 1} {name}" for name in by.BODIES[:3]] for k in range(cars)]
    return tuple(name for k in range(cars) for name in (*own[k], *(f"wheelset {4 * k + i}" for i in range(1, 5))))


def wheel(cars: int, samples: int, interval: float = 1e-3) -> dict[str, Any]:
    """Every wheel carries :data:`STATIC` and no lateral force."""
    Q = np.full((samples, 4 * cars, 2), STATIC)
    return by.wheel(Q, np.zeros_like(Q), interval, wheelset_offset=offsets(cars))


def body(cars: int, samples: int, interval: float = 1e-3) -> dict[str, Any]:
    """All bodies at rest."""
    found = by.body(np.zeros((samples, 7 * cars, 5)), interval)
    return {**found, "body": body_names(cars)}
