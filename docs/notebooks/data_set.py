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
# # A data set for learning
# Wheel forces and the irregularity that causes them, in windows, split by track; a linear model as a first surrogate.

# %%
import tempfile
from pathlib import Path

import numpy as np
import tiengine
import xarray

distance, seeds = 40.0, 10
folder = Path(tempfile.mkdtemp())
plan = {"scenario": "default", "seeds": seeds, "set": {"train.distance": distance, "irregularity.taper": 2.0}}
study = tiengine.study(plan, folder / "study", workers=1)

# %%
study.dataset(folder / "set.zarr", length=2.0, step=1.0, samples=64)

# %%
data = xarray.open_zarr(folder / "set.zarr", group="train", chunks=None)
data

# %% [markdown]
# The force of the leading left wheel in the middle of a window, from the irregularity along the window.


# %%
def inputs_and_force(split):
    """Irregularity (windows, samples) and force in the middle of each window [N]."""
    part = xarray.open_zarr(folder / "set.zarr", group=split, chunks=None).isel(wheelset=0, side=0)
    return part["irregularity_vertical"].values, part["wheel_vertical_force"].values[:, 32]


x, force = inputs_and_force("train")
mean = force.mean()
curvature = np.diff(x, 2, axis=1)[:, ::4]
weights = np.linalg.lstsq(curvature, force - mean, rcond=1e-2)[0]

# %%
x, force = inputs_and_force("test")
residual = force - mean - np.diff(x, 2, axis=1)[:, ::4] @ weights
print(f"deviation {force.std() / 1e3:.2f} kN, of the residual on other tracks {residual.std() / 1e3:.2f} kN")
