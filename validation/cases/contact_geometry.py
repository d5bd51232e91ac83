"""Quasi-static contact of wheelsets on straight track: stations and equivalent conicities.

References: an independent calculation older than this program (with its printed digits), whose
conicities are by harmonic linearisation of a rolling-radius difference sampled every 0.25 mm; the nominal
rolling radius that a public code (VTCM_simulation, GitHub) hard-codes for LMA; EN 15302 gives 0.18 for
S1002 on 60E1 at 3 mm. Frame: the wheelset is shifted to the right; stations outward from the tape
circle.

Omitted from the finely integrated conicities: amplitudes whose quarter sine passes a jump of the
contact, where the reference depends on its samples of 0.25 mm (S1002 beyond 4 mm and, on 60E1, at 1 mm).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tiengine.contact.conicity import equivalent_conicity, rolling_radius_difference, wheelset_position
from tiengine.contact.profile import load_profile
from tiengine.contact.table import ContactSettings, WheelRailPair
from tiengine.parameters.arrays import Reals
from validation.frame.case import Case

__all__ = ["CASES", "draw"]

INDEPENDENT = "independent calculation"
EUROPE = {"gauge_depth": 0.014, "half_spacing": 0.75, "wheel_radius": 0.46}
PAIRS: tuple[tuple[str, str, dict[str, float], tuple[float, ...], slice], ...] = (
    ("LMA", "CHN60", {}, (0.0256, 0.0270, 0.0350, 0.0420, 0.0482, 0.0539, 0.0631), slice(0, 6)),
    (
        "LMA",
        "60E1",
        {"gauge_depth": 0.014},
        (0.0256, 0.0256, 0.03, 0.0366, 0.0428, 0.0485, 0.0539),
        slice(0, 6),
    ),
    ("S1002", "60E1", EUROPE, (0.3652, 0.2245, 0.1788, 0.1597, 0.2124, 0.3100, 0.8332), slice(1, 4)),
    ("S1002", "CHN60", {}, (0.0173, 0.0189, 0.0231, 0.0715, 0.0775, 0.0796, 0.0822), slice(0, 3)),
)
"""Wheel, rail, settings, printed conicities at 1...7 mm, amplitudes away from jumps."""
STATIONS = np.array([0.0, 3e-3, 6e-3, 8e-3])
AMPLITUDES = np.arange(1.0, 8.0) * 1e-3


def _pair(wheel: str, rail: str, settings: dict[str, float]) -> WheelRailPair:
    placed = ContactSettings(**settings)  # type: ignore[arg-type]
    return WheelRailPair(load_profile(wheel, "wheel"), load_profile(rail, "rail"), placed)


def _stations() -> dict[str, Reals]:
    """LMA on CHN60 shifted by 0, 3, 6, 8 mm."""
    found = wheelset_position(_pair("LMA", "CHN60", {}), STATIONS)
    right, left = found.right, found.left
    return {
        "roll": found.roll * 1e3,
        "position": np.stack([right.s_w, left.s_w]) * 1e3,
        "radius": np.stack([right.dz_w, left.dz_w]) * 1e3,
        "angle": np.degrees(np.arctan(np.stack([right.tan_gamma, left.tan_gamma]))),
    }


def _sampled(wheel: str, rail: str, settings: dict[str, float]) -> Reals:
    """Conicities from a rolling-radius difference sampled every 0.25 mm, as in the source."""
    y = np.arange(0.0, 7.3, 0.25) * 1e-3
    difference = rolling_radius_difference(_pair(wheel, rail, settings), y)
    t = (np.arange(4000) + 0.5) * np.pi / 8000.0
    sine = np.sin(t)
    return np.array([(np.interp(A * sine, y, difference) * sine).mean() / A for A in AMPLITUDES])


def draw(path: Path) -> None:
    """Equivalent conicity over amplitude, 1 to 8 mm, of the four pairs; the references as marks.

    Args:
        path: PNG to write.
    """
    import matplotlib as mpl  # imported here, since the table does not need it

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    colours = ("#0072B2", "#56B4E9", "#D55E00", "#CC79A7")  # Okabe-Ito palette, distinct for colour-blind readers
    fine = np.linspace(1.0, 8.0, 141) * 1e-3
    figure, axis = plt.subplots(figsize=(7.5, 4.5), layout="constrained")
    for (wheel, rail, settings, printed, _), colour, mark in zip(PAIRS, colours, "osD^", strict=True):
        curve = equivalent_conicity(_pair(wheel, rail, settings), fine)
        axis.plot(1e3 * fine, curve, color=colour, linewidth=1.2)
        axis.plot(1e3 * AMPLITUDES, printed, mark, color=colour, markerfacecolor="none", label=f"{wheel} on {rail}")
    axis.plot(3.0, 0.18, "*", color="black", markersize=12, label="EN 15302: S1002 on 60E1")
    axis.set_yscale("log")
    axis.set_yticks([0.02, 0.05, 0.1, 0.2, 0.5, 1.0], ["0.02", "0.05", "0.1", "0.2", "0.5", "1"])
    axis.set_xlabel("amplitude of the wheelset's lateral motion [mm]")
    axis.set_ylabel("equivalent conicity [-]")
    axis.set_title("Curves: tiengine; marks: references (samples of 0.25 mm)", loc="left", fontsize=10)
    axis.grid(color="0.9")
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=160)
    plt.close(figure)


_JUMPY = np.tile([1.0, 1.0, 2.0, 2.0], 2)  # at 6 and 8 mm a shift of 1 um moves the contact by 3 to 12 um
CASES = (
    *(
        Case(
            name=f"stations-{key}",
            kind="validation",
            quantity=f"LMA on CHN60 at 0, 3, 6, 8 mm: {words}",
            source=INDEPENDENT,
            reference=printed,
            atol=atol,
            why=why,
            compute=lambda key=key: _stations()[key],
        )
        for key, words, printed, atol, why in (
            ("roll", "roll [mrad]", (0.0, -0.1048, -0.2455, -0.4323), 6e-5, "printed digits"),
            (
                "position",
                "contact on right and left wheel [mm]",
                ((6.05, 0.41, -8.90, -23.80), (6.05, 9.12, 12.23, 14.36)),
                6e-3 * _JUMPY,
                "printed digits; twice that where a shift of 1 um moves the contact by 3 to 12 um",
            ),
            (
                "radius",
                "rolling radius less r0, right and left [mm]",
                ((-0.171, -0.014, 0.395, 2.225), (-0.171, -0.248, -0.326, -0.379)),
                7e-4 * _JUMPY,
                "printed digits; twice that where the contact moves by 3 to 12 times the shift",
            ),
            (
                "angle",
                "contact angle, right and left [deg]",
                ((1.43, 1.92, 3.11, 11.73), (1.43, 1.43, 1.43, 1.43)),
                0.03,
                "0.5 mrad: printed digits and the reference plane of the angle (track or axle)",
            ),
        )
    ),
    Case(
        name="nominal-radius",
        kind="validation",
        quantity="LMA on CHN60, centred: rolling radius [mm]",
        source="VTCM_simulation (GitHub), a constant in the code",
        reference=429.8267,
        atol=5e-3,
        why="5 um: that code has its own table of LMA",
        compute=lambda: 430.0 + _stations()["radius"][0, 0],
    ),
    *(
        Case(
            name=f"conicity-{wheel}-{rail}",
            kind="validation",
            quantity=f"equivalent conicity of {wheel} on {rail}, 1 to 7 mm, sampled as in the source",
            source=INDEPENDENT,
            reference=printed,
            rtol=2e-3,
            atol=1e-4,
            why="printed digits and 0.2 %: gauge measured from the top or the crown of the canted rail",
            compute=lambda arguments=(wheel, rail, settings): _sampled(*arguments),
        )
        for wheel, rail, settings, printed, _ in PAIRS
    ),
    *(
        Case(
            name=f"conicity-fine-{wheel}-{rail}",
            kind="validation",
            quantity=f"equivalent conicity of {wheel} on {rail}, finely integrated, away from jumps",
            source=INDEPENDENT,
            reference=printed[smooth],
            rtol=7e-3,
            why="the source's samples of 0.25 mm",
            compute=lambda arguments=(wheel, rail, settings), smooth=smooth: equivalent_conicity(
                _pair(*arguments), AMPLITUDES[smooth]
            ),
        )
        for wheel, rail, settings, printed, smooth in PAIRS
    ),
    Case(
        name="conicity-EN-15302",
        kind="validation",
        quantity="equivalent conicity of S1002 on 60E1 at 3 mm",
        source="EN 15302",
        reference=0.18,
        atol=0.005,
        why="two printed digits",
        compute=lambda: equivalent_conicity(_pair("S1002", "60E1", EUROPE), AMPLITUDES[2:3]),
    ),
)
