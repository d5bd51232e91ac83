"""Vector mode is switched for single kernels, and the same source runs without it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from taichi.lang import impl

from tiengine.engine import vector_mode
from tiengine.engine.aligned import aligned_copy, aligned_zeros, is_aligned
from tiengine.engine.vector_mode import VectorLaunch

from .vector_kernel import doubling


def run(x: NDArray[np.float64]) -> tuple[VectorLaunch, NDArray[np.float64]]:
    launch = VectorLaunch(doubling, (x.shape[1],), (x, np.arange(float(len(x)))), frozenset({0}))
    launch()
    return launch, x


def expected(x: NDArray[np.float64]) -> NDArray[np.float64]:
    out = (2.0 + np.arange(len(x)))[:, None] * x
    out[:, 1] = out[:, 0] - out[:, 1]
    return out


@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_vectors_of_every_width(lanes: int) -> None:
    x = aligned_copy(np.random.default_rng(0).standard_normal((7, lanes)))
    want = expected(x)
    launch, got = run(x)
    assert launch.vector_mode
    np.testing.assert_array_equal(got, want)  # one product and one sum: no order to choose


def test_the_switch_is_put_back() -> None:
    configurations = (impl.get_runtime().prog.config(), impl.current_cfg())
    before = [(c.real_matrix_scalarize, c.advanced_optimization) for c in configurations]
    run(aligned_zeros((3, 8)))
    assert [(c.real_matrix_scalarize, c.advanced_optimization) for c in configurations] == before


@pytest.mark.parametrize("reason", ["asked", "refused", "misaligned"])
def test_without_vector_mode(monkeypatch: pytest.MonkeyPatch, reason: str) -> None:
    x = aligned_copy(np.random.default_rng(0).standard_normal((7, 8)))
    if reason == "asked":
        monkeypatch.setenv("TIENGINE_VECTOR", "0")
    elif reason == "refused":
        bind = vector_mode._bind

        def fail(kernel: Any, arrays: Any, vectors: Any, wanted: bool) -> Any:
            if wanted:
                raise RuntimeError("not on this machine")
            return bind(kernel, arrays, vectors, wanted)

        monkeypatch.setattr(vector_mode, "_bind", fail)
    else:
        odd = aligned_zeros(7 * 8 + 1)[1:].reshape(7, 8)
        assert not is_aligned(odd)
        odd[...] = x
        x = odd
    want = expected(x)
    launch, got = run(x)
    assert not launch.vector_mode
    np.testing.assert_array_equal(got, want)


def test_another_taichi_gets_public_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vector_mode, "TESTED", (0, 0, 0))
    x = aligned_copy(np.random.default_rng(0).standard_normal((7, 4)))
    want = expected(x)
    launch, got = run(x)
    assert not launch.vector_mode
    np.testing.assert_array_equal(got, want)
