"""The common opening of figures that show one train of a result."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Protocol

from tiengine.figures.style import in_style
from tiengine.indices.train_record import Train

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tiengine.result import Result

__all__ = ["OneTrainFigure", "of_one_train"]


class OneTrainFigure(Protocol):
    """A function that draws one train of a result."""

    def __call__(self, result: Result, train: int = 0) -> Figure:
        """Draw the figure.

        Args:
            result: An open file.
            train: Number of the train.

        Raises:
            InputError: There is no such train.
            AbsentError: The file lacks what the figure needs.
        """


def of_one_train(draw: Callable[[Train], Figure]) -> OneTrainFigure:
    """Turn a function that draws a train into one that draws a train of a result, in the common style."""

    @in_style
    @wraps(draw)
    def drawn(result: Result, train: int = 0) -> Figure:
        return draw(Train(result, train))

    return drawn
