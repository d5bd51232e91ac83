"""Spectra of the vertical wheel force at 350 km/h: passing frequencies of seats and slabs, and the P2 resonance.

References: V/d for objects at the pitch d; ``closed_forms/two_mass`` for P2, and for |Q/z| about it.

Q/z is the cross spectrum of force and irregularity under the same wheel over the spectrum of the latter, summed over
the wheels, at a tenth of the German low-disturbance spectrum (no lift-off), whose waves of 0.5 m and longer reach
194 Hz. All wheels run over the same track, so that a run of 350 m has n = 14 independent intervals of half a second
(two channels, seven Hann windows), one of 1550 m 62. At the coherence of 0.93 about P2 |Q/z| then scatters by
sqrt((1 - 0.93)/(2 n 0.93)) = 5 and 2.5 % (J. S. Bendat, A. G. Piersol, Random data (4th ed., 2010), ch. 9).
The peak is broad, 1 - ((f - f_0)/12.5 Hz)^2: scatter shifts it by 12.5 Hz times the root, 2.8 and 2.0 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy import signal

from tiengine.engine import backend
from tiengine.model.from_scenario import ingredients
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.vehicle.train import assemble, static_wheel_loads
from validation.closed_forms.two_mass import (
    WheelOnTrack,
    beam_receptance,
    force_per_roughness,
    peak,
    two_mass_frequencies,
)
from validation.frame.case import Case
from validation.frame.runs import simulate

__all__ = ["CASES", "draw"]

RUN_IN = 50.0  # m
SHORT, LONG = 400.0, 1600.0  # m
SEAT, SLAB, SLAB_WIDTH = 0.63, 5.67, 2.5  # m
V, DT, SLABS, PERIOD = 350.0 / 3.6, 2e-4, 10, 2916  # PERIOD steps of DT at V are SLABS of 5.67 m
BAND = (20.0, 120.0)  # Hz: range of the search for P2; P1 is far above
LINES = np.arange(60.0, 151.0, 10.0)  # Hz: above the resonance, below the seats' passing
RESOLUTION = 2.0  # Hz
ROUGH = ("irregularity.scale=0.1", "irregularity.wavelength_min=0.5", f"numerics.time_step={DT}")


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided densities over frequency, means over the eight wheels.

    Attributes:
        frequency: [Hz], shape (n,).
        density: Of the vertical force [N^2/Hz].
        transfer: |F/z| [N/m]; NaN without irregularity.
    """

    frequency: Reals
    density: Reals
    transfer: Reals


@cache
def smooth() -> Spectrum:
    """On a smooth track."""
    changes = ("train.distance=170.0", f"numerics.time_step={DT}")
    force = simulate("smooth", *changes).vertical[-2 * PERIOD :]
    f, S = signal.welch(force, 1.0 / DT, nperseg=PERIOD, axis=0)
    return Spectrum(f, S.mean(axis=(1, 2)), np.full(len(f), np.nan))


@cache
def rough(distance: float = SHORT) -> Spectrum:
    """At a tenth of the German low-disturbance spectrum."""
    with run(load_scenario("default", [*ROUGH, f"train.distance={distance}"])) as result:
        wheel, irregularity = result.wheel(), result.irregularity()
    late = wheel["position"] > wheel["position"][0] + RUN_IN
    F, z = wheel["vertical_force"][late].astype(np.float64), irregularity["vertical"][late].astype(np.float64)
    settings = {"fs": 1.0 / DT, "nperseg": round(1.0 / (DT * RESOLUTION)), "axis": 0}
    f, S = signal.welch(F, **settings)
    S_z, S_zF = (x[1].sum(axis=(1, 2)) for x in (signal.welch(z, **settings), signal.csd(z, F, **settings)))
    return Spectrum(f, S.mean(axis=(1, 2)), np.abs(S_zF) / S_z)


