"""Parts of a study copied into one result file, which reads as that of an ensemble."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py

from tiengine.parameters.errors import InputError
from tiengine.result_files.export import replacing
from tiengine.result_files.output_file import check_output, header
from tiengine.result_files.reader import COMPLETE, open_reader
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.study.design import Design
from tiengine.study.folder import Folder

__all__ = ["merge"]


def merge(folder: Folder, path: Path, *, force: bool = False) -> int:
    """Copy the trains of a complete study into one file.

    Args:
        folder: Folder of the study.
        path: File to write.
        force: Replace an existing file.

    Returns:
        Number of trains.

    Raises:
        InputError: The study is not complete, or its factors cannot vary within one file.
    """
    check_output(path, force)
    if left := folder.left():
        raise InputError(f"{folder.path}: {len(left)} tasks are not complete; resume the study first")
    scenario = _ensemble(folder.design)
    failed = 0
    with replacing(path) as temporary, h5py.File(temporary, "w", libver=("v110", "v110")) as file:
        trains = file.create_group("trains")
        for task, members in enumerate(folder.design.tasks):
            if not folder.part(task).exists():
                raise InputError(f"{folder.part(task)}: missing; its trains were refused or the part was removed")
            with open_reader(folder.part(task)) as part:
                for place, member in enumerate(members):
                    part.file.copy(f"trains/{place:03d}", trains, name=f"{member:03d}")
                    failed += part.status(place) != COMPLETE
        status = COMPLETE if not failed else f"{failed} of {len(folder.design.members)} trains failed"
        count = {"trains": len(folder.design.members)}
        file.attrs.update({**header(to_toml(scenario)), "status": status, **count, **_sums(folder)})
    return len(folder.design.members)


def _sums(folder: Folder) -> dict[str, Any]:
    """Simulated time of all trains [s]."""
    times = [train.get("simulated_time", 0.0) for record in folder.records() for train in record["trains"]]
    return {"simulated_time": float(sum(times))}


def _ensemble(design: Design) -> Scenario:
    """Scenario of all trains as one ensemble.

    Raises:
        InputError: A factor is not a key that may vary within an ensemble, or the study has no scenario.
    """
    if design.base is None:
        raise InputError(f"{design.plan.name}: the study has no scenario; there are no parts to merge")
    if len(design.members) == 1:
        return load_scenario(design.base, design.points[0].changes)
    changes = [design.points[member.point].changes for member in design.members]
    vary: dict[str, Any] = {key: tuple(each[key] for each in changes) for key in changes[0]}
    if any(member.seed is not None for member in design.members):
        vary["irregularity.seed"] = tuple(member.seed for member in design.members)
    else:
        vary.setdefault("irregularity.seed", (design.base.irregularity.seed,))
    return load_scenario(design.base, {"ensemble": {"size": len(design.members), "vary": vary}})
