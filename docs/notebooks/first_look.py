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
# # A first look
# One train over a few metres of track: the scenario, the run with its progress, and figures of the result.

# %%
import tiengine

distance = 20.0
scenario = tiengine.load_scenario("default", {"train.distance": distance, "output.run_in": 1.0})
scenario

# %%
with tiengine.LiveProgress("simulated s") as progress:
    result = tiengine.run(scenario, progress=progress)
result

# %%
result.plot("forces")

# %%
result.plot("contact")

# %% [markdown]
# Channels are arrays with units and coordinates.

# %%
wheel = result.to_xarray("wheel")
wheel["vertical_force"].isel(wheelset=0).sel(side="left").max().item()