@cache
def wheel_on_track() -> tuple[WheelOnTrack, WheelOnTrack]:
    """A wheel of a bouncing and of a rolling wheelset on CHN60 on the smeared fastenings; Hertz spring at the load."""
    scenario = load_scenario("default")
    parts, vehicle = scenario.parts, scenario.parts.vehicles[0]
    train, rail, seat = assemble(parts.vehicles), parts.rail, parts.fastening
    table = ingredients(scenario, DT).contact
    hertz = float(table.lookup(0.0, 0.0)[list(table.COLUMNS).index("hertz_K")])
    load = float(static_wheel_loads(train).mean())
    z, roll = train.wheelset_dof[0, 1:3]  # K and C of bounce and roll with all else held: two axle boxes
    b = vehicle.half_spacing
    bounce = WheelOnTrack(
        unsprung=0.5 * float(train.M[z, z]),
        contact=1.5 * load ** (1.0 / 3.0) * hertz ** (2.0 / 3.0),
        EI=rail.E * rail.Iy,
        m=rail.mass_per_length,
        k=seat.vertical_stiffness / SEAT,
        c=seat.vertical_damping / SEAT,
        kGA=rail.kappa_vertical * rail.G * rail.A,
        rho_I=rail.rho * rail.Iy,
        bed=0.5 * SLAB_WIDTH * parts.mortar.stiffness,
        bed_damping=0.5 * SLAB_WIDTH * parts.mortar.damping,
        bed_mass=0.5 * SLAB_WIDTH * parts.slab.rho * parts.slab.thickness,
        primary_stiffness=0.5 * float(train.K[z, z]),
        primary_damping=0.5 * float(train.C[z, z]),
    )
    per_wheel = 0.5 / b**2
    rolling = replace(
        bounce,
        unsprung=per_wheel * float(train.M[roll, roll]),
        primary_stiffness=per_wheel * float(train.K[roll, roll]),
        primary_damping=per_wheel * float(train.C[roll, roll]),
    )
    return bounce, rolling


def _expected(frequency: Reals) -> Reals:
    """|F/z| of bounce and roll in equal parts: vertical and cross level move the rails with equal power [N/m].

    The bogie's other wheel passes the same z a time d/V before or after: with a = z/F of one wheel and c the rail's
    receptance at d, the mean of both is (a - c cos(omega d/V))/(a^2 - c^2).
    """
    bogie, total = float(-np.diff(load_scenario("default").parts.vehicles[0].axle_positions)[0]), np.zeros(1, complex)
    lag = np.cos(2.0 * np.pi * frequency * bogie / V)
    for system in wheel_on_track():
        a, c = 1.0 / force_per_roughness(system, frequency), beam_receptance(system, frequency, bogie)
        total = total + 0.5 * (a - c * lag) / (a**2 - c**2)
    return np.abs(total)


def _largest(spectrum: Spectrum, low: float, high: float) -> float:
    """Frequency of the largest line between two frequencies [Hz]."""
    inside = (spectrum.frequency >= low) & (spectrum.frequency <= high)
    return float(spectrum.frequency[inside][np.argmax(spectrum.density[inside])])


def _contrast() -> Reals:
    """Lines of slab and seat over the density halfway to the neighbouring lines of the slab."""
    S, seats = smooth().density, round(SLAB / SEAT)
    half = SLABS // 2
    return np.array([S[i] / max(S[i - half], S[i + half]) for i in (SLABS, seats * SLABS)])


def _p2(distance: float = SHORT) -> Reals:
    """Frequency [Hz] and height [kN/mm] of the peak of |Q/z|."""
    found = rough(distance)
    inside = (found.frequency >= BAND[0]) & (found.frequency <= BAND[1])
    transfer = found.transfer[inside]
    return np.array([peak(found.frequency[inside], transfer), 1e-6 * transfer.max()])


def _p2_receptance() -> Reals:
    frequency = np.arange(*BAND, 0.1)
    values = _expected(frequency)
    return np.array([peak(frequency, values), 1e-6 * values.max()])


def _lines() -> Reals:
    """|Q/z| at :data:`LINES` [kN/mm]."""
    found = rough(SHORT)
    return 1e-6 * found.transfer[np.searchsorted(found.frequency, LINES - 0.5 * RESOLUTION)]


