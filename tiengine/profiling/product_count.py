"""Operations and bytes of the step's matrix products, counted from the arrays that they are given.

One step runs with NumPy's products replaced by ones that count, so that the count follows whatever the step does.
Products written with ``@`` (a damaged slab's) are not seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np

from tiengine.engine.state import State
from tiengine.engine.stepper import Chunk, Stepper
from tiengine.model.model import Model

__all__ = ["Work", "count_products", "work_of"]


@dataclass(frozen=True)
class Work:
    """Matrix products.

    Attributes:
        products: How many.
        flops: Multiplications and additions.
        traffic: Bytes of operands and results, each touched once a product.
        read: Bytes of the operands alone.
    """

    products: int = 0
    flops: int = 0
    traffic: int = 0
    read: int = 0

    def __add__(self, other: Work) -> Work:
        """Both."""
        return Work(
            self.products + other.products,
            self.flops + other.flops,
            self.traffic + other.traffic,
            self.read + other.read,
        )


def work_of(a: Any, b: Any, result: Any) -> Work:
    """Work of a @ b = result, of any shapes that NumPy multiplies."""
    read = a.nbytes + b.nbytes
    return Work(1, 2 * np.size(result) * a.shape[-1], read + np.asarray(result).nbytes, read)


def count_products(model: Model, state: State, chunk: Chunk, load: Callable[[Stepper], object]) -> dict[str, Work]:
    """Take one step and count its products, stage by stage.

    Args:
        model: Constant data.
        state: Advanced by one step.
        chunk: Buffers.
        load: Loads the coming step.

    Returns:
        Work by name of the stage, in ``Stepper.stages``; stages without products left out.
    """
    work: dict[str, Work] = {}
    where = [""]

    def counting(product: Callable[..., Any]) -> Callable[..., Any]:
        def counted(a: Any, b: Any, *rest: Any, **options: Any) -> Any:
            result = product(a, b, *rest, **options)
            work[where[0]] = work.get(where[0], Work()) + work_of(a, b, result)
            return result

        return counted

    def named(name: str, call: Callable[[], object]) -> Callable[[], object]:
        def stage() -> None:
            where[0] = name
            call()

        return stage

    with patch.object(np, "matmul", counting(np.matmul)), patch.object(np, "dot", counting(np.dot)):
        stepper = Stepper(model, state, chunk)  # anew: a stepper may hold on to the products it was made with
        stepper.stages = tuple((name, named(name, call)) for name, call in stepper.stages)
        load(stepper)
        stepper.step(0)
    return {name: each for name, each in work.items() if name}
