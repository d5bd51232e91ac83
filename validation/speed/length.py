"""Run time and memory over distance."""

from __future__ import annotations

from collections.abc import Callable

from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import RUNS, apart, perform

__all__ = ["length"]


def length(effort: Effort, notify: Callable[[str], object]) -> Findings:
    """Run each distance once, each in a process of its own."""
    table = []
    for km in effort.lengths_km:
        notify(f"{km:g} km")
        (facts,) = apart(perform, (RUNS["kilometres"], 1e3 * km))
        table.append(
            {
                "length_km": km,
                "loop_s": facts["wall_time_loop"],
                "loop_s_per_km": facts["wall_time_loop"] / km,
                "peak_memory_mb": facts["peak_memory"],
                "file_mb": facts["file_mb"],
                "rtf": facts["real_time_factor"],
            }
        )
    per_km = [row["loop_s_per_km"] for row in table]
    return Findings(
        {
            "shortest_km": table[0]["length_km"],
            "longest_km": table[-1]["length_km"],
            "spread": max(per_km) / min(per_km),
            "s_per_km": table[-1]["loop_s_per_km"],
            "memory_growth_mb": table[-1]["peak_memory_mb"] - table[0]["peak_memory_mb"],
            "peak_memory_mb": table[-1]["peak_memory_mb"],
        },
        {"lengths": table},
    )