def draw(path: Path) -> None:
    """Spectra of the vertical wheel force on smooth and rough track, with the expected frequencies.

    Args:
        path: PNG to write.
    """
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    backend.start()
    figure, axes = plt.subplots(2, 1, figsize=(9.0, 6.4), layout="constrained")
    S = smooth()
    axes[0].semilogy(S.frequency, S.density, color="#0072B2", linewidth=0.8)
    for name, line in (("slab V/5.67 m", V / SLAB), ("seat V/0.63 m", V / SEAT), ("2 V/0.63 m", 2.0 * V / SEAT)):
        axes[0].axvline(line, color="#D55E00", linewidth=0.8, linestyle="--")
        axes[0].text(line + 2.0, S.density.max(), name, fontsize=8, va="top")
    axes[0].set_ylabel("density of Q [N²/Hz]")
    axes[0].set_title("Smooth track, 350 km/h", loc="left", fontsize=10)
    R = rough(SHORT)
    inside = (R.frequency >= 6.0) & (R.frequency <= 194.0)
    axes[1].plot(R.frequency[inside], 1e-6 * R.transfer[inside], color="#0072B2", linewidth=1.0, label="engine")
    frequency = np.arange(6.0, 194.0, 0.5)
    bounce = wheel_on_track()[0]
    lumped = np.abs(force_per_roughness(bounce, frequency, lumped=True))
    for values, colour, name in (
        (lumped, "#D55E00", "two masses"),
        (_expected(frequency), "#009E73", "bogie on a beam"),
    ):
        axes[1].plot(frequency, 1e-6 * values, color=colour, linewidth=1.0, label=name)
    axes[1].axvline(two_mass_frequencies(bounce)[0], color="0.4", linewidth=0.8, linestyle="--", label="P2, undamped")
    axes[1].set_ylabel("|Q/z| [kN/mm]")
    axes[1].set_title("Rough track, 350 km/h", loc="left", fontsize=10)
    axes[1].legend(frameon=False, fontsize=8)
    axes[0].set_ylim(bottom=1e-11)
    for axis, end in zip(axes, (400.0, 194.0), strict=True):
        axis.set_xlim(0.0, end)
        axis.grid(color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
        axis.set_xlabel("frequency [Hz]")
    figure.savefig(path, dpi=160)
    plt.close(figure)


CASES = (
    Case(
        name="spectrum-passing",
        kind="verification",
        quantity="largest line of the vertical force about the slabs' and the seats' passing frequency, 350 km/h [Hz]",
        source="V/5.67 m and V/0.63 m",
        reference=(V / SLAB, V / SEAT),
        atol=1.0 / (PERIOD * DT),
        why="resolution of the spectrum",
        compute=lambda: [_largest(smooth(), 0.5 * f, 1.5 * f) for f in (V / SLAB, V / SEAT)],
    ),
    Case(
        name="spectrum-contrast",
        kind="verification",
        quantity="density at slab and seat passing over that halfway to the neighbouring multiples of the slabs'",
        source="a periodic track forces lines only",
        reference=(100.0, 100.0),
        rule="at least",
        why=(
            "20 dB allow for the remainder of the start's transient; the side lobes of Hann's window at five bins are"
            " far lower"
        ),
        compute=_contrast,
    ),
    Case(
        name="spectrum-P2",
        kind="verification",
        quantity="P2 resonance: peak of |Q/z| at 350 km/h [Hz]",
        source="two masses, undamped (Jenkins et al. 1974)",
        reference=lambda: two_mass_frequencies(wheel_on_track()[0])[0],
        rtol=0.10,
        why=(
            "approximations, in frequency: damping 4 %, roll (6 % less mass) 3 %, shear of the rail 2 %, slab and bed"
            " 2 %, half"
            " the resolution 2 %, wheel beyond in the bogie 2 %: 6 % in quadrature, as much again in its worst sum"
        ),
        compute=lambda: _p2()[0],
    ),
    Case(
        name="spectrum-P2-height",
        kind="verification",
        quantity="height of that peak [kN/mm]",
        source="two wheels of a bogie, bounce and roll, primary suspension, Timoshenko beam, slab on its bed",
        reference=lambda: _p2_receptance()[1],
        rtol=0.08,
        why="scatter 5 %, frame at rest 5 %, bed's width and seats one by one 3 %, in quadrature",
        compute=lambda: _p2()[1],
    ),
    Case(
        name="spectrum-P2-long",
        kind="verification",
        quantity="P2 resonance over 1550 m: frequency [Hz] and height [kN/mm] of the peak of |Q/z|",
        source="two wheels of a bogie, bounce and roll, primary suspension, Timoshenko beam, slab on its bed",
        reference=_p2_receptance,
        rtol=0.06,
        why="scatter 2.5 %, so 2.0 Hz, half the resolution 1 Hz; of the height, frame at rest 5 %, bed and seats 3 %",
        compute=lambda: _p2(LONG),
        quick=False,
    ),
    Case(
        name="spectrum-transfer",
        kind="verification",
        quantity="|Q/z| at 60, 70, ... 150 Hz [kN/mm]",
        source="the same",
        reference=lambda: 1e-6 * _expected(LINES),
        rtol=0.06,
        why="scatter at a coherence of 0.99 2 %, bed's width 3 %, seats one by one 4 %, in quadrature",
        compute=_lines,
    ),
)
