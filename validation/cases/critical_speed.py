"""Critical (hunting) speeds found by the engine, compared with eigenvalues of the linearised vehicle on a rigid track.

Search: a smooth track with one bump of the alignment, then 6 s of running; the train hunts if the lateral motion of
its wheelsets in the last second and a half is no smaller than in the one before (or if it derails). The speed is
bisected between 100 and 600 km/h; 600 means that no hunting was found, and 1000 km/h was tried as well. A disturbance
of one size finds one attractor; H. True, Vehicle System Dynamics 51(3) (2013) 443-459, shows what such a search can
miss. The numbers are therefore for information, and only the trends are judged.

The window is short on purpose, 26 m: hunting is at 1 to 8 Hz, and its waves are 10 m and longer, so that the rails
enter by their static compliance only. Knots and step are those of the default.

Pairs of profiles: LMA on CHN60 as used by the Chinese vehicles (tape circles 1493 mm apart), and S1002 on 60E1 with
tape circles 1500 mm apart, for which EN 15302 gives its conicity of 0.18 at 3 mm; at 1493 mm the same pair has 0.017.
No published critical speed was found for these data sheets with these profiles.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tiengine.contact.table import WheelRailPair
from tiengine.model.from_scenario import ingredients
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import RunFailedError
from tiengine.scenario.scenario import Scenario, load_scenario
from tiengine.simulation.simulate import run
from tiengine.vehicle.train import TrainModel, static_wheel_loads
from validation.cases.klingel import cone, fit_wave, round_head, write_kick
from validation.closed_forms.linear_vehicle import EquivalentContact, equivalent_contact, fastest_growth
from validation.closed_forms.linear_vehicle import critical_speed as linear_critical_speed
from validation.frame.case import Case

__all__ = ["CASES", "Setting", "critical_speed"]

SLOWEST, FASTEST, TOP, STEP = 100.0, 600.0, 1000.0, 10.0  # km/h
DURATION, SPAN = 6.0, 1.5  # s: duration of a run, and of either half of the time that is judged
KEPT = 0.95  # least ratio of the motion of one span to that of the span before: decay of less than 0.03 /s
VISIBLE = 1e-4  # m: below this a motion counts as decayed
BUMP, BUMP_START, BUMP_LENGTH = 6e-3, 30.0, 20.0  # m: the flange clearance high, a hunting wave long
COARSE = (
    "numerics.window=26.0",
    "numerics.time_step=2e-4",
    "output.body_interval=0.004",
)
WEAK = {  # the yaw dampers keep 1 N s/m
    "CRH380A_v2": ("v=[0.0]", "c=[1.0]"),
    "CRH380A_v6": ("v=[0.0]", "c=[1.0]"),
    "Zhai_coach": ("v=[0.0, 1.0]", "F=[0.0, 1.0]"),
}
CHINA = ('train.wheel_profile="LMA"', 'track.rail_profile="CHN60"')
EUROPE = (
    'train.wheel_profile="S1002"',
    'track.rail_profile="60E1"',
    "train.vehicles.0.geometry.half_span_contact=0.75",
)
SMALL_MOTION = 0.7  # 1/s: 3 % of the eigenvalue 2.9 + 23 i
AMPLITUDE = 3e-3  # m: amplitude of the equivalent conicity, as in EN 15302


@dataclass(frozen=True)
class Setting:
    """A vehicle on a pair of profiles.

    Attributes:
        vehicle: Preset.
        contact: Overrides of the profiles.
        without_dampers: Whether the yaw dampers are removed.
        series: Whether all springs in series with dampers are modelled; else as the preset states.
    """

    vehicle: str
    contact: tuple[str, ...] = CHINA
    without_dampers: bool = False
    series: bool = True

    @property
    def overrides(self) -> tuple[str, ...]:
        """Changes of the built-in scenario "smooth"."""
        weak = WEAK[self.vehicle] if self.without_dampers else ()
        dampers = tuple(f"train.vehicles.0.yaw_damper.{key}" for key in weak)
        vehicle = (f'train.vehicles=["{self.vehicle}"]', f"train.series_springs={str(self.series).lower()}")
        return (*vehicle, *self.contact, *dampers)


def amplitudes(scenario: Scenario) -> Reals:
    """Root mean square of the wheelsets' lateral motion in the last two spans of a run [m]; the larger wheelset.

    Raises:
        RunFailedError: The train derailed.
    """
    with run(scenario) as result:
        body = result.body()
    wheelset = np.array([name.startswith("wheelset") for name in body["body"]])
    time, y = body["time"], body["displacement"][:, wheelset, 0]
    spans = (time > DURATION - 2.0 * SPAN) & (time <= DURATION - SPAN), time > DURATION - SPAN
    return np.array([y[span].std(axis=0).max() for span in spans])


def hunts(setting: Setting, kmh: float) -> bool:
    """Whether a bump leads to a limit cycle or a derailment at a speed [km/h]."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bump.csv"
        write_kick(file, BUMP_START, BUMP_LENGTH, BUMP)
        course = (f"train.speed_kmh={kmh}", f"train.distance={DURATION * kmh / 3.6}")
        bump = (f"irregularity.file={str(file)!r}", "irregularity.taper=1.0")
        scenario = load_scenario("smooth", [*COARSE, *setting.overrides, *course, *bump])
        try:
            before, last = amplitudes(scenario)
        except RunFailedError:
            return True
    return bool(last > VISIBLE and last > KEPT * before)


