"""Operations and bytes of the step's matrix products, counted from their operands.

One step runs with NumPy's products replaced by counting ones, so that the count follows the step itself. Products
written with ``@`` (those of a damaged slab) are not counted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np

from tiengine.engine.stepper import Rows, Stepper

__all__ = ["Work", "count_products", "work_of"]


@dataclass(frozen=True)
class Work:
    """Matrix products.

    Attributes:
        products: Number of products.
        flops: Multiplications and additions.
        traffic: Bytes of operands and results, each touched once per product.
        read: Bytes of the operands alone.
    """

    products: int = 0
    flops: int = 0
    traffic: int = 0
    read: int = 0

    def __add__(self, other: Work) -> Work:
        """Sum of both."""
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


def count_products(stepper: Stepper) -> dict[str, Work]:
    """Take the last step once more, without watchers, and count its products stage by stage.

    Args:
        stepper: A loaded stepper.

    Returns:
        Work by name of the stage; stages without products left out.
    """
    work: dict[str, Work] = {}
    found: list[Work] = []

    def counting(product: Callable[..., Any]) -> Callable[..., Any]:
        def counted(a: Any, b: Any, *others: Any, **options: Any) -> Any:
            result = product(a, b, *others, **options)
            found.append(work_of(a, b, result))
            return result

        return counted

    with patch.object(np, "matmul", counting(np.matmul)), patch.object(np, "dot", counting(np.dot)):
        stepper.bind()  # stages keep the products that they were made with
        stepper.rows = Rows(max(stepper.rows.step, 0))
        for name, call in stepper.stages:
            found.clear()
            call()
            if found:
                work[name] = sum(found, work.get(name, Work()))
    stepper.bind()
    return work
