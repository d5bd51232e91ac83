"""Plan of a study: a base scenario, the factors that vary, seeds and constraints.

::

    scenario = "paper"                     # a preset, a file, or a table
    seeds = 10                             # trains of every point, which differ in their irregularity

    [set]
    "train.distance" = 100.0               # keys that are the same in all trains

    [[factors]]
    key = "train.speed_kmh"
    values = [300.0, 350.0]                # every value with every other factor

    [[factors]]
    key = "track.friction"
    range = [0.1, 0.5]                     # drawn, [sample] says how

    [sample]
    method = "latin_hypercube"
    size = 50

Any key of a scenario may be a factor: a number, the name of a preset, a file, a list of defects.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import load_toml, to_tuples
from tiengine.parameters.quantity import Name, Params, PlainName, Q, Source, build
from tiengine.scenario.overrides import Overrides, parse_value

__all__ = ["Factor", "Plan", "Sample", "Table", "load_plan"]

MOST_MEMBERS = 1_000_000

Seed = Annotated[int, Q("-", "seed of a realisation", ge=0, le=2**63 - 1)]


class Factor(Params):
    """A key of the scenario that varies, with its values, its range or its distribution."""

    key: Annotated[
        str | tuple[str, ...], Field(description="dotted key of the scenario; a list of keys takes the same value")
    ]
    name: Annotated[Name | None, Field(description="short name for tables, figures and constraints")] = None
    values: Annotated[tuple[Any, ...], Field(description="values, each combined with all other factors")] = ()
    labels: Annotated[
        tuple[float | str, ...], Field(description="what stands for each value in tables, where it is no number")
    ] = ()
    together: Annotated[
        str, Field(description="factors with the same word take their first values together, then their second")
    ] = ""
    range: Annotated[tuple[float, float] | None, Field(description="bounds of a uniform distribution")] = None
    distribution: Annotated[str | None, Field(description="name of a continuous distribution of scipy.stats")] = None
    parameters: Annotated[dict[str, float], Field(description="its parameters: loc, scale, and those of its shape")] = (
        Field(default_factory=dict)
    )
    whole: Annotated[bool, Field(description="drawn values are rounded to whole numbers")] = False

    @model_validator(mode="after")
    def _has_one_origin(self) -> Factor:
        stated = [name for name in ("values", "range", "distribution") if getattr(self, name) not in (None, ())]
        if len(stated) != 1:
            given = " and ".join(stated) or "none of them"
            raise InputError(f"factor {self.title!r}: must have values, range or distribution, has {given}")
        if self.labels and len(self.labels) != len(self.values):
            raise InputError(
                f"factor {self.title!r}: labels = {len(self.labels)} entries: must be one per value, {len(self.values)}"
            )
        if self.range is not None and not self.range[0] < self.range[1]:
            raise InputError(f"factor {self.title!r}: range = {list(self.range)}: the second bound must be the greater")
        if self.together and not self.values:
            raise InputError(f"factor {self.title!r}: together = {self.together!r}: only for factors with values")
        if self.parameters and self.distribution is None:
            raise InputError(f"factor {self.title!r}: parameters: only for a distribution")
        return self

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the scenario that take the value."""
        return (self.key,) if isinstance(self.key, str) else self.key

    @property
    def title(self) -> str:
        """Name in tables and messages: the stated one, or the end of the key."""
        return self.name if self.name is not None else self.keys[0].rpartition(".")[2]

    @property
    def drawn(self) -> bool:
        """Whether values are drawn from a range or a distribution."""
        return not self.values


class Sample(Params):
    """How the factors with a range or a distribution are drawn."""

    method: Annotated[
        Literal["latin_hypercube", "sobol", "halton", "random", "saltelli"],
        Field(
            description="latin_hypercube, sobol, halton (scipy.stats.qmc), random; saltelli is the design for Sobol'"
            " indices, size x (factors + 2) points"
        ),
    ] = "latin_hypercube"
    size: Annotated[int, Q("-", "number of points", ge=1, le=MOST_MEMBERS)]
    seed: Annotated[int, Q("-", "seed of the draw", ge=0, le=2**63 - 1)] = 1

    @field_validator("size")
    @classmethod
    def _fits(cls, size: int, info: ValidationInfo) -> int:
        if info.data.get("method") in ("sobol", "saltelli") and size & (size - 1):
            raise ValueError("must be a power of two for Sobol' points")
        return size


