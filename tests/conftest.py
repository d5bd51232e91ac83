"""One Taichi initialisation for the whole session."""

from __future__ import annotations

import pytest

from tiengine import backend


@pytest.fixture(scope="session", autouse=True)
def taichi() -> None:
    """Start Taichi once; every kernel of the session shares it."""
    backend.start()
