"""The kinds of figures: names, headings, and what to look for; a kind's module is imported when it is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tiengine.result import Result

__all__ = ["COMPARE", "KINDS", "Kind", "kind_named", "names"]


@dataclass(frozen=True)
class Kind:
    """One kind of figure.

    Attributes:
        name: On the command line; the module ``tiengine.figures.<name>`` draws it.
        title: Heading in a report.
        look_for: One sentence for the reader.
        of_all: The figure shows all trains of a file, not one.
    """

    name: str
    title: str
    look_for: str
    of_all: bool = False

    def draw(self, result: Result, *arguments: Any) -> Figure:
        """Draw the figure.

        Args:
            result: An open file.
            arguments: Number of the train; before it, for ``compare``, the second file.

        Raises:
            InputError: The file cannot give it; an ``AbsentError`` (:mod:`tiengine.indices.train_record`)
                if it lacks a group.
        """
        figure: Figure = import_module(f"tiengine.figures.{self.name}").draw(result, *arguments)
        return figure


KINDS = (
    Kind(
        "forces",
        "Wheel forces",
        "Filtered forces of the leading wheelset should keep away from the dashed limits; where the grey band touches"
        " zero a wheel has left the rail.",
    ),
    Kind(
        "envelopes",
        "Fastenings and slabs",
        "A failed fastening's load goes to its neighbours: read their ratio to a sound seat in the upper picture, and"
        " see whether mortar pressure and bending moments rise at the same chainage.",
    ),
    Kind(
        "waterfall",
        "Deflection around the train",
        "Over sound track bands are straight and even; a weak place is a spot that the wheels meet one after the"
        " other. Every row is a snapshot (more of them by output.deflection_interval); white specks are joints.",
    ),
    Kind(
        "spectrum",
        "Spectra",
        "Peaks at the grey lines come from the track's own spacing or from the P2 resonance; what ends abruptly is the"
        " irregularity at its shortest wave.",
    ),
    Kind(
        "contact",
        "Contact positions",
        "Contact should stay on the tread; a second hump near the flange root (negative positions) is flange contact.",
    ),
    Kind(
        "ride",
        "Ride",
        "Accelerations that count for the ride, over either bogie; they should keep far from the dashed limit.",
    ),
    Kind(
        "gauges",
        "Gauges",
        "What an instrument at that place of the track would show; grey lines are the wheels that pass it.",
    ),
    Kind(
        "ensemble",
        "All trains",
        "The band holds nine trains out of ten; a place where all trains are high is one of the track, a single high"
        " train is one of its irregularity.",
        of_all=True,
    ),
)
COMPARE = Kind("compare", "Two results", "Where the difference stands out, something besides the numerics differs.")


def names() -> tuple[str, ...]:
    """Names on the command line."""
    return (*(kind.name for kind in KINDS), COMPARE.name)


def kind_named(name: str) -> Kind:
    """A kind by its name.

    Raises:
        InputError: There is none of that name.
    """
    for kind in (*KINDS, COMPARE):
        if kind.name == name:
            return kind
    raise InputError(f"kind = {name!r}: must be one of {', '.join(names())}")
