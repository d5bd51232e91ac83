"""Scenarios: built-in ones, parts, overrides, the round trip through TOML, and every kind of bad input."""

from __future__ import annotations

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tiengine.contact.profile import load_profile
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import KINDS, find_preset, preset_names, preset_source
from tiengine.scenario.overrides import parse_value
from tiengine.scenario.scenario import check_wavelength, load_scenario, to_toml
from tiengine.track.defects import FailedFastenings, fastening_factors
from tiengine.track.sines import Sines
from tiengine.vehicle.vehicle import load_vehicle

TRAIN = {"vehicles": ["CRH380A_v2"], "speed_kmh": 300.0, "distance": 100.0}


def refusal(source, overrides=()) -> str:
    """The message with which a scenario is refused: one line."""
    with pytest.raises(InputError) as caught:
        load_scenario(source, overrides)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_paper_is_the_papers_case():
    """Speed, way, window, modes and slabs of the source paper; its wheels span 2 x 8.75 + 2.5 m."""
    paper = load_scenario("paper")
    assert paper.train.speed.is_constant
    assert paper.train.speed.fastest == pytest.approx(350 / 3.6, rel=1e-15)  # one rounding
    assert paper.train.distance == 600.0
    assert (paper.window_length, paper.trial_functions) == (36.0, Sines(36.0, 60))
    assert paper.numerics.start == "equilibrium"
    assert paper.irregularity.spectrum == "german_low"
    parts = paper.parts
    assert parts.wheel_span == 20.0
    assert int(36.0 / parts.slab.pitch) + 1 == 7
    assert parts.slab.elements_x * parts.slab.elements_y == 18
    f = parts.fastening
    assert (f.vertical_stiffness, f.lateral_stiffness) == (4e7, 1.5e7)
    assert (f.vertical_damping, f.lateral_damping) == (5e4, 5e4)
    assert (parts.mortar.stiffness, parts.mortar.damping) == (1.25e9, 3.458e4)


@pytest.mark.parametrize("name", preset_names("scenarios"))
def test_resolved_toml_loads_back_equal(name):
    """The resolved text says all that is run, whatever the library holds."""
    scenario = load_scenario(name)
    text = to_toml(scenario)
    again = load_scenario(tomllib.loads(text))
    assert again == scenario
    assert to_toml(again) == text
    assert set(again.presets) - {"couplings", "aerodynamics"} == {
        "vehicles",
        "profiles",
        "rails",
        "slabs",
        "fastenings",
    }


def test_resolved_profile_is_the_librarys_to_the_last_bit():
    """Copying a profile as text changes none of its numbers."""
    parts = load_scenario(tomllib.loads(to_toml(load_scenario("paper")))).parts
    for profile, kind in ((parts.wheel, "wheel"), (parts.rail_profile, "rail")):
        library = load_profile(profile.name, kind)
        np.testing.assert_array_equal(profile.y, library.y)
        np.testing.assert_array_equal(profile.z, library.z)
        assert (profile.has_cant, profile.smoothing) == (library.has_cant, library.smoothing)
    assert parts.vehicles[0] == load_vehicle("CRH380A_v2")


def test_paths_start_at_the_scenarios_folder(tmp_path: Path):
    """Files beside the scenario are found from anywhere, and the resolved text needs none of them."""
    folder = tmp_path / "study"
    (folder / "parts").mkdir(parents=True)
    shutil.copy(find_preset("fastenings", "VTCM"), folder / "parts" / "soft.toml")
    shutil.copy(find_preset("profiles", "S1002"), folder / "parts" / "worn.csv")
    (folder / "my.toml").write_text(
        '[train]\nvehicles = ["CRH380A_v2"]\nspeed_kmh = 200\ndistance = 50\n'
        'wheel_profile = "parts/worn.csv"\n'
        '[track]\nfastening = "parts/soft.toml"\n',
        encoding="utf-8",
    )
    scenario = load_scenario(folder / "my.toml")
    assert scenario.name == "my"
    assert scenario.parts.fastening.vertical_stiffness == 6e7
    text = to_toml(scenario)
    shutil.rmtree(folder)
    assert load_scenario(tomllib.loads(text)).parts.wheel.name == "worn"


