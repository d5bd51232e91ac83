"""Rule on the kernels' names: an argument that is stored into ends in ``_out`` or is named state."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

KERNELS = Path(__file__).parents[2] / "kernels"

STATE = {
    "motion": "generalised coordinates",
    "contact": "contact states of the wheels, where the next solve starts",
    "force": "local contact forces of the wheels, where the next solve starts",
    "wheelset_force": "contact forces on the wheelsets",
    "rail_force": "contact forces on the rails",
    "omitted": "omitted sines at the seats: their motion and that of the last steps",
    "rail": "spline coefficients of the rails, their forces and sweeps",
    "seat": "forces of the seats in the rails' lanes",
    "slab": "coordinates of the slabs, their loads and sweeps",
    "slab_seat": "slabs at their seats: motion, then loads",
    "car": "coordinates of the vehicles and their loads",
    "under": "rails under the wheels, and what the wheels do to them",
    "near": "registers: the rows of a sweep that the next one needs",
    "row": "registers: the row of a sweep that is solved",
    "total": "registers: a sum of columns",
}
"""State that kernels read and store into."""

Place = tuple[str, str]
"""Module and name of a function."""


class Device:
    """Functions that run on the device, of some modules by their text."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        """Parse."""
        self.functions: dict[Place, ast.FunctionDef] = {}
        self._modules: dict[str, dict[str, str]] = {}
        self._names: dict[str, dict[str, Place]] = {}
        for module, text in texts.items():
            tree = ast.parse(text)
            self._modules[module], self._names[module] = {}, {}
            for node in ast.walk(tree):
                if isinstance(node, ast.ImportFrom):
                    self._note_import(module, node)
            for node in tree.body:
                if isinstance(node, ast.FunctionDef) and _runs_on_device(node):
                    self.functions[module, node.name] = node
                    self._names[module][node.name] = (module, node.name)

    def _note_import(self, module: str, node: ast.ImportFrom) -> None:
        """Names under which modules, and functions of modules, are known in a module."""
        origin = (node.module or "").rpartition(".")[2]
        for alias in node.names:
            self._modules[module][alias.asname or alias.name] = alias.name
            self._names[module][alias.asname or alias.name] = (origin, alias.name)

    def stored(self) -> dict[Place, set[str]]:
        """Arguments of every function that it, or a function that it calls, stores into."""
        found = {place: set(_stored_directly(node)) for place, node in self.functions.items()}
        changed = True
        while changed:
            changed = False
            for place, node in self.functions.items():
                new = set(self._stored_by_calls(place[0], node, found)) - found[place]
                found[place] |= new
                changed |= bool(new)
        return found

    def _stored_by_calls(self, module: str, node: ast.FunctionDef, stored: Mapping[Place, set[str]]) -> Iterator[str]:
        own = _arguments(node)
        for call in ast.walk(node):
            if not isinstance(call, ast.Call) or (target := self._target(module, call.func)) not in self.functions:
                continue
            names = _arguments(self.functions[target])
            passed = [*zip(names, call.args, strict=False), *((word.arg, word.value) for word in call.keywords)]
            for name, value in passed:
                if name in stored[target] and isinstance(value, ast.Name) and value.id in own:
                    yield value.id

    def _target(self, module: str, func: ast.expr) -> Place:
        """Function that is called."""
        if isinstance(func, ast.Attribute) and isinstance(func.value, ast.Name):
            return self._modules[module].get(func.value.id, ""), func.attr
        if isinstance(func, ast.Name):
            return self._names[module].get(func.id, ("", ""))
        return "", ""


def _runs_on_device(node: ast.FunctionDef) -> bool:
    return any(ast.unparse(each) in ("ti.kernel", "ti.func") for each in node.decorator_list)


def _arguments(node: ast.FunctionDef) -> list[str]:
    return [each.arg for each in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]


def _stored_directly(node: ast.FunctionDef) -> Iterator[str]:
    """Arguments with an entry that is assigned, or that atomics change."""
    own = set(_arguments(node))
    for each in ast.walk(node):
        targets: list[ast.expr] = []
        if isinstance(each, ast.Assign):
            targets = [part for target in each.targets for part in _parts(target)]
        elif isinstance(each, (ast.AugAssign, ast.AnnAssign)):
            targets = [each.target]
        elif isinstance(each, ast.Call) and ast.unparse(each.func).startswith("ti.atomic_"):
            targets = each.args[:1]
        for target in targets:
            base = target
            while isinstance(base, (ast.Subscript, ast.Attribute)):
                base = base.value
            if base is not target and isinstance(base, ast.Name) and base.id in own:
                yield base.id


def _parts(target: ast.expr) -> list[ast.expr]:
    return list(target.elts) if isinstance(target, (ast.Tuple, ast.List)) else [target]


def offenders(texts: Mapping[str, str]) -> list[str]:
    """Arguments that break the rule."""
    return sorted(
        f"{module}.{function}: {name}"
        for (module, function), names in Device(texts).stored().items()
        for name in names
        if not name.endswith("_out") and name not in STATE
    )


TEXTS = {path.stem: path.read_text() for path in KERNELS.glob("*.py")}


def test_outputs_are_named():
    assert offenders(TEXTS) == []


def test_an_output_is_stored_into():
    """No argument is called an output that is none."""
    device = Device(TEXTS)
    stored = device.stored()
    idle = {
        f"{module}.{function}: {name}"
        for (module, function), node in device.functions.items()
        for name in _arguments(node)
        if name.endswith("_out") and name not in stored[module, function]
    }
    assert idle == set()


def test_all_state_exists():
    """Every name of the list is stored into somewhere."""
    assert set(STATE) <= set().union(*Device(TEXTS).stored().values())


LEAF = "import taichi as ti\n@ti.func\ndef leaf(a, x, n):\n    {}\n"


@pytest.mark.parametrize(
    "statement",
    ["x[0] = a", "x[0, n] += a", "(b, x[n]) = a, a", "ti.atomic_add(x[n], a)", "x[n].y = a"],
)
def test_the_rule_finds_a_store(statement):
    """In a function itself, and in those that call it by any way of importing it."""
    callers = (
        "import taichi as ti\nfrom tiengine.kernels import leaf as lf\n"
        "from tiengine.kernels.leaf import leaf as direct\n"
        "@ti.kernel\ndef by_module(b: int, y: int):\n    lf.leaf(b, y, 1)\n"
        "@ti.kernel\ndef by_name(b: int, y: int):\n    direct(b, n=1, x=y)\n"
        "@ti.func\ndef middle(b, y):\n    direct(b, y, 1)\n"
        "@ti.kernel\ndef by_two(b: int, y: int):\n    middle(b, y)\n"
        "@ti.kernel\ndef harmless(b: int, y: int):\n    z = y[0]\n    lf.leaf(y[0], z, 1)\n"
    )
    found = offenders({"leaf": LEAF.format(statement), "callers": callers})
    assert found == [
        "callers.by_module: y", "callers.by_name: y", "callers.by_two: y", "callers.middle: y", "leaf.leaf: x",
    ]  # fmt: skip


@pytest.mark.parametrize("statement", ["x = a", "b = x[0]", "b = a; b += x[n]", "a = x[n] + 1"])
def test_the_rule_allows_reading(statement):
    assert offenders({"leaf": LEAF.format(statement)}) == []


def test_outputs_and_state_may_be_stored_into():
    body = "x_out[0] = y\n    motion[0] = y\n"
    text = f"import taichi as ti\n@ti.kernel\ndef k(x_out: int, motion: int, y: int):\n    {body}"
    assert offenders({"k": text}) == []


def test_host_functions_are_left_alone():
    assert offenders({"host": "def f(x):\n    x[0] = 1\n"}) == []
