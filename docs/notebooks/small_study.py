# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A small study
# Two speeds on a few tracks: how far do the largest wheel forces scatter?

# %%
import tempfile
from pathlib import Path

import tiengine

distance, seeds = 20.0, 8
folder = Path(tempfile.mkdtemp()) / "speeds"
plan = {
    "scenario": "default",
    "seeds": seeds,
    "set": {"train.distance": distance, "output.run_in": 1.0},
    "factors": [{"key": "train.speed_kmh", "name": "speed", "values": [300.0, 350.0]}],
}

# %%
with tiengine.LiveProgress("trains") as progress:
    study = tiengine.study(plan, folder, workers=1, progress=progress)
study

# %%
column = "largest_vertical_wheel_force_Q_kN"
[
    (each.percent, round(each.value, 1), round(each.low, 1), round(each.high, 1))
    for each in study.percentiles(column, [50, 90])
]

# %%
from tiengine.study.pictures import draw_exceedance, draw_scatter

draw_scatter(study.table(), column)

# %%
values = study.table().values(column)
draw_exceedance(values, column, study.extremes(column) if len(values) >= 10 else None)
