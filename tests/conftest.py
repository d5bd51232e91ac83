"""One Taichi initialisation for the whole session."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tiengine.engine import backend

sys.path.append(
    str(Path(__file__).parents[1])
)  # validation's closed forms; last, so that the installed engine is tested


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--ti-debug``: bounds checks in every kernel."""
    parser.addoption("--ti-debug", action="store_true", help="compile Taichi kernels with bounds checks (slow)")


@pytest.fixture(scope="session", autouse=True)
def taichi(pytestconfig: pytest.Config) -> None:
    """Start Taichi once; every kernel of the session shares it."""
    backend.start(debug=pytestconfig.getoption("--ti-debug"))
