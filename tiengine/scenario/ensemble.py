"""Many trains from one scenario: how they differ.

::

    [ensemble]
    size = 4
    seeds = [11, 12, 13, 14]              # default: irregularity.seed and those that follow it

    [ensemble.vary]
    "train.speed_kmh" = [300.0, 350.0]    # trains 0 and 2 run at 300 km/h, trains 1 and 3 at 350 km/h

Train i takes entry i of every list; a list shorter than the ensemble, of a length that divides its size, is repeated
in turn. Any key may vary that describes a train, its track or its numerics. What all trains of a file share may not:
the output, and the threads of the process that computes them.
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
"""Trains of one ensemble that differ in more than their seed: each takes some 10 ms to build and check."""

Seed = Annotated[int, Q("-", "names a realisation", ge=0, le=2**63 - 1)]


def _flat(value: Any) -> Any:
    """Lists by dotted key: ``{train = {speed_kmh = [...]}}`` means ``{"train.speed_kmh" = [...]}``."""
    return dict(_leaves(value, "")) if isinstance(value, dict) else value


def _leaves(tables: dict[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}.")
        elif not isinstance(value, tuple):
            raise InputError(f"ensemble.vary: {prefix + key!r} = {value!r}: must be a list, one value a train")
        else:
            yield f"{prefix}{key}", value


class Ensemble(Params):
    """Trains that are run together: how many, and the keys of the scenario that differ between them.

    Without ``seeds``, trains take ``irregularity.seed`` and the seeds that follow it. ``vary`` holds a list of values
    for each key that varies.
    """

    size: Annotated[int, Q("-", "trains", ge=1, le=100_000)] = 1
    seeds: Annotated[tuple[Seed, ...], Field(description="one a train")] = ()
    vary: Annotated[
        dict[str, tuple[Any, ...]],
        BeforeValidator(_flat),
        Field(description="lists of values by key; train i takes entry i, shorter lists are repeated in turn"),
    ] = Field(default_factory=dict)

    @field_validator("seeds")
    @classmethod
    def _has_one_a_train(cls, seeds: tuple[int, ...], info: ValidationInfo) -> tuple[int, ...]:
        size = info.data.get("size", len(seeds))
        if seeds and len(seeds) != size:
            raise ValueError(f"must be one seed a train, {size}")
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
                    " or a number that divides it"
                )
        different = math.lcm(*map(len, vary.values()))
        if different > MOST_DIFFERENT:
            raise InputError(f"ensemble.vary: {different} different trains: must be at most {MOST_DIFFERENT}")
        if "irregularity.seed" in vary and info.data.get("seeds"):
            raise InputError("ensemble.vary: 'irregularity.seed' cannot vary where ensemble.seeds is given")
        return vary

    @property
    def different(self) -> int:
        """Trains, from the first on, after which the values that vary begin again."""
        return math.lcm(*map(len, self.vary.values()))

    def changes(self, train: int) -> dict[str, Any]:
        """Values of the keys that vary, of one train.

        Args:
            train: Its number, from 0.
        """
        return {key: entries[train % len(entries)] for key, entries in self.vary.items()}

    def seed(self, train: int, first: int) -> int:
        """Seed of one train, where no key varies it.

        Args:
            train: Its number, from 0.
            first: The scenario's own seed.
        """
        return self.seeds[train] if self.seeds else first + train
