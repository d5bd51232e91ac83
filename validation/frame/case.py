"""Cases: one number, or one row of numbers, against a reference with a tolerance."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from tiengine.parameters.arrays import Reals

__all__ = ["Case", "Outcome", "evaluate"]

Kind = Literal["verification", "validation", "full length", "convergence", "information"]
Verdict = Literal["ok", "MISS", "for information", "left out", "not run"]


@dataclass(frozen=True, kw_only=True)
class Case:
    """One row of the table.

    Attributes:
        name: Unique name; ``--only`` takes it or its beginning.
        kind: ``verification`` against a closed form, ``validation`` against published numbers,
            ``full length`` against the traditional model, ``convergence`` against the engine at a finer step or mesh,
            ``information`` without a verdict.
        quantity: Compared quantity, with its unit.
        source: Source of the reference.
        reference: The number or numbers; computed if it is a closed form.
        why: Reason for the tolerance, or for leaving the case out.
        compute: The engine's number, of the reference's shape; None if the case is left out.
        rtol: Tolerance relative to the reference.
        atol: Tolerance in the quantity's unit; may differ from number to number.
        rule: Whether the reference is a value to meet or a bound.
        quick: Whether ``--quick`` runs it.
    """

    name: str
    kind: Kind
    quantity: str
    source: str
    reference: ArrayLike | Callable[[], ArrayLike]
    why: str
    compute: Callable[[], ArrayLike] | None
    rtol: float = 0.0
    atol: ArrayLike = 0.0
    rule: Literal["within", "at most", "at least"] = "within"
    quick: bool = True


@dataclass(frozen=True)
class Outcome:
    """A case with its result; if it has several numbers, the one that uses most of its tolerance.

    Cases for information have no tolerance and show all.

    Attributes:
        case: The case.
        verdict: Whether the tolerance is met.
        reference: Reference as text.
        ours: The engine's number as text, or the error.
        deviation: The engine's number minus the reference, as text.
        tolerance: Allowed deviation as text.
        seconds: Wall time.
    """

    case: Case
    verdict: Verdict
    reference: str = ""
    ours: str = ""
    deviation: str = ""
    tolerance: str = ""
    seconds: float = 0.0


def evaluate(case: Case) -> Outcome:
    """Compute and judge a case; an error of the engine is a miss with its message."""
    if case.compute is None:
        return Outcome(case, "left out")
    clock = time.perf_counter()
    try:
        reference = _reals(case.reference() if callable(case.reference) else case.reference)
        ours = _reals(case.compute())
    except (RuntimeError, ValueError) as error:  # InputError is a ValueError, RunFailed a RuntimeError
        return Outcome(case, "MISS", ours=str(error), seconds=time.perf_counter() - clock)
    if ours.shape != reference.shape:
        raise TypeError(f"{case.name}: {ours.shape} numbers against {reference.shape}")
    return _judge(case, reference, ours, time.perf_counter() - clock)


def _judge(case: Case, reference: Reals, ours: Reals, seconds: float) -> Outcome:
    """Compare number by number and select the worst."""
    deviation = ours - reference
    allowed = case.rtol * np.abs(reference) + np.broadcast_to(_reals(case.atol), reference.shape)
    excess = {"within": np.abs(deviation), "at most": deviation, "at least": -deviation}[case.rule]
    with np.errstate(divide="ignore", invalid="ignore"):
        margin = np.where(allowed > 0.0, excess / allowed, np.where(excess > 0.0, np.inf, excess))
    met = bool(np.all(excess <= allowed))  # false for a NaN as well
    worst = int(np.argmax(np.where(np.isnan(margin), np.inf, margin)))
    if case.kind == "information":
        wanted, found = (", ".join(_number(x) for x in values) for values in (reference, ours))
        return Outcome(case, "for information", wanted, found, seconds=seconds)
    bound = "" if case.rule == "within" else case.rule + " "
    return Outcome(
        case,
        "ok" if met else "MISS",
        reference=bound + _number(reference[worst]),
        ours=_number(ours[worst]),
        deviation=_deviation(deviation[worst], reference[worst]) if case.rule == "within" else "",
        tolerance=_tolerance(case, allowed[worst]),
        seconds=seconds,
    )


def _reals(values: ArrayLike) -> Reals:
    return np.atleast_1d(np.asarray(values, dtype=np.float64)).ravel()


def _number(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.5g}"


def _deviation(deviation: float, reference: float) -> str:
    """Deviation as text, relative to the reference if that is meaningful."""
    if reference != 0.0 and abs(deviation) < abs(reference):
        return f"{100.0 * deviation / abs(reference):+.2g} %"
    return f"{deviation:+.2g}"


def _tolerance(case: Case, allowed: float) -> str:
    if case.rule != "within" and allowed == 0.0:
        return "bound"
    return f"{100.0 * case.rtol:.2g} %" if case.rtol and not np.any(case.atol) else f"{allowed:.2g}"