@cache
def critical_speed(setting: Setting) -> float:
    """Lowest speed with hunting [km/h], to 10 km/h; infinite if there is none up to 1000 km/h."""
    low, high = SLOWEST, FASTEST
    if not hunts(setting, high):
        return TOP if hunts(setting, TOP) else float("inf")
    while high - low > STEP:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if hunts(setting, middle) else (middle, high)
    return high


def _linearised(scenario: Scenario, amplitude: float) -> tuple[TrainModel, EquivalentContact, float]:
    """Train, equivalent contact at an amplitude [m] and static wheel load [N]."""
    given = ingredients(scenario, 1e-4)
    pair = WheelRailPair(scenario.parts.wheel, scenario.parts.rail_profile, given.contact.settings)
    load = float(static_wheel_loads(given.train).mean())
    return given.train, equivalent_contact(pair, given.contact, load, amplitude), load


@cache
def linear(setting: Setting) -> tuple[float, float]:
    """Equivalent conicity at 3 mm, and linear critical speed on rigid rails [km/h]."""
    train, contact, load = _linearised(load_scenario("smooth", setting.overrides), AMPLITUDE)
    return contact.conicity, linear_critical_speed(train, contact, load)


DELIVERED = tuple(Setting(name) for name in ("CRH380A_v2", "CRH380A_v6", "Zhai_coach"))
SHIPPED = tuple(Setting(name, series=False) for name in ("CRH2", "CRH380A_v2", "CRH380A_v6", "Zhai_coach"))
WITHOUT = tuple(Setting(setting.vehicle, without_dampers=True) for setting in DELIVERED)
CONICITY = tuple(
    (Setting(*given), Setting(given[0], EUROPE, given[2]))
    for given in (("CRH2", CHINA, False), ("CRH380A_v6", CHINA, True))
)
MANCHESTER = Setting("Manchester", EUROPE)


@cache
def small_motion() -> tuple[complex, complex]:
    """Growth and circular frequency [1/s] of a CRH2 on cones of 1:20 after a bump of 0.02 mm: engine, linear."""
    kmh, seconds, kick = 500.0, 1.5, 2e-5
    seats = {"like": "ACE2021", "vertical_stiffness": 3e8, "lateral_stiffness": 3e8}
    tables: dict[str, Any] = {
        "train": {
            "vehicles": ("CRH2",),
            "wheel_profile": cone(0.05),
            "speed_kmh": kmh,
            "distance": kmh / 3.6 * seconds,
        },
        "track": {"rail_profile": round_head(), "friction": 1.0, "fastening": seats},
        "irregularity": {"taper": 1.0},
        "numerics": {"window": 26.0, "time_step": 2e-4},
        "output": {"precision": "double", "body_interval": 4e-3},
    }
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "kick.csv"
        write_kick(file, BUMP_START, BUMP_LENGTH, kick)
        tables["irregularity"]["file"] = str(file)
        scenario = load_scenario(tables)
        with run(scenario) as result:
            body = result.body()
    train, contact, load = _linearised(scenario, amplitude=5e-4)
    expected = fastest_growth(train, contact, load, kmh / 3.6)
    late = body["time"] > 0.5 * seconds
    y = body["displacement"][late, list(body["body"]).index("wheelset 1"), 0]
    return fit_wave(body["time"][late], y, expected), expected


