"""Kinds of figures: names, headings and captions; a kind's module is imported only when it is drawn."""

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
        name: Name on the command line; the module ``tiengine.figures.<name>`` draws it.
        title: Heading in a report.
        caption: One or two sentences that tell the reader how to judge the figure.
    """

    name: str
    title: str
    caption: str

    def draw(self, result: Result, *arguments: Any) -> Figure:
        """Draw the figure.

        Args:
            result: An open file.
            arguments: Number of the train; for ``compare`` preceded by the second file.

        Raises:
            InputError: The figure cannot be drawn from this file; an ``AbsentError``
                (:mod:`tiengine.indices.train_record`) if the file lacks what it needs.
        """
        figure: Figure = import_module(f"tiengine.figures.{self.name}").draw(result, *arguments)
        return figure


KINDS = (
    Kind(
        "forces",
        "Wheel forces",
        "The filtered forces of the leading wheelset, in trains of several vehicles of the worst one, should stay well"
        " within the dashed limits; where the grey band reaches zero, a wheel has lost contact with the rail.",
    ),
    Kind(
        "alignment",
        "Alignment",
        "Curvature, cant and gradient of the line that was run; the cant deficiency is what the wheels have to carry"
        " sideways, 153 mm for each m/s² of unbalanced acceleration.",
    ),
    Kind(
        "curving",
        "Forces in curves",
        "In an arc the forces settle to quasi-static values, the outer wheels carry more; jumps at the ends of"
        " transitions would point to a fault of the line.",
    ),
    Kind(
        "steering",
        "Steering",
        "A wheelset that stands radially has no yaw; a leading wheelset that yaws by several mrad in a sharp curve runs"
        " against the outer rail with its flange.",
    ),
    Kind(
        "envelopes",
        "Fastenings and slabs",
        "Neighbouring fastenings take over the load of a failed one: the upper panel shows their load relative to a"
        " sound seat; check whether mortar pressure and bending moments rise at the same chainage.",
    ),
    Kind(
        "waterfall",
        "Deflection around the train",
        "On sound track the bands are straight and uniform; a weak spot shows as a mark that the wheels reach one"
        " after another. Each row is a snapshot (output.deflection_interval sets their spacing); white dots are joints"
        " between slabs.",
    ),
    Kind(
        "spectrum",
        "Spectra",
        "Peaks at the grey lines come from the spacing of seats, slabs and wheelsets or from the P2 resonance; an"
        " abrupt end of a spectrum marks the shortest wavelength of the irregularity.",
    ),
    Kind(
        "contact",
        "Contact positions",
        "Contact should stay on the tread; a second peak near the flange root (negative positions) is flange contact."
        " Filled: the second patch, where wheels may have two.",
    ),
    Kind(
        "revolution",
        "Wheels out of round",
        "Peaks of the force that follow the tread, revolution after revolution, come from the wheel; the black line is"
        " the tread, much enlarged. Where the grey band reaches the middle, the wheel has lost contact.",
    ),
    Kind(
        "ride",
        "Ride",
        "Floor accelerations over the bogies, in trains of several vehicles of the worst one, filtered as the standards"
        " require; they should stay well within the dashed limit.",
    ),
    Kind(
        "gauges",
        "Gauges",
        "Signals that an instrument at that place of the track would record; grey lines mark the passing"
        " wheelsets, in trains of several vehicles grey stretches the passing vehicles.",
    ),
    Kind(
        "ensemble",
        "All trains",
        "The band contains nine out of ten trains; where all trains show high values the track is the cause, where a"
        " single train does it is its realisation of the irregularity.",
    ),
)
COMPARE = Kind(
    "compare", "Two results", "A difference well above the numerical error shows that more than the numerics differs."
)


def names() -> tuple[str, ...]:
    """Names of all kinds, as on the command line."""
    return (*(kind.name for kind in KINDS), COMPARE.name)


def kind_named(name: str) -> Kind:
    """Find a kind by its name.

    Raises:
        InputError: There is no such kind.
    """
    for kind in (*KINDS, COMPARE):
        if kind.name == name:
            return kind
    raise InputError(f"kind = {name!r}: must be one of {', '.join(names())}")
