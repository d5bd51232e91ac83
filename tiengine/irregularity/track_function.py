"""Track given by a Python function of chainage, as passed to ``tiengine.run(scenario, irregularity=f)``.

The function may be sent to worker processes: it is pickled when its task is, and unpickled where it is first
evaluated, so that a function that a worker cannot import is reported as an input error of its trains.
"""

from __future__ import annotations

import functools
import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tiengine.irregularity.random_track import BlockSpline, sampled_spline
from tiengine.irregularity.spectrum import CHANNELS
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["TrackFunction", "TrackFunctions", "UserFunction", "recorded_name", "track_functions"]

UserFunction = Callable[[Reals], tuple[Reals | float, Reals | float, Reals | float, Reals | float]]
"""Chainages (n,) to z_v, y_a, theta, gauge [m, m, rad, m], each (n,) or a number."""


class TrackFunction:
    """Irregularity as a function of chainage.

    Attributes:
        name: Name of the function, as recorded with the result.
        spacing: Grid of the spline through its values [m].
    """

    def __init__(self, f: UserFunction, *, slopes: UserFunction | None = None, spacing: float = 0.05) -> None:
        """Keep the function.

        Args:
            f: Chainages (n,) to z_v, y_a, theta, g [m, m, rad, m], each (n,) or a number.
            slopes: The derivatives of f by chainage, in the same form. Without them f is replaced by the C2 spline
                through its values at multiples of ``spacing``, with an error of (2 pi spacing/lambda)^4/384; it is then
                evaluated in blocks of 4096 points, also ahead of the run and beyond its end.
            spacing: Grid of the spline [m].

        Raises:
            InputError: f is not callable, or ``spacing`` is not positive.
        """
        if not callable(f):
            raise InputError(f"irregularity = {f!r}: must be a function of chainage")
        if not spacing > 0.0:
            raise InputError(f"irregularity: spacing = {spacing:g}: must be > 0")
        self.name, self.spacing = _name(f), spacing
        self._functions: tuple[UserFunction, UserFunction | None] | None = (f, slopes)
        self._pickled = b""

    def check_picklable(self) -> None:
        """Refuse a function that cannot be sent to a worker process.

        Raises:
            InputError: It cannot be pickled.
        """
        self.__getstate__()

    def __getstate__(self) -> dict[str, Any]:
        """Pickle the functions by themselves, so that unpickling this object imports nothing.

        Raises:
            InputError: They cannot be pickled.
        """
        try:
            pickled = self._pickled or pickle.dumps(self._functions)
        except Exception as error:  # pickle raises various types for what it cannot handle
            raise InputError(
                f"irregularity: function {self.name!r} cannot be sent to worker processes ({error}); define it at the"
                " top level of a module, or run with workers=1"
            ) from None
        return {"name": self.name, "spacing": self.spacing, "_functions": None, "_pickled": pickled}

    def track(self) -> BlockSpline | _ExactTrack:
        """Build what evaluates values and slopes.

        Raises:
            InputError: A worker process cannot import the function.
        """
        f, slopes = self._unpickled()
        value = self._checked(f, "function")
        if slopes is None:
            return sampled_spline(value, self.spacing, len(CHANNELS))
        return _ExactTrack(value, self._checked(slopes, "slopes of function"))

    def _unpickled(self) -> tuple[UserFunction, UserFunction | None]:
        if self._functions is None:
            try:
                self._functions = pickle.loads(self._pickled)  # from the parent process only
            except Exception as error:  # whatever importing the module of the function raises
                raise InputError(
                    f"irregularity: function {self.name!r} cannot be loaded in a worker process ({error}); define it at"
                    " the top level of a module, or run with workers=1"
                ) from None
        assert self._functions is not None
        return self._functions

    def _checked(self, f: UserFunction, what: str) -> Callable[[Reals], Reals]:
        """Wrap a function: check its four series and stack them, (n,) to (n, 4)."""
        where = f"irregularity: {what} {self.name!r}"

        def stacked(x: Reals) -> Reals:
            try:
                series = tuple(f(x))
            except Exception as error:  # a user's function may raise anything
                raise InputError(f"{where}: fails between {x.min():g} and {x.max():g} m ({error!r})") from error
            if len(series) != len(CHANNELS):
                raise InputError(f"{where}: returns {len(series)} series; must return {len(CHANNELS)}")
            try:
                columns = [np.broadcast_to(np.asarray(each, np.float64), x.shape) for each in series]
            except (ValueError, TypeError):
                raise InputError(f"{where}: every series must be numbers in the shape of the chainages") from None
            if not np.isfinite(columns).all():
                raise InputError(f"{where}: must be finite everywhere")
            return np.stack(columns, axis=-1)

        return stacked


class _ExactTrack:
    """Track with the derivative that the user has given."""

    def __init__(self, value: Callable[[Reals], Reals], slope: Callable[[Reals], Reals]) -> None:
        self._value, self._slope = value, slope

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Values and slopes of the four channels at chainages x [m], shape (n,); each of shape (n, 4)."""
        return self._value(x), self._slope(x)


def _name(f: UserFunction) -> str:
    """Name of a function; of a partial one that of the function behind it, of an object that of its class."""
    while isinstance(f, functools.partial):
        f = f.func
    return str(getattr(f, "__qualname__", type(f).__qualname__))


TrackFunctions = UserFunction | TrackFunction | Sequence[UserFunction | TrackFunction]
"""A function for all trains of a run, or one for each."""


def track_functions(functions: TrackFunctions, trains: int) -> tuple[TrackFunction, ...]:
    """Give every train its function.

    Args:
        functions: One for all trains, or one for each.
        trains: Number of trains.

    Raises:
        InputError: Their number is not that of the trains, or one is not callable.
    """
    if not isinstance(functions, Sequence):
        functions = (functions,) * trains
    if len(functions) != trains:
        raise InputError(f"irregularity: {len(functions)} functions; must be one, or one for each of {trains} trains")
    return tuple(each if isinstance(each, TrackFunction) else TrackFunction(each) for each in functions)


def recorded_name(functions: Sequence[TrackFunction]) -> str:
    """Name under which the functions of a run are recorded: each different one once."""
    return ", ".join(dict.fromkeys(each.name for each in functions))