def _finite(speeds: list[float]) -> Reals:
    """Speeds, NaN where none was found."""
    return np.where(np.isinf(speeds), np.nan, speeds)


def _row(name: str, words: str, settings: tuple[Setting, ...]) -> Case:
    return Case(
        name=name,
        kind="information",
        quantity=f"critical speed [km/h]: {words}; reference: linear, rigid rails, conicity at 3 mm",
        source="eigenvalues of the linearised vehicle (closed_forms/linear_vehicle)",
        reference=lambda: _finite([linear(setting)[1] for setting in settings]),
        why=(
            "-: none up to 1000; a bump of 6 mm involves the conicity near the flange and the dampers' blow-off,"
            " which the linear vehicle does not have"
        ),
        compute=lambda: _finite([critical_speed(setting) for setting in settings]),
        quick=False,
    )


CASES = (
    Case(
        name="hunting-small-motion",
        kind="verification",
        quantity="CRH2 on cones of 1:20 at 500 km/h, bump of 0.02 mm, stiff track: growth and circular frequency [1/s]",
        source="eigenvalue of the linearised vehicle on rigid rails (closed_forms/linear_vehicle)",
        reference=lambda: [small_motion()[1].real, small_motion()[1].imag],
        atol=SMALL_MOTION,
        why=(
            "3 % of the eigenvalue: spin creep of 0.04 of the load lowers the creep coefficients by 1.3 to 2.6 %,"
            " the rails deflect a little, front and rear bogie beat"
        ),
        compute=lambda: [small_motion()[0].real, small_motion()[0].imag],
    ),
    *(
        Case(
            name=f"hunting-yaw-dampers-{kept.vehicle}",
            kind="verification",
            quantity=f"critical speed of {kept.vehicle} without its yaw dampers [km/h]",
            source="with its yaw dampers, less 20 km/h",
            reference=lambda kept=kept: min(critical_speed(kept), TOP) - 2.0 * STEP,
            rule="at most",
            why="a bound: yaw dampers raise it; both speeds are known to 10 km/h",
            compute=lambda lost=lost: critical_speed(lost),
            quick=False,
        )
        for kept, lost in zip(DELIVERED, WITHOUT, strict=True)
    ),
    *(
        Case(
            name=f"hunting-conicity-{low.vehicle}",
            kind="verification",
            quantity=(
                f"critical speed of {low.vehicle}{', no yaw dampers' if low.without_dampers else ''} on S1002/60E1,"
                " conicity 0.18 [km/h]"
            ),
            source="on LMA/CHN60, conicity 0.035, less 20 km/h",
            reference=lambda low=low: critical_speed(low) - 2.0 * STEP,
            rule="at most",
            why="a bound: it falls with growing conicity; both speeds are known to 10 km/h",
            compute=lambda high=high: critical_speed(high),
            quick=False,
        )
        for low, high in CONICITY
    ),
    Case(
        name="hunting-conicities",
        kind="verification",
        quantity="equivalent conicity at 3 mm of S1002/60E1 as run (tape circles 1500 mm apart)",
        source="EN 15302",
        reference=0.18,
        atol=0.01,
        why="two printed digits; a mean of 64 phases",
        compute=lambda: linear(CONICITY[0][1])[0],
        quick=False,
    ),
    _row("hunting-delivered", ", ".join(setting.vehicle for setting in DELIVERED) + " on LMA/CHN60", DELIVERED),
    _row("hunting-shipped", ", ".join(setting.vehicle for setting in SHIPPED) + " as shipped", SHIPPED),
    _row("hunting-no-yaw-dampers", "the same without yaw dampers", WITHOUT),
    _row("hunting-LMA", "CRH2 and CRH380A_v6 without yaw dampers on LMA/CHN60", tuple(low for low, _ in CONICITY)),
    _row("hunting-S1002", "the same on S1002/60E1, and Manchester", (*(high for _, high in CONICITY), MANCHESTER)),
)
