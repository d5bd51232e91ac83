"""Bands of the wheel forces over the chainage, from the parts of a study, of which one is open at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from tiengine.figures.ensemble import draw_bands, stretch_extremes, stretches
from tiengine.indices.train_record import AbsentError, Samples, Train
from tiengine.result_files.reader import COMPLETE, open_reader
from tiengine.study.folder import Folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_study_bands"]

MOST_TRAINS = 400
LEAST_TRAINS = 3


def draw_study_bands(folder: Folder) -> Figure:
    """Draw extremes of the wheel forces in stretches of the chainage over the first trains of a study.

    Args:
        folder: Folder of the study.

    Raises:
        AbsentError: There are fewer than three complete trains, or their parts hold no wheel forces.
    """
    ranges = [(number, run.chainage_range, lead, several) for number, run, lead, several in _runs(folder)]
    if len(ranges) < LEAST_TRAINS:
        raise AbsentError(f"{folder.path}: {len(ranges)} complete train(s) with parts; bands need {LEAST_TRAINS}")
    begin = min(reach[0] + lead for _, reach, lead, _ in ranges)
    end = max(reach[1] + lead for _, reach, lead, _ in ranges)
    bins, several = stretches(begin, end), any(each for *_, each in ranges)
    runs = _runs(folder)
    extremes = np.stack([stretch_extremes(run, begin, end, bins, several=several) for _, run, _, _ in runs])
    whose = "all wheelsets" if several else "leading wheelset"
    return draw_bands(extremes, begin, end, [number for number, *_ in ranges], f"{folder.path.name}: {whose}")


def _runs(folder: Folder) -> Iterator[tuple[int, Samples, float, bool]]:
    """Number, wheel forces, place of the leading wheelset [m], whether there are several vehicles; train by train."""
    count = 0
    for task in sorted(folder.complete()):
        if not folder.part(task).exists():
            continue
        with open_reader(folder.part(task)) as part:
            for place, member in enumerate(folder.design.tasks[task]):
                if part.status(place) != COMPLETE or count >= MOST_TRAINS:
                    continue
                count += 1
                run = Train(part, place).samples("wheel", "vertical_force", "lateral_force")
                lead = float(run.group["wheelset_offset"][0])
                yield member, run, lead, len(part.facts(place)["vehicles"]) > 1
