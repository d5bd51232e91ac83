"""No input is ever executed: the package contains no call that could do so."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = sorted([*(ROOT / "tiengine").rglob("*.py"), *(ROOT / "kernels").glob("*.py")])
MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "marshal", "shelve", "yaml", "runpy", "code", "codeop"}
CALLS = {"eval", "exec", "compile", "__import__", "literal_eval", "execfile"}
LOADERS = {"load", "read_array", "genfromtxt", "loadtxt", "fromfile", "read_pickle", "memmap"}
STARTERS = {"subprocess": {"machine.py"}, "import_module": {"__init__.py", "catalogue.py", "result.py"}}
"""Calls that start other code, and the modules that may use them, with constant arguments."""
PICKLES = {"track_function.py"}
"""Modules that may pickle: a function that the caller of ``run`` passed in, for the caller's own worker processes."""


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_nothing_executes_an_input(path: Path) -> None:
    """No unpickling, no evaluation, arrays without objects, and subprocesses only with constant arguments."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = {alias.name.split(".")[0] for alias in node.names}
            names.add((getattr(node, "module", None) or "").split(".")[0])
            forbidden = MODULES - {"pickle"} if path.name in PICKLES else MODULES
            assert not names & forbidden, f"line {node.lineno}: {names & forbidden}"
            for starter, allowed in STARTERS.items():
                assert starter not in names or path.name in allowed, f"line {node.lineno}: {starter}"
        if not isinstance(node, ast.Call):
            continue
        if isinstance(node.func, ast.Name):
            assert node.func.id not in CALLS, f"line {node.lineno}: {node.func.id}"
            continue
        if not isinstance(node.func, ast.Attribute):
            continue
        owner, name = ast.unparse(node.func.value), node.func.attr
        assert (owner, name) not in {("os", "system"), ("os", "popen"), ("ast", "literal_eval")}, f"line {node.lineno}"
        if owner in ("np", "numpy", "np.lib.format") and name in LOADERS:
            given = {keyword.arg: ast.unparse(keyword.value) for keyword in node.keywords}
            assert given.get("allow_pickle") == "False", f"line {node.lineno}: {owner}.{name}"
