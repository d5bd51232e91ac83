"""Few cases that contain every combination of the values of any few factors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, product
from typing import Any

import numpy as np

CANDIDATES = 40


def covering(factors: Mapping[str, Sequence[Any]], strength: int) -> list[dict[str, Any]]:
    """Cases in which any ``strength`` factors take every combination of their values; the same in every call.

    Greedy: of random cases that contain an open combination, the one that contains most of them is next.

    Args:
        factors: Values by name.
        strength: Number of factors.
    """
    names = list(factors)
    places = list(combinations(range(len(names)), strength))
    values = [range(len(factors[name])) for name in names]
    left = {(at, which) for at in places for which in product(*(values[k] for k in at))}
    random, cases = np.random.default_rng(0), []
    while left:
        candidates = random.integers(0, [len(value) for value in values], (CANDIDATES, len(values)))
        at, which = min(left)
        candidates[:, at] = which
        contained = [{(p, tuple(int(case[k]) for k in p)) for p in places} & left for case in candidates]
        best = max(range(CANDIDATES), key=lambda i: len(contained[i]))
        left -= contained[best]
        cases.append({name: factors[name][k] for name, k in zip(names, candidates[best], strict=True)})
    return cases