def test_files_beside_a_built_in_scenario_start_at_the_working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Not in the library, where no user has files."""
    (tmp_path / "mine.csv").write_text("x,z_v\n" + "".join(f"{x},0\n" for x in range(500)))
    monkeypatch.chdir(tmp_path)
    scenario = load_scenario("default", ["irregularity.file=mine.csv"])
    assert scenario.irregularity.file == str(tmp_path / "mine.csv")


def test_parts_as_tables():
    """A table stands alone or starts from a preset; a scenario may bring presets of its own."""
    table = {
        "train": TRAIN,
        "track": {
            "fastening": {
                "vertical_stiffness": 3e7,
                "lateral_stiffness": 1e7,
                "vertical_damping": 1e4,
                "lateral_damping": 2e4,
            },
            "rail": {"like": "60E1", "E": 2.06e11},
            "slab": {"like": "soft", "thickness": 0.21},
        },
        "presets": {"slabs": {"soft": {"like": "CRTS_III", "mortar": {"stiffness": 1e9}}}},
    }
    scenario = load_scenario(table)
    parts = scenario.parts
    assert parts.fastening.lateral_damping == 2e4
    assert (parts.rail.E, parts.rail.mass_per_length) == (2.06e11, 60.21)
    assert (parts.slab.thickness, parts.mortar.stiffness, parts.mortar.damping) == (0.21, 1e9, 3.458e4)
    assert load_scenario(tomllib.loads(to_toml(scenario))) == scenario


@pytest.mark.parametrize(
    "overrides",
    [
        ["train.speed_kmh=300", "track.fastening.vertical_stiffness=5e7", "numerics.start=zero"],
        {
            "train.speed_kmh": 300,
            "track.fastening": {"vertical_stiffness": 5e7},
            "numerics": {"start": "zero"},
        },
        {
            "train": {"speed_kmh": 300},
            "track": {"fastening": {"vertical_stiffness": 5e7}},
            "numerics.start": "zero",
        },
    ],
)
def test_overrides(overrides):
    """Texts, dotted keys and nested tables mean the same and may go on into a named part."""
    scenario = load_scenario("paper", overrides)
    assert scenario.train.speed_kmh == 300
    assert scenario.numerics.start == "zero"
    assert scenario.parts.fastening.vertical_stiffness == 5e7
    assert scenario.parts.fastening.lateral_stiffness == 1.5e7
    assert scenario.train.distance == 600.0
    assert load_scenario(scenario, {"train.speed_kmh": 250}).train.speed_kmh == 250


def test_override_inside_a_list():
    """Indices count list entries."""
    scenario = load_scenario("defects", ["track.failed_fastenings.0.factor=0.5", "train.vehicles.0.car.mass=50e3"])
    assert scenario.track.failed_fastenings[0].factor == 0.5
    assert scenario.parts.vehicles[0].body[0].mass == 50e3


@pytest.mark.parametrize(
    ("setting", "key", "value"),
    [
        ("track.rail_profile=60E1", "rail_profile", "60E1"),  # a number in TOML: 60 times 10
        ("track.rail_profile='60E1'", "rail_profile", "60E1"),
        ("track.rail={like = '60E1'}", "rail", {"like": "60E1"}),
        ("track.rail.like=60E1", "rail", {"like": "60E1"}),
        ("track.slab.elements_x=18", "slab", {"like": "CRTS_III", "elements_x": 18}),
        ("track.fastening.vertical_stiffness=5e7", "fastening", {"like": "ACE2021", "vertical_stiffness": 5e7}),
    ],
)
def test_overrides_of_parts(setting, key, value):
    """Names that look like numbers stay names; a key of a part that is left out changes the default part."""
    for source in ("default", {"train": TRAIN}):
        assert getattr(load_scenario(source, [setting]).track, key) == value


def test_names_like_numbers():
    """Every key that takes names only; keys that take a word or a number still read numbers."""
    gauge = "gauges=[{name='1', on='rail', chainage=60.0, side='left'}]"
    scenario = load_scenario("paper", ["name=2024", "irregularity.file=1e3", "numerics.window=1e2", gauge])
    assert (scenario.name, Path(scenario.irregularity.file).name, scenario.gauges[0].name) == ("2024", "1e3", "1")
    assert scenario.window_length == 100.0
    assert "train.vehicles[0] = '60': no such preset" in refusal("paper", ["train.vehicles.0=60"])
    assert "train.wheel_profile = 'true': no such preset" in refusal("paper", ["train.wheel_profile=true"])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("300", 300),
        ("3e2", 300.0),
        ("true", True),
        ("explicit", "explicit"),
        ('"auto"', "auto"),
        ("[[0, 350.0], [600, 330.0]]", ((0, 350.0), (600, 330.0))),
        ("{factor = 0.5, seats = [1, 2]}", {"factor": 0.5, "seats": (1, 2)}),
        ("data/worn.csv", "data/worn.csv"),
        ("1\nb = 2", "1\nb = 2"),
    ],
)
def test_parse_value(text, value):
    """TOML values; what is not TOML is a string."""
    assert parse_value(text) == value


BAD = {
    # wrong type
    "train.speed_kmh=fast": "train.speed_kmh = 'fast': must be a number",
    "train.distance=true": "train.distance = True: must be a number",
    "train.vehicles=CRH380A_v2": "train.vehicles = 'CRH380A_v2': must be a list",
    "train.vehicles=[]": "train.vehicles = []: must have at least 1 item",
    "train.vehicles=[3]": "train.vehicles[0] = 3: must be the name of a preset, the path of a file,",
    "numerics.passes=1.5": "numerics.passes = 1.5: must be a whole number",
    "track.mortar_no_tension=1": "track.mortar_no_tension = 1: must be true or false",
    # unknown keys, with the nearest known one
    "traim.distance=3": "traim: unknown key; did you mean 'train'?",
    "train.speed=3": "train.speed: unknown key; did you mean 'speed_kmh'?",
    "numerics.timestep=3": "numerics.timestep: unknown key; did you mean 'time_step'?",
    "irregularity.sed=3": "irregularity.sed: unknown key; did you mean 'seed'?",
    "track.rail.mass=1": "track.rail.mass: unknown key; did you mean 'mass_per_length'?",
    "train.vehicles.0.car.mas=1": "train.vehicles[0].car.mas: unknown key; did you mean 'mass'?",
    "track.failed_fastenings=[{seat=[1,2], seats=[1,2]}]": "track.failed_fastenings[0].seat: unknown key;",
    "presets.rail.x={}": "presets.rail: unknown kind of preset; did you mean 'rails'?",
    # ranges
    "train.vehicles.0.car.mass=-1": "train.vehicles[0].car.mass = -1: must be greater than 0 kg",
    "track.rail.mass_per_length=-1": "track.rail.mass_per_length = -1: must be greater than 0 kg/m",
    "track.fastening.vertical_stiffness=0": "track.fastening.vertical_stiffness = 0: must be greater than 0",
    "track.slab.mortar.stiffness=-1": "track.slab.mortar.stiffness = -1: must be greater than 0 N/m^3",
    "train.distance=0": "train.distance = 0: must be greater than 0 m",
    "train.speed_kmh=0": "train.speed_kmh = 0: must be greater than 0",
    "train.speed_kmh=nan": "train.speed_kmh = nan: must be",
    "train.speed_kmh=[[0, 300], [100, 0]]": "train.speed_kmh = [(0, 300), (100, 0)]: must be greater than 0",
    "train.speed_kmh=[[0, 300], [0, 200]]": "chainages must increase",
    "train.speed_kmh=[[0, 300, 3]]": "must be a number or two or more rows [chainage_m, km/h]",
    "numerics.time_step=0.01": "numerics.time_step = 0.01: must be 'auto' or a number between 1e-06 and",
    "numerics.window=foo": "numerics.window = 'foo': must be 'auto' or a number between",
    "numerics.modes_per_metre=inf": "numerics.modes_per_metre = inf: must be a finite number",
    "numerics.start=rest": "numerics.start = 'rest': must be 'equilibrium' or 'zero'",
    "track.friction=0": "track.friction = 0: must be greater than 0",
    "ensemble.size=0": "ensemble.size = 0: must be greater than or equal to 1",
    # between keys
    "numerics.window=20": "numerics.window = 20: window shorter than the train; must be at least 24 m",
    "numerics.absorbing_zone=7": "numerics.absorbing_zone = 7: must be at most 6 m in this window",
    "train.coupler_pitch=[20.0]": "train.coupler_pitch = [20.0]: must be one number or 0, one per coupling",
    "irregularity.spectrum=german_lo": "irregularity.spectrum = 'german_lo': unknown; did you mean",
    "irregularity.wavelength_max=0.5": "irregularity.wavelength_m",
    "track.failed_fastenings=[{seats=[3, 2]}]": "seats = [3, 2]: must be [first, last] with first <= last",
    "track.failed_fastenings=[{seats=[-1, 2]}]": "track.failed_fastenings[0].seats[0] = -1: must be",
    # the window's front ends at 636 m: seat j at 0.315 + 0.63 j, slab i from 5.67 i
    "track.failed_fastenings=[{seats=[9, 1010]}]": "seats = [9, 1010]: must be between 0 and 1009,",
    "track.mortar_voids=[{slab=113, x=[0, 1], y=[0, 1]}]": "slab = 113: must be between 0 and 112,",
    "track.mortar_voids=[{slab=1, x=[1, 6], y=[0, 1]}]": "x = [1.0, 6.0]: must be [from, to] with 0 <=",
    "track.mortar_voids=[{slab=1, x=[0, 1], y=[0, 2]}]": "y = [0.0, 2.0]: must be [from, to]",
    "track.mortar_voids=[{slab=1, x=[0,2], y=[0,1]}, {slab=1, x=[1,3], y=[0,1]}]": "overlap",
    "output.wheel_channels=['force']": "no such channel 'force'; known: normal_force,",
    "output.body_interval=0": "output.body_interval = 0: must be 'step' or a number between",
    # missing presets and files
    "train.vehicles.0=CRH380": "train.vehicles[0] = 'CRH380': no such preset; did you mean 'CRH380A_v",
    "train.wheel_profile=LMB": "train.wheel_profile = 'LMB': no such preset; did you mean 'LMA'?",
    "track.rail_profile=no/such.csv": "track.rail_profile = 'no/such.csv': no such file",
    "track.rail={like = 'CHN6'}": "track.rail = 'CHN6': no such preset; did you mean 'CHN60'?",
    # single wheels and rails
    "train.wheel_profiles=[{side='left'}]": "train.wheel_profiles: must state profile, radius or radius_difference",
    "train.wheel_profiles=[{radius=0.43, radius_difference=0}]": "wheel_profiles.radius = 0.43: must be left out",
    "train.wheel_profiles=[{radius=0.5}]": "train.wheel_profiles[0].radius = 0.5: must be within 5 % of the vehicle's",
    "train.wheel_profiles=[{radius_difference=-0.03}]": "[0].radius_difference = -0.03: must be within 5 % of",
    "train.wheel_profiles=[{side='left', radius_difference=0.011}]": "wheels of wheelset 1 have radii 0.441 and 0.43 m",
    "train.wheel_profiles=[{wheelsets=[5], radius=0.43}]": "[0].wheelsets = [5]: must be numbers from 1 to 4",
    "train.wheel_profiles=[{vehicles=[2], radius=0.43}]": "[0].vehicles = [2]: must be numbers from 1 to 1",
    "train.wheel_profiles=[{wheelsets=[], radius=0.43}]": "train.wheel_profiles[0].wheelsets = []: must be numbers",
    "train.wheel_profiles=[{profile='LMB'}]": "[0].profile = 'LMB': no such preset; did you mean 'LMA'?",
    "track.rail_profile_left=CHN61": "track.rail_profile_left = 'CHN61': no such preset; did you mean 'CHN60'?",
    # overrides themselves
    "train.speed_kmh": "--set 'train.speed_kmh': must be KEY=VALUE",
    "train.speed_kmh.a=3": "--set train.speed_kmh.a: 'a' lies below a value that is not a table",
    "train.vehicles.7=x": "--set train.vehicles.7: '7' must be an index between 0 and 0",
}


@pytest.mark.parametrize(("setting", "message"), BAD.items(), ids=list(BAD))
def test_bad_input(setting, message):
    """One line that names key, value and rule."""
    assert message in refusal("paper", [setting])


def test_bad_files(tmp_path: Path):
    """Missing scenario, broken TOML with its line, a binary file, a profile that is not two columns."""
    assert refusal("papr") == "scenario = 'papr': no such preset; did you mean 'paper'?"
    assert "no such file" in refusal(tmp_path / "none.toml")
    broken = tmp_path / "broken.toml"
    broken.write_text("[train]\nspeed_kmh = = 3\n", encoding="utf-8")
    assert "broken.toml: not valid TOML" in refusal(broken)
    assert "line 2" in refusal(broken)
    broken.write_bytes(b"\xff\xfe\x00")
    assert "not a UTF-8 text file" in refusal(broken)
    columns = tmp_path / "columns.csv"
    columns.write_text("1,2,3\n", encoding="utf-8")
    assert "two numbers" in refusal({"train": {**TRAIN, "wheel_profile": str(columns)}})
    assert refusal({"train": {"vehicles": ["CRH380A_v2"], "distance": 9}}) == (
        "train.speed_kmh: missing; a value is required"
    )


def test_preset_like_itself_is_refused():
    """A circle of presets ends in a message, not in recursion."""
    presets = {"rails": {"a": {"like": "b"}, "b": {"like": "a"}}}
    assert "is defined in terms of itself" in refusal({"train": TRAIN, "track": {"rail": "a"}, "presets": presets})


def test_wavelength_limit_is_eight_steps():
    """MODEL: wavelengths below 8 V dt are refused; at 350 km/h and 1 m that is dt = 1.2857 ms."""
    scenario = load_scenario("paper")
    limit = 1.0 / (8.0 * 350.0 / 3.6)
    check_wavelength(scenario, limit * (1 - 1e-9))
    with pytest.raises(InputError, match=r"irregularity.wavelength_min = 1 m: must be at least 8 V dt"):
        check_wavelength(scenario, limit * (1 + 1e-9))
    check_wavelength(load_scenario("smooth"), limit * 2)
    assert "8 V dt = 0.07778 m" in refusal("paper", ["irregularity.wavelength_min=0.07", "numerics.time_step=1e-4"])


def test_train_of_three():
    """Couplings at the vehicles' length by default; wheels span 2 x 25 + 20 m, the window 8 m more at either end."""
    scenario = load_scenario("train3")
    np.testing.assert_array_equal(scenario.parts.centres, [0.0, -25.0, -50.0])
    assert scenario.parts.wheel_span == 70.0
    assert scenario.window_length == 86.0
    assert (np.diff(scenario.parts.wheelset_positions) < 0.0).all()
    wide = load_scenario("train3", ["train.coupler_pitch=[26.0, 30.0]"])
    np.testing.assert_array_equal(wide.parts.centres, [0.0, -26.0, -56.0])
    assert "train.coupler_pitch = 19: must be between 20 m" in refusal("train3", ["train.coupler_pitch=19.0"])
    assert "must be one number or 2" in refusal("train3", ["train.coupler_pitch=[26.0]"])


def test_braking_speed_profile():
    """350 km/h at the beginning, 330 at 600 m."""
    speed = load_scenario("braking").train.speed
    assert not speed.is_constant
    # one rounding of the square root of twice the kinetic energy, at the two nodes
    assert speed.at(0.0)[0] == pytest.approx(350 / 3.6, rel=1e-14)
    assert speed.at(600.0)[0] == pytest.approx(330 / 3.6, rel=1e-14)


def test_fastening_factors():
    """Left is side 0; overlapping rows multiply; the others stay 1."""
    rows = [
        FailedFastenings(rail="left", seats=(2, 4)),
        FailedFastenings(rail="both", seats=(6, 7), factor=0.5),
        FailedFastenings(rail="right", seats=(7, 7), factor=0.5),
    ]
    expected = np.ones((10, 2))
    expected[2:5, 0] = 0.0
    expected[6:8] = 0.5
    expected[7, 1] = 0.25
    np.testing.assert_array_equal(fastening_factors(rows, 0, 10), expected)
    for first, count in ((0, 3), (3, 4), (5, 5), (8, 2)):
        np.testing.assert_array_equal(fastening_factors(rows, first, count), expected[first : first + count])


def test_no_tension_of_the_track_reaches_the_mortar():
    """A track's setting, not only a preset's."""
    assert load_scenario("paper", ["track.mortar_no_tension=true"]).parts.mortar.no_tension
    assert not load_scenario("paper").parts.mortar.no_tension


@pytest.mark.parametrize("kind", KINDS)
def test_every_preset_has_a_source(kind):
    """No number without where it comes from."""
    for name in preset_names(kind):
        assert len(preset_source(kind, name)) > 10, name


@pytest.mark.parametrize("name", preset_names("rails"))
def test_rail_presets_are_consistent(name):
    """Mass = rho A, polar inertia = Iy + Iz, G = E / 2(1 + nu), within the digits published (4 of each)."""
    rail = load_toml(find_preset("rails", name))
    assert rail["rho"] * rail["A"] == pytest.approx(rail["mass_per_length"], rel=1e-3)
    assert rail["Iy"] + rail["Iz"] == pytest.approx(rail["I_polar"], rel=1e-3)
    assert rail["E"] / (2 * (1 + rail["nu"])) == pytest.approx(rail["G"], rel=3e-3)  # 7.919e10 published as 7.9e10


@pytest.mark.parametrize("name", preset_names("fastenings"))
@pytest.mark.parametrize("kind", ["rails", "fastenings"])
def test_presets_by_name_build_parts(kind, name):
    """Every rail and fastening of the library is accepted by its class."""
    track = {"fastening": name} if kind == "fastenings" else {"rail": "60E1", "rail_profile": "60E1"}
    parts = load_scenario({"train": TRAIN, "track": track}).parts
    assert parts.fastening.vertical_stiffness > 0 < parts.rail.GK


def test_unknown_kind_of_preset():
    """A programmer's slip is named as well."""
    with pytest.raises(InputError, match="did you mean 'rails'"):
        find_preset("rail", "CHN60")


def test_start_puts_the_first_vehicle_at_a_chainage():
    """Windows of any length see the same track; without it the window's rear end is at zero."""
    short, long = (load_scenario("paper", ["train.start=40", f"numerics.window={window}"]) for window in (24.0, 60.0))
    assert short.rear + short.centre_in_window == pytest.approx(40.0, abs=1e-12)
    assert long.rear == pytest.approx(10.0, abs=1e-12)
    assert load_scenario("paper").rear == 0.0
    with pytest.raises(InputError, match=r"train.start = 29.0: must be at least 30 m"):
        load_scenario("paper", ["train.start=29", "numerics.window=60.0"])
