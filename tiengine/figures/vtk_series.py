"""Scene of a train for ParaView: a .pvd file that lists one .vtu file a snapshot (VTK XML, version 1.0).

Rails are lines, slabs strips under them, bodies boxes, wheels octagons, on chainages x, lateral y to the right and z
up, in metres. Point data ``deflection`` [m] is down positive; cell data ``part`` is 0 rail, 1 slab, 2 car, 3 frame,
4 wheel, and ``force`` [N] the vertical force of a wheel. Deflections are not enlarged: ParaView's "Warp By Scalar" does
that.
"""

from __future__ import annotations

import base64
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.figures.scene import CAR, FRAME, Scene, read_scene
from tiengine.indices.train_record import Train
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.result_files.output_file import check_output
from tiengine.result_files.reader import Reader

__all__ = ["write_vtk"]

POLY_LINE, POLYGON, QUAD, HEXAHEDRON = 4, 7, 9, 12
"""Types of cells."""

PART = {"rail": 0, "slab": 1, CAR: 2, FRAME: 3, "wheel": 4}
HALF_WIDTH = {CAR: 1.6, FRAME: 1.1}  # m
LEVEL, HEIGHT = {CAR: 2.4, FRAME: 0.7}, {CAR: 2.6, FRAME: 0.4}  # m
SLAB_LEVEL = -0.25  # m, of the slab's surface below the rail
HALF_SLAB = 1.25  # m
CORNERS = 8  # of a wheel
TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}


def write_vtk(result: Reader, path: Path, train: int = 0) -> int:
    """Write the snapshots of a train.

    Args:
        result: An open file.
        path: File ending in ``.pvd``, replaced; the snapshots go to a folder beside it with its name.
        train: Number of the train.

    Returns:
        Number of snapshots.

    Raises:
        InputError: The suffix is another one, the file lacks what is shown, or the files cannot be written.
    """
    if path.suffix != ".pvd":
        raise InputError(f"output = '{path}': must end in .pvd")
    check_output(path, force=True)
    scene = read_scene(Train(result, train))
    entries = []
    try:
        folder = path.with_suffix("")
        folder.mkdir(exist_ok=True)
        for frame, time in enumerate(scene.time):
            name = f"{frame:05d}.vtu"
            (folder / name).write_text(_snapshot(scene, frame), encoding="ascii")
            entries.append(f'<DataSet timestep="{time:.9g}" part="0" file="{folder.name}/{name}"/>')
        listed = "\n".join(entries)
        path.write_text(
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n'
            f"<Collection>\n{listed}\n</Collection>\n</VTKFile>\n",
            encoding="utf-8",
        )
    except OSError as error:
        raise InputError(f"output = '{path}': cannot be written ({error.strerror or error})") from None
    return len(entries)


class _Grid:
    """Points and cells of one snapshot."""

    def __init__(self) -> None:
        self.points: list[Reals] = []
        self.deflection: list[Reals] = []
        self.connectivity: list[NDArray[np.int64]] = []
        self.types: list[int] = []
        self.parts: list[int] = []
        self.forces: list[float] = []
        self._count = 0

    def add_points(self, points: Reals, deflection: Reals) -> int:
        """Add points (n, 3) with their deflection (n,); return the number of the first."""
        first, self._count = self._count, self._count + len(points)
        self.points.append(points)
        self.deflection.append(deflection)
        return first

    def add_cell(self, kind: int, corners: Any, part: int, force: float = 0.0) -> None:
        """Add a cell over numbered points."""
        self.connectivity.append(np.asarray(corners, np.int64))
        self.types.append(kind)
        self.parts.append(part)
        self.forces.append(force)


