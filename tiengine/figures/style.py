"""How figures look: as wide as a text column, 8 pt, for print, for grey and for colour-blind eyes.

Figures are made with matplotlib's objects alone: no display, no state of pyplot. Names from users' files go through
:func:`plain`, since matplotlib takes what stands between dollar signs for a formula.
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
DPI = 200  # of pictures made of points

RULES: Any = {
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
    """Colour and dashes of a line; either alone tells lines apart."""

    color: str
    linestyle: str


LEFT, RIGHT = Look(BLUE, "-"), Look(VERMILION, "--")
"""Lines of the left and the right side of the track."""


def in_style(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw with the rules of this module, whatever the user's settings of matplotlib."""

    @wraps(draw)
    def styled(*arguments: P.args, **named: P.kwargs) -> Figure:
        with rc_context(RULES):
            return draw(*arguments, **named)

    return styled


def new_figure(height: float, caption: str = "") -> Figure:
    """An empty figure of the house's width.

    Args:
        height: [cm].
        caption: Where the numbers come from, small, above the figure.
    """
    figure = Figure(figsize=(WIDTH * CENTIMETRE, height * CENTIMETRE), layout="constrained")
    FigureCanvasAgg(figure)
    if caption:
        figure.suptitle(plain(caption), x=0.01, ha="left", fontsize=7.0, color="0.35")
    return figure


def plain(text: str) -> str:
    """A text that is no formula."""
    return text.replace("$", r"\$")


def limit_line(axes: Axes, value: float, words: str, *, below: bool = False, left: bool = False) -> None:
    """A horizontal line with its meaning at one end.

    Args:
        axes: Where.
        value: In the unit of the axis.
        words: What the line means.
        below: Write below the line instead of above it.
        left: Write at the left end instead of the right one.
    """
    axes.axhline(value, color=BLACK, linewidth=0.8, linestyle=(0, (6, 2)))
    axes.annotate(
        words,
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
    """Refuse a path whose suffix is no format of figures.

    Raises:
        InputError: Names the suffixes.
    """
    known = FigureCanvasAgg.get_supported_filetypes()
    if path.suffix.lower().lstrip(".") not in known:
        raise InputError(f"output = {str(path)!r}: its suffix must be one of {', '.join(sorted(known))}")


def save(figure: Figure, path: Path) -> None:
    """Write a figure, replacing a file.

    Args:
        figure: What to write.
        path: Where; the suffix tells the format.

    Raises:
        InputError: A suffix that is no format of figures, or a file that cannot be written.
    """
    check_suffix(path)
    try:
        with _quiet():
            figure.savefig(path, dpi=DPI)
    except OSError as error:
        raise InputError(f"output = {str(path)!r}: cannot be written ({error.strerror or error})") from None


def png(figure: Figure) -> bytes:
    """A figure as the bytes of a PNG file."""
    memory = io.BytesIO()
    with _quiet():
        figure.savefig(memory, dpi=DPI, format="png")
    return memory.getvalue()


@contextmanager
def _quiet() -> Iterator[None]:
    """The house's rules; letters that the font lacks, as in a name in Chinese, become boxes without a warning."""
    with rc_context(RULES), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield
