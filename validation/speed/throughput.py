"""One train and 64 trains: real-time factors of the loop, writing included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from validation.speed.findings import Findings
from validation.speed.runs import Facts, median_of

__all__ = ["batch", "factors", "one_train", "step_us"]

Rounds = Mapping[str, Sequence[Facts]]


def step_us(facts: Sequence[Facts]) -> float:
    """Wall time of a step of one train [us], median over rounds."""
    return 1e6 * median_of(facts, "real_time_factor") * float(facts[0]["time_step"])


def one_train(rounds: Rounds) -> Findings:
    """Runs ``paper`` and ``default``."""
    paper, default = rounds["paper"], rounds["default"]
    return Findings(
        {
            "rtf": median_of(paper, "real_time_factor"),
            "rtf_default": median_of(default, "real_time_factor"),
            "us_per_step": step_us(paper),
            "us_per_step_default": step_us(default),
            "dofs": float(paper[0]["dofs"]),
            "dofs_default": float(default[0]["dofs"]),
            "peak_memory_mb": median_of(paper, "peak_memory"),
        },
        {"rounds": factors(rounds, ("paper", "default"))},
    )


def batch(rounds: Rounds) -> Findings:
    """Runs ``batch``, ``batch_one_worker``, ``batch_threads``."""
    two, one, threads = (median_of(rounds[name], "real_time_factor") for name in _BATCHES)
    trains, dt = 64.0, float(rounds["batch"][0]["time_step"])
    return Findings(
        {
            "trains": trains,
            "rtf_per_train": two,
            "rtf_per_train_one_worker": one,
            "rtf_per_train_threads": threads,
            "core_us_per_train_step": 2e6 * two * dt,
            "gain_of_workers": one / two,
            "processes_over_threads": threads / two,
            "peak_memory_mb": median_of(rounds["batch"], "peak_memory"),
            "peak_memory_one_worker_mb": median_of(rounds["batch_one_worker"], "peak_memory"),
        },
        {"rounds": factors(rounds, _BATCHES)},
    )


def factors(rounds: Rounds, names: Sequence[str]) -> dict[str, dict[str, list[float]]]:
    """Real-time factor of every round, and cores used by other processes meanwhile, by run."""
    keys = {"rtf": "real_time_factor", "others_cores": "others_cores"}
    return {name: {key: [float(each[fact]) for each in rounds[name]] for key, fact in keys.items()} for name in names}


_BATCHES = ("batch", "batch_one_worker", "batch_threads")