class Table(Params):
    """Points from the rows of a CSV file, whose first row holds keys or names of factors."""

    file: Annotated[str, Field(description="CSV file, relative to the plan")]


class Plan(Params):
    """A study."""

    name: PlainName = "study"
    source: Source = ""
    scenario: Annotated[
        str | dict[str, Any] | None, Field(description="preset, file relative to the plan, or table; the base of all")
    ] = None
    set: Annotated[dict[str, Any], Field(description="keys that are the same in all trains")] = Field(
        default_factory=dict
    )
    factors: Annotated[tuple[Factor, ...], Field(max_length=1000)] = ()
    sample: Sample | None = None
    table: Table | None = None
    seeds: Annotated[
        Annotated[int, Q("-", "number of seeds", ge=1, le=MOST_MEMBERS)] | tuple[Seed, ...] | None,
        Field(description="how many trains every point has, or their seeds; without it, one with the scenario's seed"),
    ] = None
    own_seeds: Annotated[
        bool, Field(description="every point has seeds of its own; otherwise all points run on the same tracks")
    ] = False
    constraints: Annotated[
        tuple[str, ...],
        Field(description="expressions of factors such as 'speed * friction < 120'; others are left out"),
    ] = ()

    quantities: Annotated[
        tuple[str, ...],
        Field(description="columns of key figures that the report shows in full; the first three if none"),
    ] = ()
    indices: Annotated[
        bool,
        Field(description="indices of the standards are evaluated besides the key figures; takes up to 0.2 s a train"),
    ] = False

    @model_validator(mode="after")
    def _is_whole(self) -> Plan:
        titles = [factor.title for factor in self.factors]
        for title in titles:
            if titles.count(title) > 1:
                raise InputError(f"factors: two are called {title!r}; each needs a name of its own")
        keys = [key for factor in self.factors for key in factor.keys]
        for key in keys:
            if keys.count(key) > 1:
                raise InputError(f"factors: two vary {key!r}; a key can have one factor")
        if self.seeds is not None and "irregularity.seed" in keys:
            raise InputError("seeds: must be left out where a factor varies irregularity.seed")
        if isinstance(self.seeds, tuple) and len(set(self.seeds)) < len(self.seeds):
            raise InputError("seeds: two are equal; each must be another")
        if isinstance(self.seeds, tuple) and self.own_seeds:
            raise InputError("own_seeds: needs the number of seeds, not a list of them")
        drawn = [factor.title for factor in self.factors if factor.drawn]
        if drawn and self.sample is None:
            raise InputError(f"factor {drawn[0]!r}: has a range or a distribution; [sample] must say how it is drawn")
        if self.sample is not None and not drawn:
            raise InputError("sample: no factor has a range or a distribution")
        if (
            self.sample is not None
            and self.sample.method == "saltelli"
            and (len(drawn) < len(self.factors) or self.table is not None or self.constraints)
        ):
            raise InputError(
                "sample.method = 'saltelli': all factors must have a range or a distribution, without table or"
                " constraints: Sobol' indices need the whole design"
            )
        return self

    def changed(self, settings: Overrides) -> Plan:
        """The plan with other keys set in all trains.

        Args:
            settings: As ``--set`` takes them.
        """
        if not settings:
            return self
        pairs = [text.partition("=") for text in settings] if not isinstance(settings, Mapping) else []
        if wrong := [key for key, sign, _ in pairs if not sign]:
            raise InputError(f"--set {wrong[0]!r}: must be KEY=VALUE, such as train.distance=20")
        stated = dict(settings) if isinstance(settings, Mapping) else {key: parse_value(v, key) for key, _, v in pairs}
        return self.model_copy(update={"set": {**self.set, **to_tuples(stated)}})


def load_plan(source: str | Path | Mapping[str, Any] | Plan) -> tuple[Plan, Path]:
    """Read a plan.

    Args:
        source: Path of a TOML file, tables, or a plan.

    Returns:
        The plan, and the folder where its relative paths start.

    Raises:
        InputError: The first value that breaks a rule.
    """
    if isinstance(source, Plan):
        return source, Path.cwd()
    if isinstance(source, Mapping):
        return build(Plan, to_tuples(dict(source))), Path.cwd()
    path = Path(source)
    tables = load_toml(path)
    tables.setdefault("name", path.stem)
    try:
        return build(Plan, tables), path.resolve().parent
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
