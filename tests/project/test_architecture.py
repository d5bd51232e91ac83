"""Rules of the code base that a machine can check."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ENGINE = ROOT / "tiengine"
HOST = [path for path in sorted(ENGINE.rglob("*.py")) if "kernels" not in path.relative_to(ENGINE).parts]
DEVICE = sorted((ROOT / "kernels").glob("*.py"))
LONGEST = 400  # lines; 300 is the aim

WINGS = (
    "kernels", "parameters", "result_files", "contact", "vehicle", "track", "irregularity", "scenario", "indices",
    "result", "model", "engine", "recording", "simulation", "figures", "report", "profiling", "study", "cli",
)  # fmt: skip
"""From the ground up: a wing imports only from itself and from wings before it in this list."""


def imported(source: str) -> set[str]:
    """Modules of the package that a source imports, as ``contact.table``, including type-only and lazy imports."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "tiengine":
            base = node.module.removeprefix("tiengine").removeprefix(".")
            for alias in node.names:
                whole = f"{base}.{alias.name}" if base else alias.name
                found.add(whole if _is_module(whole) else base)
        elif isinstance(node, ast.Import):
            found |= {a.name.removeprefix("tiengine.") for a in node.names if a.name.startswith("tiengine.")}
    return found


def _is_module(name: str) -> bool:
    place = ENGINE.joinpath(*name.split("."))
    return place.with_suffix(".py").is_file() or place.is_dir()


def upward(module: str, source: str) -> list[str]:
    """Imports of a module from a later wing than its own, or from no known wing."""
    rank = {wing: i for i, wing in enumerate(WINGS)}
    own = rank[module.split(".")[0]]
    return [name for name in sorted(imported(source)) if rank.get(name.split(".")[0], len(rank)) > own]


def cycles(imports: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that import each other, by Tarjan's strongly connected components."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(module: str) -> None:
        order[module] = low[module] = len(order)
        stack.append(module)
        for other in imports[module] & imports.keys():
            if other not in order:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], order[other])
        if low[module] == order[module]:
            group = stack[stack.index(module) :]
            del stack[stack.index(module) :]
            if len(group) > 1 or module in imports[module]:
                found.append(sorted(group))

    for module in imports:
        if module not in order:
            visit(module)
    return found


def name_of(path: Path) -> str:
    """Dotted name of a host module below the package; a package is named after its folder."""
    parts = path.relative_to(ENGINE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name_of(path): path.read_text() for path in HOST if name_of(path)}
"""Source of every host module except the package's own ``__init__``, which is the API over all wings."""


def test_every_module_stands_in_a_wing():
    assert {module.split(".")[0] for module in MODULES} <= set(WINGS) | {"library"}


@pytest.mark.parametrize("path", DEVICE, ids=lambda path: path.stem)
def test_kernels_import_no_host_code(path):
    assert {name.split(".")[0] for name in imported(path.read_text())} <= {"kernels"}


@pytest.mark.parametrize("module", [module for module in MODULES if module.split(".")[0] in WINGS])
def test_no_import_runs_up(module):
    assert upward(module, MODULES[module]) == []


def test_no_module_imports_itself_by_others():
    assert cycles({module: imported(text) for module, text in MODULES.items()}) == []


@pytest.mark.parametrize(
    "text",
    [
        "from tiengine.engine.stepper import Stepper",
        "import tiengine.cli.commands",
        "from tiengine import simulation",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from tiengine.engine.sine_state import SineState",
        "def lazy():\n    from tiengine.report import page",
        "from tiengine.nowhere import thing",
    ],
)
def test_the_test_finds_a_misplaced_import(text):
    assert len(upward("contact.table", text)) == 1


def test_the_test_finds_a_cycle():
    assert cycles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]


@pytest.mark.parametrize("path", [*HOST, *DEVICE], ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_files_fit_a_reader(path):
    assert len(path.read_text().splitlines()) <= LONGEST


@pytest.mark.parametrize("path", sorted((ROOT / "validation").rglob("*.py")), ids=lambda path: path.stem)
def test_validation_files_fit_a_reader(path):
    assert len(path.read_text().splitlines()) <= LONGEST


def test_every_package_is_shipped():
    """pyproject.toml lists all packages by hand, since the kernels are in another folder."""
    import tomllib

    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    folders = {path.parent for path in HOST if path.name == "__init__.py"}
    names = {".".join(("tiengine", *folder.relative_to(ENGINE).parts)) for folder in folders}
    assert set(listed) == names | {"tiengine.kernels"}


TEXTS = [path for folder in ("tiengine", "kernels", "validation") for path in sorted((ROOT / folder).rglob("*.py"))]


@pytest.mark.parametrize("path", TEXTS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_docstrings_begin_with_a_verb_or_the_noun_they_name(path):
    """A docstring that begins with "What" or "Of" leaves its subject to the reader."""
    found = [node.value for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Expr)]
    texts = [value.value for value in found if isinstance(value, ast.Constant) and isinstance(value.value, str)]
    assert [text.splitlines()[0] for text in texts if text.split()[:1] in (["What"], ["Of"], ["Who"])] == []