def _snapshot(scene: Scene, frame: int) -> str:
    """One snapshot as XML."""
    grid = _Grid()
    _add_rails(grid, scene, frame)
    _add_slabs(grid, scene, frame)
    _add_bodies(grid, scene, frame)
    _add_wheels(grid, scene, frame)
    points, deflection = np.concatenate(grid.points), np.concatenate(grid.deflection)
    ends = np.cumsum([len(cell) for cell in grid.connectivity])
    return (
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"'
        ' header_type="UInt64">\n<UnstructuredGrid>\n'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(ends)}">\n'
        f"<Points>{_array('points', points, 3)}</Points>\n<Cells>"
        f"{_array('connectivity', np.concatenate(grid.connectivity))}{_array('offsets', ends.astype(np.int64))}"
        f"{_array('types', np.array(grid.types, np.uint8))}</Cells>\n"
        f"<PointData>{_array('deflection', deflection)}</PointData>\n"
        f"<CellData>{_array('part', np.array(grid.parts, np.int64))}"
        f"{_array('force', np.array(grid.forces))}</CellData>\n"
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    )


def _array(name: str, values: NDArray[Any], components: int = 1) -> str:
    """Array in base64, preceded by the number of its bytes."""
    content = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes()
    text = base64.b64encode(struct.pack("<Q", len(content)) + content).decode("ascii")
    kind = TYPES[values.dtype.name]
    return (
        f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">{text}</DataArray>'
    )


def _add_rails(grid: _Grid, scene: Scene, frame: int) -> None:
    """Two lines at the tape circles."""
    x = scene.position[frame] + scene.offset
    for side, y in enumerate((-scene.half_spacing, scene.half_spacing)):
        sunk = scene.rail[frame, side]
        first = grid.add_points(np.stack([x, np.full_like(x, y), -sunk], axis=1), sunk)
        grid.add_cell(POLY_LINE, first + np.arange(len(x)), PART["rail"])


def _add_slabs(grid: _Grid, scene: Scene, frame: int) -> None:
    """Strips between neighbouring points that lie on one slab; across, the deflection is linear."""
    x, sunk = scene.position[frame] + scene.offset, scene.slab[frame]
    middle, slope = sunk.mean(axis=0), (sunk[1] - sunk[0]) / (2.0 * scene.half_spacing)
    edges = [middle + y * slope for y in (-HALF_SLAB, HALF_SLAB)]
    firsts = []
    for y, edge in zip((-HALF_SLAB, HALF_SLAB), edges, strict=True):
        known = np.nan_to_num(edge)
        firsts.append(grid.add_points(np.stack([x, np.full_like(x, y), SLAB_LEVEL - known], axis=1), known))
    for i in np.flatnonzero(np.isfinite(middle[:-1]) & np.isfinite(middle[1:])):
        grid.add_cell(QUAD, [firsts[0] + i, firsts[0] + i + 1, firsts[1] + i + 1, firsts[1] + i], PART["slab"])


def _add_bodies(grid: _Grid, scene: Scene, frame: int) -> None:
    """Boxes of cars and frames."""
    unit = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], np.float64)
    for body, kind in enumerate(scene.body_kind):
        if kind not in LEVEL:
            continue
        sunk = float(scene.body_z[frame, body])
        plan = unit * (0.5 * scene.body_length[body], HALF_WIDTH[kind])
        plan[:, 0] += scene.position[frame] + scene.body_x[body]
        levels = [LEVEL[kind] - sunk + half * HEIGHT[kind] for half in (-0.5, 0.5)]
        corners = np.concatenate([np.column_stack([plan, np.full(4, z)]) for z in levels])
        first = grid.add_points(corners, np.full(8, sunk))
        grid.add_cell(HEXAHEDRON, first + np.arange(8), PART[kind])


def _add_wheels(grid: _Grid, scene: Scene, frame: int) -> None:
    """Octagons on the rails."""
    angle = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    for w, along in enumerate(scene.wheel_x):
        for side, y in enumerate((-scene.half_spacing, scene.half_spacing)):
            sunk = float(np.interp(along, scene.offset, scene.rail[frame, side]))
            x = scene.position[frame] + along + scene.wheel_radius * np.cos(angle)
            z = scene.wheel_radius * (1.0 + np.sin(angle)) - sunk
            first = grid.add_points(np.stack([x, np.full(CORNERS, y), z], axis=1), np.full(CORNERS, sunk))
            grid.add_cell(POLYGON, first + np.arange(CORNERS), PART["wheel"], float(scene.force[frame, w, side]))
