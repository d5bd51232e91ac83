"""Optional packages: each missing one is named with the extra that installs it."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest

from tiengine.parameters.errors import InputError
from tiengine.parameters.optional_packages import EXTRAS, needed_by


@pytest.mark.parametrize("package", EXTRAS)
def test_a_missing_package_is_named_with_its_extra(package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The extra that the message names installs the package."""
    monkeypatch.setitem(sys.modules, package, None)
    extra = EXTRAS[package]
    message = f"output = 'a.b': needs {package}; pip install 'tiengine[{extra}]'"
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"), needed_by("output = 'a.b'"):
        __import__(package)
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))
    assert any(re.match(rf"{package}\b", need) for need in project["project"]["optional-dependencies"][extra])


def test_other_missing_packages_are_no_fault_of_the_input() -> None:
    with pytest.raises(ImportError, match="no_such_package"), needed_by("to_xarray"):
        import no_such_package  # type: ignore[import-not-found] # noqa: F401
