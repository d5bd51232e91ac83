"""Animations and VTK files show what the result holds."""

from __future__ import annotations

import base64
import shutil
import struct
import xml.etree.ElementTree as ET
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from tiengine.figures.animation import Animation, animate
from tiengine.figures.scene import CAR, WHEELSET, read_scene
from tiengine.figures.vtk_series import write_vtk
from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate

SETTINGS = {"train.distance": 3.0, "numerics.time_step": 2e-4, "output.run_in": 0.0, "irregularity.scale": 0.0}


@pytest.fixture(scope="module")
def result():
    """A train over three metres with snapshots every 4 ms."""
    with simulate.run(load_scenario("default", SETTINGS | {"output.deflection_interval": 4e-3})) as result:
        yield result


@pytest.fixture(scope="module")
def scene(result):
    """Its scene."""
    return read_scene(Train(result))


def test_scene_is_that_of_the_result(result, scene):
    """Forces and displacements at the instants of the snapshots; bodies in their places."""
    bent, wheel = result.deflection(), result.wheel()
    assert len(scene.time) == len(bent["time"]) > 5
    row = int(np.argmin(np.abs(wheel["time"] - scene.time[3])))
    np.testing.assert_allclose(scene.force[3], wheel["vertical_force"][row])
    assert scene.body_kind.count(CAR) == 1
    assert scene.body_kind.count(WHEELSET) == 4
    assert sorted(scene.body_x[[kind == WHEELSET for kind in scene.body_kind]]) == sorted(scene.wheel_x)
    assert not scene.lifted.any()


def test_wheels_off_the_rail_are_marked(result, monkeypatch):
    """A wheel that has no force in one sample between two snapshots."""
    from tiengine.figures import scene as module

    force = np.ones((100, 4, 2))
    force[17, 2, 1] = 0.0
    found = module._lifted(force, np.array([0, 10, 20, 30]))
    assert np.argwhere(found).tolist() == [[2, 2, 1]]


def test_frames_follow_the_scene(scene):
    """Rails and bars of a frame."""
    shown = Animation(scene, "run", enlarged=100.0)
    shown.show(4)
    np.testing.assert_allclose(shown._rails[1].get_ydata(), -100.0 * scene.rail[4, 1])
    assert [bar.get_height() for bar in shown._of_wheels[0]] == pytest.approx(list(1e-3 * scene.force[4, :, 0]))


def test_gif_and_html(result, scene, tmp_path):
    """A frame a snapshot; the page holds its pictures itself."""
    assert animate(result, tmp_path / "train.gif") == len(scene.time)
    with Image.open(tmp_path / "train.gif") as picture:
        assert picture.n_frames == len(scene.time)
    animate(result, tmp_path / "train.html", fps=5)
    page = (tmp_path / "train.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64") == len(scene.time)


def test_bad_requests_are_refused(result, tmp_path):
    with pytest.raises(InputError, match="its suffix must be one of"):
        animate(result, tmp_path / "train.avi")
    if shutil.which("ffmpeg") is None:
        with pytest.raises(InputError, match=r"\.mp4 needs the program ffmpeg"):
            animate(result, tmp_path / "train.mp4")
    with pytest.raises(InputError, match=r"must end in \.pvd"):
        write_vtk(result, tmp_path / "train.vtu")
    with (
        simulate.run(load_scenario("default", SETTINGS | {"output.deflection_interval": "none"})) as bare,
        pytest.raises(AbsentError, match=r"output\.deflection_interval"),
    ):
        animate(bare, tmp_path / "train.gif")


def array(node: ET.Element) -> np.ndarray:
    """Array of a VTK file, as its format describes it: base64 of the number of bytes and the bytes."""
    content = base64.b64decode(node.text or "")
    (size,) = struct.unpack("<Q", content[:8])
    assert size == len(content) - 8
    kind = {"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}[node.attrib["type"]]
    return np.frombuffer(content[8:], kind).reshape(-1, int(node.attrib["NumberOfComponents"]))


def test_vtk_series(result, scene, tmp_path):
    """Times of the collection; rails at their deflection, wheels with their forces, cells within the points."""
    assert write_vtk(result, tmp_path / "run.pvd") == len(scene.time)
    listed = ET.parse(tmp_path / "run.pvd").getroot().findall(".//DataSet")
    assert [float(each.attrib["timestep"]) for each in listed] == pytest.approx(list(scene.time), abs=1e-8)
    root = ET.parse(tmp_path / listed[2].attrib["file"]).getroot()
    found = {node.attrib["Name"]: array(node) for node in root.findall(".//DataArray")}
    count = len(scene.offset)
    np.testing.assert_allclose(found["points"][:count, 2], -scene.rail[2, 0])
    np.testing.assert_allclose(found["points"][:count, 0], scene.position[2] + scene.offset)
    ends = [0, *found["offsets"][:, 0]]
    cells = [found["connectivity"][a:b, 0] for a, b in pairwise(ends)]
    assert max(cell.max() for cell in cells) < len(found["points"])
    wheels = found["part"][:, 0] == 4
    np.testing.assert_allclose(found["force"][wheels, 0], scene.force[2].reshape(-1))
    corners = {4: count, 7: 8, 9: 4, 12: 8}
    assert [len(cell) for cell in cells] == [corners[kind] for kind in found["types"][:, 0]]
