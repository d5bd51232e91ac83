"""A run in a few lines: size, step, speed and wall times, from the root attributes of its result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SUMMARY = {
    "trains": ("trains", "{:d}"),
    "workers": ("worker processes (0: none but this one)", "{:d}"),
    "dofs": ("degrees of freedom", "{:d}"),
    "time_step": ("time step", "{:.3g} s"),
    "simulated_time": ("simulated time", "{:.3f} s"),
    "real_time_factor": ("real-time factor (wall over simulated time)", "{:.2f}"),
    "wall_time_import": ("wall time, import", "{:.2f} s"),
    "wall_time_jit": ("wall time, JIT", "{:.2f} s"),
    "wall_time_setup": ("wall time, set-up", "{:.2f} s"),
    "wall_time_loop": ("wall time, loop", "{:.2f} s"),
    "wall_time_writing": ("wall time, writing", "{:.2f} s"),
    "wall_time_total": ("wall time, all but import", "{:.2f} s"),
    "peak_memory": ("peak memory, all processes", "{:.0f} MB"),
}
"""Root attributes of a result that are shown: their words and format."""


def summary(attributes: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Size, step, speed and wall times of a run, from the root attributes of its result."""
    return [(words, _formatted(form, attributes[key])) for key, (words, form) in SUMMARY.items() if key in attributes]


def _formatted(form: str, value: Any) -> str:
    """A number as its form has it; what is none, as of a file that somebody changed, as it is."""
    try:
        return form.format(value)
    except (ValueError, TypeError):
        return str(value)
