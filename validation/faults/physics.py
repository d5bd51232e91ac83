"""Diverging physics in one train of four: detected within a millisecond, named, without effect on the others."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from tiengine.engine import time_step as prepare
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.recording.guards import LIMITS
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate, time_loop
from validation.faults.contents import Contents, contents
from validation.faults.plan import SEED
from validation.faults.space import Check

__all__ = ["physics"]

TRAINS = 4
WITHIN = 1e-3  # s of simulated time
BLOCKS = {
    "vehicles": ("body", "damper"),
    "vertical": ("rail, vertically",),
    "lateral": ("rail, laterally",),
    "slabs": ("slab",),
}
"""Parts of the state, with the words that the message must contain."""

SETTINGS = ["train.distance=40", f"ensemble.size={TRAINS}", 'output.precision="double"']
Change = Callable[[Any, int], None]


def physics(folder: Path, repeats: int) -> list[Check]:
    """Insert NaN or growth at random steps in every part of the state.

    Args:
        folder: Folder of the results.
        repeats: Number of repeats of each.
    """
    rng = np.random.default_rng(SEED)
    scenario = load_scenario("paper", SETTINGS)
    path = folder / "undisturbed.h5"
    with simulate.run(scenario, path, workers=1) as result:
        steps, dt = int(result.facts(0)["steps"]), float(result.attributes["time_step"])
    reference, found = contents(path), []
    for kind in ("not a number", "growth"):
        for block in BLOCKS:
            for _ in range(repeats):
                train, step = int(rng.integers(TRAINS)), int(rng.integers(2, steps - 300))
                found.append(_disturbed(folder / "run.h5", scenario, reference, kind, block, train, step, dt, rng))
    return [*found, *(_unstable(folder / "run.h5", checked) for checked in (True, False))]


def _disturbed(
    path: Path, scenario: Any, reference: Contents, kind: str, block: str, train: int, step: int, dt: float, rng: Any
) -> Check:
    """Corrupt one train's state from a step on."""
    crossed: list[float] = []
    change = _nan(block, train, step, rng) if kind == "not a number" else _growth(block, train, step)
    with _spoiled(change, block, train, crossed, dt), simulate.run(scenario, path, workers=1, force=True) as result:
        failures, events = result.failures, result.group("events", train)
    words = f"{kind} in the {block} of train {train} from step {step}"
    bad = [] if list(failures) == [train] else [f"failed: {failures}"]
    late, named = float("nan"), False
    if not bad:
        caught, message = float(events["time"][-1]), str(events["message"][-1])
        late = caught - crossed[0]
        # a vehicle may be thrown off the rails before any of its numbers is large
        derailed = kind == "growth" and block == "vehicles" and "derailed" in message and caught >= step * dt - 1e-9
        bad += [] if derailed or -1e-9 <= late <= WITHIN + 1e-9 else [f"caught {late:g} s after it began"]
        named = derailed or any(word in message for word in BLOCKS[block])
        if not named and late < 0.5 * dt:  # later it has spread over the train through the wheels
            bad.append(f"names another part: {message}")
    found = contents(path)
    bad += [
        f"other bits: {name}"
        for name, value in reference.items()
        if name.startswith("trains/") and not name.startswith(f"trains/{train:03d}") and found.get(name) != value
    ]
    said = failures.get(train, "")
    return {"words": words, "good": not bad, "late": late, "named": named, "said": said, "wrong": bad[:5]}


def _nan(block: str, train: int, step: int, rng: Any) -> Change:
    """Set one coordinate, its rate or its acceleration to NaN at the end of a step."""
    row = int(rng.choice([at.U, at.V, at.A]))

    def change(state: Any, done: int) -> None:
        if done == step:
            part = state.view(row, block)[train]
            part.reshape(-1)[int(rng.integers(part.size))] = np.nan

    return change


def _growth(block: str, train: int, step: int) -> Change:
    """Let a part's motion grow by a half in every step, as in an unstable scheme."""

    def change(state: Any, done: int) -> None:
        if done >= step and np.isfinite(state.motion).all():
            for row in (at.U, at.V):
                state.view(row, block)[train] *= 1.5

    return change


@contextmanager
def _spoiled(change: Change, block: str, train: int, crossed: list[float], dt: float) -> Iterator[None]:
    """Runs whose steps end with a change of the state, before the guard looks; notes when a limit is passed."""
    begin = time_loop.Run.begin

    def spoiled(*arguments: Any, **options: Any) -> Any:
        run = begin(*arguments, **options)
        state, stepper = run.stepper.state, run.stepper

        def spoil() -> None:
            done = run.done + stepper.rows.step + 1
            change(state, done)
            if not crossed and not all(
                bool((np.abs(rows) < limit).all()) for rows, limit in zip(state.part(train, block), LIMITS, strict=True)
            ):
                crossed.append(done * dt)

        stepper.watch("faults", spoil, before="guards")
        return run

    time_loop.Run.begin = staticmethod(spoiled)  # type: ignore[method-assign]
    try:
        yield
    finally:
        time_loop.Run.begin = begin  # type: ignore[method-assign]


def _unstable(path: Path, checked: bool) -> Check:
    """Use a step that is far too long: refused at the start, and detected during the run if that check is removed."""
    words = f"numerics.time_step = 0.001, five times too long{'' if checked else ', past the check at the start'}"
    trial = vars(prepare)["_instability"]
    vars(prepare)["_instability"] = trial if checked else lambda *_: ""
    said, expected = "", (InputError,) if checked else (RunFailedError,)
    try:
        scenario = load_scenario("default", ["train.distance=60", "numerics.time_step=0.001"])
        simulate.run(scenario, path, workers=1, force=True).close()
    except expected as error:
        said = str(error)
    finally:
        vars(prepare)["_instability"] = trial
    return {"words": words, "good": bool(said), "said": said, "wrong": [] if said else ["not noticed"]}
