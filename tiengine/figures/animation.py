"""Animation of a train: bodies over the window, deflection of rails and slabs enlarged, wheel forces as bars."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import animation, rc_context
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, FancyBboxPatch

from tiengine.figures.palette import BLACK, GREY, ORANGE, SKY, VERMILION
from tiengine.figures.scene import CAR, FRAME, Scene, read_scene
from tiengine.figures.style import LEFT, RIGHT, STYLE, new_figure
from tiengine.indices.train_record import Train
from tiengine.parameters.errors import InputError
from tiengine.result_files.output_file import check_output
from tiengine.result_files.reader import Reader

__all__ = ["SUFFIXES", "Animation", "animate"]

SUFFIXES = (".gif", ".mp4", ".html")
ENLARGED = 500.0  # times, of deflections: 1 mm becomes 0.5 m
MOST_DRAWN = 200  # frames of a file
MARGIN = 4.0  # m beyond the outer wheels
DPI = 100
LEVEL = {CAR: 2.4, FRAME: 1.0}  # m above the rails, of the middle of a body
HEIGHT = {CAR: 2.3, FRAME: 0.45}  # m


class Animation:
    """Figure of a scene whose frames are drawn one by one.

    Attributes:
        figure: The figure.
        frames: Numbers of the snapshots that are shown.
    """

    def __init__(self, scene: Scene, caption: str, enlarged: float = ENLARGED) -> None:
        """Draw the first frame.

        Args:
            scene: Snapshots of a train.
            caption: Small text above the figure.
            enlarged: Factor on deflections and on displacements of the bodies.
        """
        self._scene, self._enlarged = scene, enlarged
        self.frames = np.unique(np.linspace(0, len(scene.time) - 1, min(len(scene.time), MOST_DRAWN)).astype(int))
        self.figure: Figure = new_figure(10.5, f"{caption}: deflections {enlarged:g} times enlarged")
        self._side, self._bars = self.figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        low, high = scene.wheel_x.min() - MARGIN, scene.wheel_x.max() + MARGIN
        self._side.set(xlim=(max(low, scene.offset[0]), min(high, scene.offset[-1])), ylim=(-1.7, 4.0), yticks=[])
        self._side.set_facecolor("#F7F9FB")
        self._draw_track()
        self._draw_bodies()
        self._draw_forces()
        self.show(0)

    def show(self, frame: int) -> None:
        """Draw a snapshot.

        Args:
            frame: Its number.
        """
        scene, scale = self._scene, self._enlarged
        for line, side in zip(self._rails, (0, 1), strict=True):
            line.set_ydata(-scale * scene.rail[frame, side])
        for line, side in zip(self._slabs, (0, 1), strict=True):
            line.set_ydata(-0.55 - scale * scene.slab[frame, side])
        moved = -scale * (scene.body_z[frame] - scene.body_z.mean(axis=0))
        for patch, body in self._boxes:
            patch.set_y(LEVEL[scene.body_kind[body]] - 0.5 * HEIGHT[scene.body_kind[body]] + moved[body])
        for w, wheel in enumerate(self._wheels):
            sunk = np.interp(scene.wheel_x[w], scene.offset, scene.rail[frame].mean(axis=0))
            off = bool(scene.lifted[frame, w].any())
            wheel.set_center((scene.wheel_x[w], scene.wheel_radius - scale * sunk + 0.25 * off))
            wheel.set_facecolor(VERMILION if off else GREY)
        for side, bars in enumerate(self._of_wheels):
            for w, bar in enumerate(bars):
                bar.set_height(1e-3 * scene.force[frame, w, side])
        self._text.set_text(f"t = {scene.time[frame]:.3f} s, chainage {scene.position[frame]:.1f} m")

    def _draw_track(self) -> None:
        """Lines of rails and slabs."""
        x = self._scene.offset
        self._rails = [
            self._side.plot(
                x, 0.0 * x, color=look.color, linestyle=look.linestyle, linewidth=1.6, label=f"{name} rail"
            )[0]
            for look, name in ((LEFT, "left"), (RIGHT, "right"))
        ]
        self._slabs = [
            self._side.plot(x, 0.0 * x, color=color, linewidth=4.0, solid_capstyle="butt", label=label)[0]
            for color, label in ((GREY, "slab, left"), (SKY, "slab, right"))
        ]
        self._side.legend(loc="lower right", ncols=4)
        self._text = self._side.text(0.01, 0.96, "", transform=self._side.transAxes, va="top", fontsize=8.0)

    def _draw_bodies(self) -> None:
        """Boxes of cars and frames, and wheels."""
        scene = self._scene
        self._boxes: list[tuple[Any, int]] = []
        for body, kind in enumerate(scene.body_kind):
            if kind not in LEVEL:
                continue
            corner = (scene.body_x[body] - 0.5 * scene.body_length[body], LEVEL[kind] - 0.5 * HEIGHT[kind])
            color = "#DCE8F2" if kind == CAR else ORANGE
            box = FancyBboxPatch(
                corner, scene.body_length[body], HEIGHT[kind], boxstyle="round,pad=0,rounding_size=0.25",
                facecolor=color, edgecolor=BLACK, linewidth=0.8,
            )  # fmt: skip
            self._boxes.append((self._side.add_patch(box), body))
        self.figure.draw_without_rendering()  # lays the panels out, whose scales make a wheel round
        box, radius = self._side.get_window_extent(), scene.wheel_radius
        across, up = np.ptp(self._side.get_xlim()) / box.width, np.ptp(self._side.get_ylim()) / box.height
        width = 2.0 * radius * across / up
        self._wheels = [
            self._side.add_patch(Ellipse((x, radius), width, 2.0 * radius, edgecolor=BLACK, facecolor=GREY))
            for x in scene.wheel_x
        ]

    def _draw_forces(self) -> None:
        """Bars of the vertical wheel forces."""
        scene = self._scene
        self._of_wheels = [
            self._bars.bar(scene.wheel_x + shift, np.zeros(len(scene.wheel_x)), 0.5, color=look.color, label=name)
            for look, shift, name in ((LEFT, -0.28, "left"), (RIGHT, 0.28, "right"))
        ]
        top = 1e-3 * float(np.nanmax(scene.force))
        mean = 1e-3 * float(scene.force.mean())
        self._bars.axhline(mean, color=BLACK, linewidth=0.7, linestyle=":")
        self._bars.set(ylim=(0.0, 1.08 * top), ylabel="Q [kN]", xlabel="ahead of the first vehicle's centre [m]")
        self._bars.legend(loc="upper right", ncols=2)


def animate(result: Reader, path: Path, train: int = 0, *, fps: int = 20, enlarged: float = ENLARGED) -> int:
    """Write an animation of a train.

    Args:
        result: An open file.
        path: File to write, replacing it: ``.gif`` (Pillow), ``.mp4`` (needs ffmpeg), ``.html`` (a page with buttons).
        train: Number of the train.
        fps: Frames a second.
        enlarged: Factor on deflections.

    Returns:
        Number of frames.

    Raises:
        InputError: The suffix is another one, ffmpeg is missing, or the file lacks what the animation shows.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"output = {str(path)!r}: its suffix must be one of {', '.join(SUFFIXES)}")
    if not (1 <= fps <= 120 and 1.0 <= enlarged <= 1e5):
        raise InputError(f"fps = {fps}, enlarged = {enlarged:g}: must be from 1 to 120 and from 1 to 1e5")
    check_output(path, force=True)
    writer = _writer(path, fps)
    with rc_context({**STYLE, "savefig.bbox": "standard", "animation.embed_limit": 200.0}):
        caption = Train(result, train)
        shown = Animation(read_scene(caption), caption.caption, enlarged)
        try:
            with writer.saving(shown.figure, str(path), DPI):
                for frame in shown.frames:
                    shown.show(int(frame))
                    writer.grab_frame()
        except OSError as error:
            raise InputError(f"output = {str(path)!r}: cannot be written ({error.strerror or error})") from None
    return len(shown.frames)


def _writer(path: Path, fps: int) -> Any:
    """Writer for the suffix of a file."""
    suffix = path.suffix.lower()
    if suffix == ".gif":
        return animation.PillowWriter(fps=fps)
    if suffix == ".html":
        return animation.HTMLWriter(fps=fps, embed_frames=True, default_mode="loop")
    if not animation.FFMpegWriter.isAvailable():
        raise InputError(f"output = {str(path)!r}: .mp4 needs the program ffmpeg; write .gif or .html")
    return animation.FFMpegWriter(fps=fps)
