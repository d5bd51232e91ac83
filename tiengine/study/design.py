"""Design of a study: its plan expanded to members (one train each) and tasks, every one of them checked.

A study is its base scenario, its points and its seeds; the scenario of any part of it is made from these again, with
the same bits, by whoever computes the part.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from tiengine.irregularity.irregularity import IrregularityParams
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import parse_toml, to_tuples
from tiengine.parameters.quantity import build
from tiengine.scenario.overrides import apply_overrides
from tiengine.scenario.parts import used_presets
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.study.plan import MOST_MEMBERS, Plan
from tiengine.study.points import Point, factor_names, points_of

__all__ = ["Design", "Member", "expand"]

FORMAT, FORMAT_VERSION = "tiengine-study", 1
SEED = "irregularity.seed"


@dataclass(frozen=True)
class Member:
    """One train of a study.

    Attributes:
        number: Its number, from 0.
        point: Number of its point.
        seed: Seed of its track; None leaves that of its scenario.
    """

    number: int
    point: int
    seed: int | None


@dataclass(frozen=True)
class Design:
    """Everything that a study computes.

    Attributes:
        plan: The plan.
        base: Scenario that all trains start from; None for a study of a function.
        points: Values of all factors.
        members: The trains.
        tasks: Numbers of the members that are advanced together.
    """

    plan: Plan
    base: Scenario | None
    points: tuple[Point, ...]
    members: tuple[Member, ...]
    tasks: tuple[tuple[int, ...], ...]

    @property
    def factors(self) -> list[str]:
        """Names of the factors."""
        return factor_names(self.plan, self.points)

    @cached_property
    def digest(self) -> str:
        """Text that differs between two studies."""
        return hashlib.sha256(json.dumps(self.tables(), sort_keys=True).encode()).hexdigest()

    def values(self, member: int) -> dict[str, Any]:
        """Values in tables of the factors of a member, by name.

        Args:
            member: Its number.
        """
        return self.points[self.members[member].point].factors

    def scenario(self, task: int) -> Scenario:
        """Scenario of the trains of a task, an ensemble unless there is only one.

        Args:
            task: Its number.
        """
        members = [self.members[number] for number in self.tasks[task]]
        first = self._scenario_of_point(members[0].point)
        tracks = [self._track(member) for member in members]
        own = first.model_copy(update={"irregularity": tracks[0]})
        if len(members) == 1:
            return load_scenario(own)
        tables = [track.model_dump(exclude_none=True) for track in tracks]
        differing = [key for key in tables[0] if any(table[key] != tables[0][key] for table in tables)]
        seeds = tuple(track.seed for track in tracks)
        if set(differing) <= {"seed"}:
            vary = {} if _counts_up(seeds) else {"ensemble.seeds": seeds}
        else:
            vary = {f"ensemble.vary.irregularity.{key}": tuple(t[key] for t in tables) for key in (*differing, "seed")}
        return load_scenario(own, {"ensemble.size": len(members), **vary})

    def _scenario_of_point(self, point: int) -> Scenario:
        """Scenario of one point, with the presets that it uses."""
        if self.base is None:
            raise InputError(f"{self.plan.name}: the plan has no scenario; it can only be evaluated by a function")
        tables = to_tuples(self.base.model_dump(exclude_none=True))
        made = build(Scenario, apply_overrides(tables, self.points[point].changes, Scenario))
        return made.model_copy(update={"presets": used_presets(made.train, made.track, made.wind, made.presets)})

    def _track(self, member: Member) -> IrregularityParams:
        """Irregularity of one member."""
        base = self.base.irregularity if self.base is not None else IrregularityParams()
        changes = {key: v for key, v in self.points[member.point].changes.items() if key.startswith("irregularity")}
        tables = apply_overrides({"irregularity": to_tuples(base.model_dump(exclude_none=True))}, changes, Scenario)
        seed = {} if member.seed is None else {"seed": member.seed}
        return build(IrregularityParams, {**tables["irregularity"], **seed}, "irregularity")

    def tables(self) -> dict[str, Any]:
        """Contents of the file that describes the study, of numbers, texts, lists and tables."""
        return {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "tiengine_version": metadata.version("tiengine"),
            "plan": self.plan.model_dump(mode="json", exclude_none=True),
            "base": None if self.base is None else to_toml(self.base),
            "points": [{"changes": point.changes, "factors": point.factors} for point in self.points],
            "members": [[member.point, member.seed] for member in self.members],
            "tasks": self.tasks,
        }

    @classmethod
    def from_tables(cls, tables: dict[str, Any], where: str) -> Design:
        """Design from the contents of its file.

        Args:
            tables: Contents.
            where: Name of the file, for messages.

        Raises:
            InputError: It is no study of this program, or of another format version.
        """
        if tables.get("format") != FORMAT or tables.get("format_version") != FORMAT_VERSION:
            version = tables.get("format_version")
            raise InputError(
                f"{where}: no study of this program, or of another version ({version}; here {FORMAT_VERSION})"
            )
        try:
            base = tables["base"]
            return cls(
                build(Plan, to_tuples(tables["plan"])),
                None if base is None else load_scenario(parse_toml(base, f"{where}: base")),
                tuple(Point(to_tuples(each["changes"]), each["factors"]) for each in tables["points"]),
                tuple(Member(i, point, seed) for i, (point, seed) in enumerate(tables["members"])),
                tuple(tuple(task) for task in tables["tasks"]),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(f"{where}: damaged ({error})") from None


def expand(plan: Plan, folder: Path, together: int) -> Design:
    """Expand a plan and check the scenario of every train.

    Args:
        plan: The plan.
        folder: Where its relative paths start.
        together: Most trains that are advanced together.

    Raises:
        InputError: The first train whose scenario breaks a rule, with its values; or a rule of the plan.
    """
    points = points_of(plan, folder)
    seeds = _seeds(plan, len(points))
    if sum(map(len, seeds)) > MOST_MEMBERS:
        raise InputError(f"{plan.name}: {sum(map(len, seeds))} trains; must be at most {MOST_MEMBERS}")
    flat = [(point, seed) for point, own in enumerate(seeds) for seed in own]
    members = tuple(Member(i, point, seed) for i, (point, seed) in enumerate(flat))
    if plan.scenario is None:
        if plan.set:
            raise InputError("set: needs a scenario")
        return Design(plan, None, tuple(points), members, _cut(members, ["" for _ in points], together))
    base = _base(plan, folder)
    kinds, base = _checked(base, points, folder)
    return Design(plan, base, tuple(points), members, _cut(members, kinds, together))


def _base(plan: Plan, folder: Path) -> Scenario:
    """Scenario that all trains start from."""
    source: Any = plan.scenario
    if isinstance(source, str) and (folder / source).is_file():
        source = folder / source
    base = load_scenario(source, plan.set)
    if base.ensemble != type(base.ensemble)():
        raise InputError("scenario: has an [ensemble]; a study states its trains by seeds and factors")
    return base


def _checked(base: Scenario, points: Sequence[Point], folder: Path) -> tuple[list[str], Scenario]:
    """Check the scenario of every point.

    Returns:
        A text for every point that is the same for trains that can be advanced together, and the base with the presets
        of all of them.
    """
    from tiengine.simulation.tasks import likeness

    presets = {kind: dict(tables) for kind, tables in base.presets.items()}
    kinds: list[str] = []
    for number, point in enumerate(points):
        try:
            scenario = load_scenario(base, point.changes)
            if scenario.ensemble.size > 1:
                raise InputError("ensemble: cannot be a factor; a study states its trains by seeds and factors")
        except InputError as error:
            raise InputError(f"point {number} ({_words(point)}): {error}") from None
        for kind, tables in scenario.presets.items():
            presets.setdefault(kind, {}).update(tables)
        stated = ",".join(sorted(scenario.irregularity.model_dump(exclude_none=True)))
        kinds.append(f"{stated}\n{likeness(scenario)}")
    return kinds, base.model_copy(update={"presets": presets})


def _seeds(plan: Plan, points: int) -> list[Sequence[int | None]]:
    """Seeds of every point."""
    if plan.seeds is None:
        return [(None,)] * points
    if isinstance(plan.seeds, tuple):
        return [plan.seeds] * points
    count = plan.seeds
    return [range(1 + i * count, 1 + (i + 1) * count) if plan.own_seeds else range(1, 1 + count) for i in range(points)]


def _cut(members: Sequence[Member], kinds: Sequence[str], together: int) -> tuple[tuple[int, ...], ...]:
    """Tasks of like members, each group in pieces whose sizes differ by one at most.

    The bits of a train depend on the number of trains in its task, hence tasks follow from the plan alone.
    """
    groups: dict[str, list[int]] = {}
    for member in members:
        groups.setdefault(kinds[member.point], []).append(member.number)
    pieces = (np.array_split(group, ceil(len(group) / together)) for group in groups.values())
    return tuple(tuple(map(int, piece)) for group in pieces for piece in group)


def _words(point: Point) -> str:
    """Factors of a point, for messages."""
    return ", ".join(f"{name} = {value}" for name, value in point.factors.items()) or "no factors"


def _counts_up(seeds: Sequence[int]) -> bool:
    """Whether seeds follow each other, as those of an ensemble do."""
    return all(seed == seeds[0] + i for i, seed in enumerate(seeds))
