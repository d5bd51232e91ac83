"""The engine's own profile of the paper's case, one train and 16 together: stages, products, roofline."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import RUNS, apart, settings_of

__all__ = ["roofline"]

TOGETHER = {"one": 1, "many": 16}
WAY = 600.0  # m, more than any profile needs


def roofline(effort: Effort) -> Findings:
    """Profile both runs."""
    values: dict[str, float | str] = {}
    data: dict[str, Any] = {}
    reports = apart(profiled, *((trains, max(200, effort.profile_steps // trains)) for trains in TOGETHER.values()))
    for (name, trains), report in zip(TOGETHER.items(), reports, strict=True):
        data[name] = report
        largest = max(report["stages"], key=lambda stage: stage["us_per_train_step"])
        rates = report["rates"]
        seconds = [rate["flops_per_step"] / rate["gflops"] * 1e-9 for rate in rates]
        floor = sum(rate["of_roof"] * time for rate, time in zip(rates, seconds, strict=True))
        values |= {
            f"{name}.largest": largest["name"],
            f"{name}.largest_share": largest["share"],
            f"{name}.kb_per_step": sum(rate["bytes_per_step"] for rate in rates) * 1e-3,
            f"{name}.mflop_per_step": sum(rate["flops_per_step"] for rate in rates) * 1e-6,
            f"{name}.product_us": sum(seconds) * 1e6 / trains,
            f"{name}.of_roof": floor / sum(seconds),
            f"{name}.us_per_train_step": report["loop"]["us_per_train_step"],
        }
    return Findings(values, data)


def profiled(trains: int, steps: int) -> dict[str, Any]:
    """Profile in JSON's types.

    Args:
        trains: Number of trains advanced together.
        steps: Number of measured steps.
    """
    from tiengine.profiling.profile import profile  # imported here, since the parent starts no Taichi
    from tiengine.scenario.scenario import load_scenario

    return asdict(profile(load_scenario("paper", settings_of(RUNS["paper"], WAY)), trains=trains, steps=steps))
