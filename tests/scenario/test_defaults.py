"""The default numerics are the ones that the convergence study chose."""

from tiengine.scenario.scenario import load_scenario
from validation.convergence.study import RECOMMENDED


def test_defaults_are_the_convergence_studys():
    scenario = load_scenario("default")
    numerics, slab = scenario.numerics, scenario.parts.slab
    assert numerics.modes_per_metre == RECOMMENDED.modes  # of the sines; the study of the splines is MODEL section 1a
    assert numerics.truncation == RECOMMENDED.truncation
    assert numerics.passes == RECOMMENDED.passes
    assert (slab.elements_x, slab.elements_y) == RECOMMENDED.mesh
