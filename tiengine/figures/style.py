"""Style of the figures: width of a text column, 8 pt, readable in print, in grey and with colour vision deficiency.

Figures use matplotlib's objects only, without a display and without pyplot's global state. Names from users' files pass
through :func:`plain`, since matplotlib reads text between dollar signs as a formula.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tiengine.figures.palette import BLACK, BLUE, VERMILION
from tiengine.parameters.errors import InputError

__all__ = ["LEFT", "RIGHT", "Look", "check_suffix", "in_style", "limit_line", "new_figure", "plain", "png", "save"]

P = ParamSpec("P")

WIDTH = 16.0  # cm, a text column of A4
CENTIMETRE = 1.0 / 2.54  # inches
DPI = 200  # of raster images

STYLE: Any = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.titlelocation": "left",
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "lines.linewidth": 0.9,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "figure.facecolor": "white",
    "svg.hashsalt": "tiengine",
}


class Look(NamedTuple):
    """Colour and dashes of a line; lines differ in both."""

    color: str
    linestyle: str


LEFT, RIGHT = Look(BLUE, "-"), Look(VERMILION, "--")
"""Lines of the left and the right side of the track."""


def in_style(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Make a drawing function use the style of this module, whatever the user's settings of matplotlib."""

    @wraps(draw)
    def styled(*arguments: P.args, **named: P.kwargs) -> Figure:
        with rc_context(STYLE):
            return draw(*arguments, **named)

    return styled


class Picture(Figure):
    """Figure that a notebook shows as it is saved."""

    def _repr_png_(self) -> bytes:
        """PNG file, as notebooks ask for it."""
        return png(self)


def new_figure(height: float, caption: str = "") -> Figure:
    """Create an empty figure of the standard width.

    Args:
        height: Height [cm].
        caption: Small text above the figure that says where the numbers come from.
    """
    figure = Picture(figsize=(WIDTH * CENTIMETRE, height * CENTIMETRE), layout="constrained")
    FigureCanvasAgg(figure)
    if caption:
        figure.suptitle(plain(caption), x=0.01, ha="left", fontsize=7.0, color="0.35")
    return figure


def plain(text: str) -> str:
    """Escape dollar signs, so that matplotlib prints the text as it is."""
    return text.replace("$", r"\$")


def limit_line(axes: Axes, value: float, label: str, *, below: bool = False, left: bool = False) -> None:
    """Draw a horizontal line with a label at one end.

    Args:
        axes: Axes to draw into.
        value: Ordinate [unit of the axis].
        label: Meaning of the line.
        below: Put the label below the line instead of above it.
        left: Put the label at the left end instead of the right one.
    """
    axes.axhline(value, color=BLACK, linewidth=0.8, linestyle=(0, (6, 2)))
    axes.annotate(
        label,
        (0.0 if left else 1.0, value),
        (2 if left else -2, -2 if below else 2),
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
        ha="left" if left else "right",
        va="top" if below else "bottom",
        fontsize=6.5,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8},
    )


def check_suffix(path: Path) -> None:
    """Refuse a path whose suffix is not a figure format.

    Raises:
        InputError: The suffix is unknown; the message lists the known ones.
    """
    known = FigureCanvasAgg.get_supported_filetypes()
    if path.suffix.lower().lstrip(".") not in known:
        raise InputError(f"output = {str(path)!r}: its suffix must be one of {', '.join(sorted(known))}")


def save(figure: Figure, path: Path) -> None:
    """Write a figure to a file, which it replaces.

    Args:
        figure: The figure.
        path: Path of the file; the suffix selects the format.

    Raises:
        InputError: The suffix is not a figure format, or the file cannot be written.
    """
    check_suffix(path)
    try:
        with _quiet():
            figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise InputError(f"output = {str(path)!r}: cannot be written ({error.strerror or error})") from None


def png(figure: Figure) -> bytes:
    """Render a figure as the bytes of a PNG file."""
    memory = io.BytesIO()
    with _quiet():
        figure.savefig(memory, dpi=DPI, format="png")
    return memory.getvalue()


@contextmanager
def _quiet() -> Iterator[None]:
    """Apply the style; letters that the font lacks, as in a Chinese name, become boxes without a warning."""
    with rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield
