"""Rule: the full-length model shares no assembly, step or track matrices with the engine that it checks."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

MSM = Path(__file__).parents[2] / "validation" / "msm"

ALLOWED: dict[str, set[str] | None] = {
    # the same train, wheels and irregularity
    "vehicle": None,
    "contact": None,
    "irregularity": None,
    "kernels": {"contact", "layout", "patches", "step", "suspension", "under_wheels"},
    "kernels.types": None,
    "kernels.wheel_rail": None,
    # parameters, and numbers that both must agree on
    "parameters": None,
    "scenario": None,
    "track.fastening": {"Fastening"},
    "track.mortar": {"Mortar", "MortarVoid"},
    "track.rail": {"Rail"},
    "track.slab": {"Slab"},
    "model.from_scenario": None,
    "model.constant_data": {"CONTACT_TOLERANCE"},
    "model.ingredients": {"Ingredients"},
    "model.newmark": None,
    # starting kernels and writing a file
    "engine.backend": None,
    "engine.launch": None,
    "recording.recorder": None,
    "result": None,
    "result_files": None,
    "simulation.simulate": {"Progress"},
}
"""Modules or wings, with the names that may be imported from them; None: all."""

START: dict[str, set[str] | None] = {
    "engine.equilibrium": {"equilibrium"},
    "engine.sine_state": {"SineState"},
    "model.sine_model": {"build_sine_model"},
}
"""Besides these, for the start alone, which is the engine's steady rolling."""

FROM_STEP = {"vehicle_forces"}
"""Functions of the engine's step that may be called: gravity and gyroscopic forces of the same train."""


def foreign(text: str, allowed: dict[str, set[str] | None]) -> list[str]:
    """Imports from the engine that are not allowed."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found += [each.name for each in node.names if each.name.split(".")[0] == "tiengine"]
        elif isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "tiengine":
            module = (node.module or "").removeprefix("tiengine").removeprefix(".")
            found += [f"{module}.{each.name}" for each in node.names if not _is_allowed(module, each.name, allowed)]
    return found


def _is_allowed(module: str, name: str, allowed: dict[str, set[str] | None]) -> bool:
    """A module that is listed decides, else its wing."""
    for key in (module, f"{module}.{name}", module.split(".")[0]):
        if key in allowed:
            names = allowed[key]
            return names is None or (key == module and name in names)
    return False


@pytest.mark.parametrize("path", sorted(MSM.glob("*.py")), ids=lambda path: path.stem)
def test_the_full_length_model_is_independent(path: Path):
    assert foreign(path.read_text(), ALLOWED | (START if path.stem == "start" else {})) == []


def test_of_the_step_only_the_forces_of_the_train_are_called():
    tree = ast.parse((MSM / "kernels.py").read_text())
    alias = {
        each.asname or each.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == "tiengine.kernels"
        for each in node.names
        if each.name == "step"
    }
    used = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in alias
    }
    assert used == FROM_STEP


@pytest.mark.parametrize(
    "text",
    [
        "from tiengine.engine.sine_stepper import SineStepper",
        "from tiengine.engine.equilibrium import equilibrium",
        "from tiengine.track.rail import RailWindow",
        "from tiengine.track.slab_matrices import slab_matrices",
        "from tiengine.kernels import fastening",
        "from tiengine.kernels.rail import rail_linear_forces",
        "from tiengine.model.model import build_model",
        "import tiengine.engine.stability",
        "from tiengine import engine",
    ],
)
def test_the_rule_finds_what_is_shared(text):
    assert len(foreign(text, ALLOWED)) == 1
    assert len(foreign(f"def lazy():\n    {text}", ALLOWED)) == 1
