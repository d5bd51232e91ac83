"""The default numerics are the ones that the convergence study judges."""

from tiengine.scenario.scenario import load_scenario
from tiengine.track.knots import Grading
from validation.convergence.study import DEFAULT


def test_defaults_are_the_convergence_studys():
    scenario = load_scenario("default")
    numerics, slab = scenario.numerics, scenario.parts.slab
    assert numerics.trial_functions == DEFAULT.functions
    assert numerics.knots == Grading()
    assert numerics.truncation == DEFAULT.truncation
    assert numerics.passes == DEFAULT.passes
    assert scenario.window_length == DEFAULT.window
    assert scenario.parts.fastening.length == DEFAULT.seat
    assert (slab.elements_x, slab.elements_y) == DEFAULT.mesh


def test_the_studys_default_is_the_scenarios():
    """Written out as changes of the default scenario, its settings change nothing but distance, step and samples."""
    default, studied = load_scenario("default"), load_scenario("default", DEFAULT.overrides)
    assert studied.numerics.knots == default.numerics.knots
    assert studied.window_length == default.window_length
    assert studied.parts.fastening.model_dump() == default.parts.fastening.model_dump()
