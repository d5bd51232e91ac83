"""Print the lowest versions that ``pyproject.toml`` allows of what the engine needs, one requirement per line."""

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
extras = project["optional-dependencies"]
tools = [line for line in extras["test"] if line.startswith(("pytest>", "hypothesis>"))]
for requirement in (*project["dependencies"], *extras["xarray"], *extras["parquet"], *tools):
    print(re.sub(r">=([^,]+).*", r"==\1", requirement))
