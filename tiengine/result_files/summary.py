"""Summary of a run: size, time step, speed and wall times, from the root attributes of its result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SUMMARY = {
    "trains": ("trains", "{:d}"),
    "workers": ("worker processes (0: in the main process)", "{:d}"),
    "dofs": ("degrees of freedom", "{:d}"),
    "time_step": ("time step", "{:.3g} s"),
    "simulated_time": ("simulated time", "{:.3f} s"),
    "real_time_factor": ("real-time factor (wall over simulated time)", "{:.2f}"),
    "wall_time_import": ("wall time, import", "{:.2f} s"),
    "wall_time_jit": ("wall time, JIT", "{:.2f} s"),
    "wall_time_setup": ("wall time, set-up", "{:.2f} s"),
    "wall_time_loop": ("wall time, loop", "{:.2f} s"),
    "wall_time_writing": ("wall time, writing", "{:.2f} s"),
    "wall_time_total": ("wall time, total without import", "{:.2f} s"),
    "peak_memory": ("peak memory, all processes", "{:.0f} MB"),
}
"""Root attributes that are shown, each with its description and number format."""

ENSEMBLE = {
    "simulated_time": "simulated time, sum of all trains",
    "real_time_factor": "real-time factor per train (wall time over the sum of simulated times)",
}
"""Descriptions that differ for an ensemble."""


def summary(attributes: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Descriptions and formatted values of a run.

    Args:
        attributes: Root attributes of its result.
    """
    special = {} if str(attributes.get("trains", 1)) == "1" else ENSEMBLE
    return [
        (special.get(key, words), _formatted(form, attributes[key]))
        for key, (words, form) in SUMMARY.items()
        if key in attributes
    ]


def _formatted(form: str, value: Any) -> str:
    """Formatted number; values of another type, as in a manipulated file, are returned as text."""
    try:
        return form.format(value)
    except (ValueError, TypeError):
        return str(value)
