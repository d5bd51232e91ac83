"""Ensemble: several trains from one scenario, and the keys in which they differ.

::

    [ensemble]
    size = 4
    seeds = [11, 12, 13, 14]              # default: irregularity.seed and the seeds that follow

    [ensemble.vary]
    "train.speed_kmh" = [300.0, 350.0]    # trains 0 and 2 run at 300 km/h, trains 1 and 3 at 350 km/h

Train i takes entry i of every list; a list whose length divides the ensemble's size is repeated. Any key that describes
a train, its track or its numerics may vary. Settings shared by all trains of a file may not: output and threads.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["Ensemble"]

VARIABLE = ("train", "track", "irregularity", "contact", "numerics")
SHARED = ("numerics.threads",)

MOST_DIFFERENT = 5000
"""Trains of one ensemble that differ in more than their seed: each takes about 10 ms to build and check."""

Seed = Annotated[int, Q("-", "seed of a realisation", ge=0, le=2**63 - 1)]


def _flat(value: Any) -> Any:
    """Flatten to dotted keys: ``{train = {speed_kmh = [...]}}`` means ``{"train.speed_kmh" = [...]}``."""
    return dict(_leaves(value, "")) if isinstance(value, dict) else value


def _leaves(tables: dict[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    """Dotted keys and lists of nested tables."""
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        elif not isinstance(value, tuple):
            raise InputError(f"ensemble.vary: {prefix + key!r} = {value!r}: must be a list, one value per train")
        else:
            yield f"{prefix}{key}", value


class Ensemble(Params):
    """Number of trains that are run together, and the keys of the scenario that differ between them.

    Without ``seeds``, trains take ``irregularity.seed`` and the seeds that follow it. ``vary`` holds a list of values
    for each key that varies.
    """

    size: Annotated[int, Q("-", "number of trains", ge=1, le=100_000)] = 1
    seeds: Annotated[tuple[Seed, ...], Field(description="one per train")] = ()
    vary: Annotated[
        dict[str, tuple[Any, ...]],
        BeforeValidator(_flat),
        Field(description="lists of values by key; train i takes entry i, shorter lists are repeated"),
    ] = Field(default_factory=dict)

    @field_validator("seeds")
    @classmethod
    def _has_one_a_train(cls, seeds: tuple[int, ...], info: ValidationInfo) -> tuple[int, ...]:
        size = info.data.get("size", len(seeds))
        if seeds and len(seeds) != size:
            raise ValueError(f"must be one seed per train, {size}")
        return seeds

    @field_validator("vary")
    @classmethod
    def _fits(cls, vary: dict[str, tuple[Any, ...]], info: ValidationInfo) -> dict[str, tuple[Any, ...]]:
        size = info.data.get("size", 1)
        for key, entries in vary.items():
            if key.split(".")[0] not in VARIABLE or key in SHARED:
                raise InputError(
                    f"ensemble.vary: {key!r} cannot vary; it must be a key of {', '.join(VARIABLE)}"
                    f" other than {', '.join(SHARED)}"
                )
            if not entries or size % len(entries):
                raise InputError(
                    f"ensemble.vary: {key!r} has {len(entries)} values: must be as many as trains, {size},"
                    " or a divisor of it"
                )
        different = math.lcm(*map(len, vary.values()))
        if different > MOST_DIFFERENT:
            raise InputError(f"ensemble.vary: {different} different trains: must be at most {MOST_DIFFERENT}")
        if "irregularity.seed" in vary and info.data.get("seeds"):
            raise InputError("ensemble.vary: 'irregularity.seed' cannot vary if ensemble.seeds is stated")
        return vary

    @property
    def different(self) -> int:
        """Number of trains after which the varied values repeat."""
        return math.lcm(*map(len, self.vary.values()))

    def changes(self, train: int) -> dict[str, Any]:
        """Varied keys and their values for one train.

        Args:
            train: Its number, from 0.
        """
        return {key: entries[train % len(entries)] for key, entries in self.vary.items()}

    def seed(self, train: int, first: int) -> int:
        """Seed of one train, unless ``vary`` sets it.

        Args:
            train: Its number, from 0.
            first: The scenario's own seed.
        """
        return self.seeds[train] if self.seeds else first + train
