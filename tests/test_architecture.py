"""Rules of the code base that a machine can check."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ENGINE = ROOT / "tiengine"
HOST = [*sorted(ENGINE.glob("*.py")), *sorted(ENGINE.glob("figures/*.py"))]
DEVICE = sorted((ROOT / "kernels").glob("*.py"))
LONGEST = 400  # lines; 300 is the aim

LAYERS = [
    {"quantity", "input_files", "result_layout", "presets", "backend", "launch", "channels", "overrides", "fields",
     "memory", "column", "machine", "roofs", "profile_report", "profile_tables", "screen", "filters", "index",
     "profile_files", "profile_frame", "journal", "file_lock", "checkpoint", "events", "event_table",
     "figures.palette", "figures.style", "figures.curve"},
    {"rail", "fastening", "slab", "mortar", "profile", "hertz", "kalker", "speed", "spectrum", "connector", "coach",
     "vehicle", "assembly", "train", "contact_search", "contact_geometry", "conicity", "realisation", "given_track",
     "irregularity", "defects", "gauges", "plate_shapes", "slab_moments", "track_files", "p2"},
    {"parts", "ensemble", "sections", "scenario", "scenario_words", "contact_cache"},
    {"integrator", "blocks", "model", "plan"},
    {"state", "scratch", "track_static"},
    {"stepper", "start", "setup"},
    {"ride", "en14363", "gb5599", "comfort", "metrics", "metrics_table", "results", "output_file", "channel_table",
     "export", "datasets", "groups", "writer", "envelopes", "slot_extremes", "deflection", "gauge_samples",
     "trackside", "recorder", "guards", "disk_space", "stability", "prepare", "products", "stage_split"},
    {"messages", "march", "worker", "gather", "timed_loop", "figures.source", "figures.extremes",
     "figures.neighbours"},
    {"simulate", "profiling", "contact_report", "key_figures", "figures.forces", "figures.envelopes",
     "figures.waterfall", "figures.spectrum", "figures.contact", "figures.ride", "figures.gauges",
     "figures.ensemble", "figures.compare"},
    {"figures.catalogue", "figures.files", "report", "reference"},
    {"cli_results", "cli_run"},
    {"cli"},
]  # fmt: skip
"""A module imports from its own layer and those above it in this list."""


def imported(path: Path) -> set[str]:
    """Modules of the package that a file imports, as ``kernels.x`` or ``x``; type-checking imports apart."""
    found: set[str] = set()
    tree = ast.parse(path.read_text())
    guarded = [n for n in ast.walk(tree) if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.dump(n.test)]
    skip = {id(inner) for n in guarded for inner in ast.walk(n)}
    for node in ast.walk(tree):
        if id(node) in skip:
            continue
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tiengine"):
            module = node.module.removeprefix("tiengine").removeprefix(".")
            names = {a.name for a in node.names}
            found |= {f"kernels.{name}" for name in names} if module == "kernels" else {module} if module else names
        elif isinstance(node, ast.Import):
            found |= {a.name.removeprefix("tiengine.") for a in node.names if a.name.startswith("tiengine.")}
    return found


@pytest.mark.parametrize("path", DEVICE, ids=lambda p: p.stem)
def test_kernels_import_no_host_code(path):
    host = {file.stem for file in HOST}
    assert not {name.split(".")[0] for name in imported(path)} & host


@pytest.mark.parametrize("path", HOST, ids=lambda p: f"{p.parent.name}-{p.stem}")
def test_imports_point_one_way(path):
    if path.stem == "__init__":
        return
    rank = {name: i for i, layer in enumerate(LAYERS) for name in layer}
    module = ".".join(path.relative_to(ENGINE).with_suffix("").parts)
    assert module in rank, "a new module needs a place in LAYERS"
    for name in imported(path):
        if name in rank:
            assert rank[name] <= rank[module], f"{module} imports {name}"


@pytest.mark.parametrize("path", [*HOST, *DEVICE], ids=lambda p: f"{p.parent.name}-{p.stem}")
def test_files_fit_a_reader(path):
    assert len(path.read_text().splitlines()) <= LONGEST


@pytest.mark.parametrize("path", DEVICE, ids=lambda p: p.stem)
def test_kernels_write_only_what_their_signature_says(path):
    """A kernel stores into ``*_out``, ``motion`` or scratch that ``tiengine.engine.state`` owns, never into constants."""
    constants = {
        "dims",
        "constants",
        "clock",
        "table",
        "stiffness",
        "mass",
        "G",
        "scale",
        "shape",
        "index",
        "band",
        "tick",
    }
    for function in ast.walk(ast.parse(path.read_text())):
        if not isinstance(function, ast.FunctionDef):
            continue
        arguments = {a.arg for a in function.args.args}
        for node in ast.walk(function):
            targets = (
                node.targets
                if isinstance(node, ast.Assign)
                else [node.target]
                if isinstance(node, ast.AugAssign)
                else []
            )
            for target in targets:
                if isinstance(target, ast.Subscript) and isinstance(target.value, ast.Name):
                    assert target.value.id not in constants & arguments, f"{function.name} writes {target.value.id}"
