"""Contact positions on wheels and rails: shares of time along the profiles, of both patches where wheels have two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tiengine.figures.one_train import of_one_train
from tiengine.figures.palette import BLACK
from tiengine.figures.style import LEFT, RIGHT, new_figure, plain
from tiengine.indices.train_record import AbsentError, Train
from tiengine.indices.wheel_extremes import first_samples
from tiengine.parameters.arrays import Reals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tiengine.contact.profile import Profile

__all__ = ["draw"]

BIN = 0.25e-3  # m along the profile
MARGIN = 4e-3  # m beyond the outermost contact
LEAST_SHARE = 0.01
"""Part of a wheel's normal force from which one of its two patches counts."""


@of_one_train
def draw(train: Train) -> Figure:
    """Draw histograms of the contact positions of all left and all right wheels above the profile they touch.

    Samples at which a wheel is off the rail are left out, and so is the run-in of every wheelset. If wheels have two
    patches, both count where they carry load, and the second one is filled in.

    Args:
        train: The train.

    Raises:
        AbsentError: The file holds no contact positions, or all wheels of one side are off the rail throughout.
    """
    names = {"contact_position_wheel": "wheel", "contact_position_rail": "rail"}
    two = train.scenario.contact.patches == 2
    samples = train.samples("patch" if two else "wheel", "share" if two else "normal_force", *names)
    parts, cant = train.scenario.parts, train.scenario.track.cant
    rails = parts.rail_profiles[0].canted(cant), parts.rail_profiles[1].canted(cant)
    drawn = {"wheel": _Drawn.of(parts.wheel_profiles), "rail": _Drawn.of([rails])}
    counts = {name: _Histogram(drawn[body].span) for name, body in names.items()}
    seconds = {name: _Histogram(drawn[body].span) for name, body in names.items()} if two else {}
    begin = first_samples(train, samples)
    sample = int(begin.min())
    for _, channels in samples.slices(sample):
        counted = (sample + np.arange(len(channels["contact_position_wheel"])))[:, None] >= begin
        sample += len(counted)
        if two:
            carrying = (channels["share"] >= LEAST_SHARE) & counted[..., None, None]
            for name, histogram in counts.items():
                for patch in range(2):
                    histogram.add(channels[name][..., patch], carrying[..., patch])
                seconds[name].add(channels[name][..., 1], carrying[..., 1])
            continue
        touching = (channels["normal_force"] > 0.0) & counted[..., None]
        for name, histogram in counts.items():
            histogram.add(channels[name], touching)
    if not next(iter(counts.values())).total.all():
        raise AbsentError(
            f"{train.result.name}: the wheels of one side never touch the rail: there is no contact to draw"
        )
    words = "positions of both patches of all wheels" if two else "contact positions of all wheels while in contact"
    figure = new_figure(15.0, f"{train.caption}: {words}, run-in left out")
    axes = figure.subplots(4, 1, height_ratios=(1.1, 1.0, 1.1, 1.0))
    for (name, body), (above, below) in zip(names.items(), (axes[:2], axes[2:]), strict=True):
        second = seconds.get(name)
        _histograms(above, counts[name], second)
        origin = "the tape circle" if body == "wheel" else "the crown"
        _profiles(below, drawn[body], counts[name], second, f"outward from {origin} of the {body} [mm]")
        below.sharex(above)
        above.set_xlim(*(1e3 * edge for edge in counts[name].shown(drawn[body].span)))
        above.set(
            title=plain(f"{body.capitalize()}: {drawn[body].names}"),
            ylabel=f"share of {'patches' if two else 'time'}\n[% in {1e3 * BIN:g} mm]",
        )
    axes[0].legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2)
    return figure


@dataclass(frozen=True, eq=False)
class _Drawn:
    """Profiles of wheels or rails.

    Attributes:
        sides: Profiles on which the left and the right contacts are marked: of the first wheelset, or of the rails.
        different: All different profiles.
    """

    sides: tuple[Profile, Profile]
    different: tuple[Profile, ...]

    @classmethod
    def of(cls, pairs: Sequence[tuple[Profile, Profile]]) -> _Drawn:
        """Profiles from those of the left and the right side, pair by pair."""
        different = {(each.name, each.y.tobytes(), each.z.tobytes()): each for pair in pairs for each in pair}
        return cls(pairs[0], tuple(different.values()))

    @property
    def names(self) -> str:
        """Names of all profiles."""
        left, right = self.sides
        if left.name != right.name and len(self.different) == 2:
            return f"{left.name} on the left, {right.name} on the right"
        return ", ".join(dict.fromkeys(each.name for each in self.different))

    @property
    def span(self) -> tuple[float, float]:
        """Ends of all profiles [m]."""
        ends = np.array([each.span for each in self.different])
        return float(ends[:, 0].min()), float(ends[:, 1].max())


