"""Dynamic interaction of trains and slab track in three dimensions, on a window of rail that moves with the train.

``run(scenario)`` simulates, ``resume(path)`` continues an interrupted run, ``open(path)`` reads a result file. Each is
imported at its first use, so that ``import tiengine`` itself is fast.
"""

from __future__ import annotations

from importlib import metadata
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tiengine.irregularity.track_function import TrackFunction as TrackFunction
    from tiengine.parameters.errors import InputError as InputError
    from tiengine.report.live_progress import LiveProgress as LiveProgress
    from tiengine.result import Result as Result
    from tiengine.result import open as open
    from tiengine.scenario.scenario import load_scenario as load_scenario
    from tiengine.simulation.simulate import resume as resume
    from tiengine.simulation.simulate import run as run
    from tiengine.study.study import Study as Study
    from tiengine.study.study import study as study

__version__ = metadata.version("tiengine")
__all__ = [
    "InputError",
    "LiveProgress",
    "Result",
    "Study",
    "TrackFunction",
    "load_scenario",
    "open",
    "resume",
    "run",
    "study",
]

_HOMES = {
    "InputError": "tiengine.parameters.errors",
    "LiveProgress": "tiengine.report.live_progress",
    "Result": "tiengine.result",
    "Study": "tiengine.study.study",
    "TrackFunction": "tiengine.irregularity.track_function",
    "load_scenario": "tiengine.scenario.scenario",
    "open": "tiengine.result",
    "resume": "tiengine.simulation.simulate",
    "run": "tiengine.simulation.simulate",
    "study": "tiengine.study.study",
}


def __getattr__(name: str) -> Any:
    """Import a public name at its first use."""
    from importlib import import_module

    if name not in _HOMES:
        raise AttributeError(f"module 'tiengine' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
