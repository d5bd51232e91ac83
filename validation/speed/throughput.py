"""Single trains and batches: real-time factors of the loop, writing included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from validation.speed.findings import Findings
from validation.speed.runs import Facts, median_of

__all__ = ["BATCHES", "ONE_CAR", "TRAINS", "batch", "factors", "one_car", "step_us", "trains"]

Rounds = Mapping[str, Sequence[Facts]]

ONE_CAR = ("default", "paper")
TRAINS = ("train8", "train16")
BATCHES = ("batch", "batch_one_worker", "batch8")
"""Runs of the cases."""

WORKERS = 2


def step_us(facts: Sequence[Facts]) -> float:
    """Wall time of a step of one train [us], median over rounds."""
    return 1e6 * median_of(facts, "real_time_factor") * float(facts[0]["time_step"])


def one_car(rounds: Rounds) -> Findings:
    """Runs ``default`` and ``paper``."""
    values = {"peak_memory_mb": median_of(rounds["default"], "peak_memory")}
    for name in ONE_CAR:
        facts = rounds[name]
        values |= {
            f"rtf_{name}": median_of(facts, "real_time_factor"),
            f"us_{name}": step_us(facts),
            f"dofs_{name}": float(facts[0]["dofs"]),
        }
    return Findings({**values}, {"rounds": factors(rounds, ONE_CAR)})


def trains(rounds: Rounds) -> Findings:
    """Runs ``train8`` and ``train16``."""
    values: dict[str, float] = {}
    for name in TRAINS:
        facts = rounds[name]
        values |= {
            f"rtf_{name}": median_of(facts, "real_time_factor"),
            f"us_{name}": step_us(facts),
            f"setup_{name}_s": median_of(facts, "wall_time_setup"),
            f"peak_memory_{name}_mb": median_of(facts, "peak_memory"),
        }
    values["ratio_train16"] = values["rtf_train16"] / values["rtf_train8"]
    return Findings({**values}, {"rounds": factors(rounds, TRAINS)})


def batch(rounds: Rounds) -> Findings:
    """Runs ``batch``, ``batch_one_worker``, ``batch8``."""
    two, one, eight = (median_of(rounds[name], "real_time_factor") for name in BATCHES)
    us, us8 = (1e6 * rtf * float(rounds[name][0]["time_step"]) for rtf, name in ((two, "batch"), (eight, "batch8")))
    return Findings(
        {
            "rtf_per_train": two,
            "rtf_per_train_one_worker": one,
            "rtf_per_train8": eight,
            "core_us_per_train_step": WORKERS * us,
            "core_us_per_train8_step": WORKERS * us8,
            "gain_of_workers": one / two,
            "peak_memory_mb": median_of(rounds["batch"], "peak_memory"),
            "peak_memory_one_worker_mb": median_of(rounds["batch_one_worker"], "peak_memory"),
            "peak_memory_batch8_mb": median_of(rounds["batch8"], "peak_memory"),
        },
        {"rounds": factors(rounds, BATCHES)},
    )


def factors(rounds: Rounds, names: Sequence[str]) -> dict[str, dict[str, list[float]]]:
    """Real-time factor of every round, and cores used by other processes meanwhile, by run."""
    keys = {"rtf": "real_time_factor", "others_cores": "others_cores"}
    return {name: {key: [float(each[fact]) for each in rounds[name]] for key, fact in keys.items()} for name in names}
