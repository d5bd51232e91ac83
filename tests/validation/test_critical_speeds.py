"""Linear critical speeds of presets as shipped: what the springs in series with the dampers are worth."""

from validation.cases import critical_speed as case
from validation.cases.critical_speed import Setting, linear
from validation.closed_forms.linear_vehicle import critical_speed


def test_series_springs_keep_the_full_crh380a_stable():
    """As shipped none up to 1000 km/h on LMA/CHN60; with the dampers alone, as it was, the bogies hunt below 450."""
    shipped = Setting("CRH380A_v6", series=False)
    assert linear(shipped)[1] > 700.0
    bare = case.load_scenario("smooth", [*shipped.overrides, "train.vehicles.0.series_springs=false"])
    assert 300.0 < critical_speed(*case._linearised(bare, case.AMPLITUDE)) < 450.0