class _Histogram:
    """Histogram of contact positions along a profile, left and right.

    Attributes:
        edges: Edges of the bins [m], shape (n + 1,).
        counts: Samples in each bin by side, shape (2, n).
    """

    def __init__(self, span: tuple[float, float]) -> None:
        self.edges: Reals = BIN * np.arange(np.floor(span[0] / BIN), np.ceil(span[1] / BIN) + 1)
        self.counts: Reals = np.zeros((2, len(self.edges) - 1))

    def add(self, position: Reals, touching: NDArray[np.bool_]) -> None:
        """Add positions [m] where ``touching`` holds; both have shape (n, wheelsets, 2)."""
        for side in range(2):
            in_contact = position[..., side][touching[..., side]]
            self.counts[side] += np.histogram(np.clip(in_contact, self.edges[0], self.edges[-1]), self.edges)[0]

    @property
    def total(self) -> Reals:
        """Number of samples by side, shape (2,)."""
        return np.asarray(self.counts.sum(axis=1))

    @property
    def share(self) -> Reals:
        """Share of the contact time in every bin [%], shape (2, n)."""
        return 100.0 * self.counts / self.total[:, None]

    @property
    def touched(self) -> tuple[float, float]:
        """Limits of the bins that hold samples [m]."""
        filled = np.flatnonzero(self.counts.sum(axis=0))
        return float(self.edges[filled[0]]), float(self.edges[filled[-1] + 1])

    def shown(self, span: tuple[float, float]) -> tuple[float, float]:
        """Limits of the picture [m]: the touched part and a margin, within the profile."""
        low, high = self.touched
        return max(low - MARGIN, span[0]), min(high + MARGIN, span[1])

    def middle(self, side: int) -> float:
        """Median position of one side [m]."""
        running = np.cumsum(self.counts[side]) / self.total[side]
        return float(self.edges[np.searchsorted(running, 0.5)] + 0.5 * BIN)


def _histograms(axes: Axes, histogram: _Histogram, second: _Histogram | None) -> None:
    for side, look, label in ((0, LEFT, "left wheels"), (1, RIGHT, "right wheels")):
        axes.stairs(histogram.share[side], 1e3 * histogram.edges, label=label, linewidth=0.9,
                    edgecolor=look.color, linestyle=look.linestyle)  # fmt: skip
        if second is not None:
            axes.stairs(100.0 * second.counts[side] / histogram.total[side], 1e3 * second.edges, fill=True, alpha=0.3,
                        color=look.color, label=f"{label}, second patch")  # fmt: skip
    axes.set_ylim(bottom=0.0)


def _profiles(axes: Axes, drawn: _Drawn, histogram: _Histogram, second: _Histogram | None, abscissa: str) -> None:
    """Draw profiles around their touched part, which is bold; triangles mark the medians, open ones second patches."""
    low, high = histogram.touched
    for i, profile in enumerate(drawn.different):
        y = np.linspace(*histogram.shown(profile.span), 800)
        inside = (y >= low) & (y <= high)
        line: dict[str, Any] = {"color": BLACK, "linestyle": ("-", "--", "-.", ":")[i % 4]}
        axes.plot(1e3 * y, 1e3 * profile.height(y), linewidth=0.8, label=plain(profile.name), **line)
        axes.plot(1e3 * y[inside], 1e3 * profile.height(y[inside]), linewidth=2.2, **line)
    if len(drawn.different) > 1:
        axes.legend(loc="best", fontsize="small")
    for side, look, marker in ((0, LEFT, "v"), (1, RIGHT, "^")):
        middle, profile = histogram.middle(side), drawn.sides[side]
        axes.plot(1e3 * middle, 1e3 * float(profile.height(middle)), marker, color=look.color, markersize=6)
        if second is not None and second.total[side]:
            middle = second.middle(side)
            axes.plot(1e3 * middle, 1e3 * float(profile.height(middle)), marker, color=look.color, markersize=7,
                      markerfacecolor="none")  # fmt: skip
    axes.set(xlabel=abscissa, ylabel="down [mm],\nstretched")
    axes.margins(y=0.2)
    axes.invert_yaxis()
