"""The table of perturbation axes, `axes.toml`, for programs that do not import torch."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

TABLE: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).with_name("axes.toml").read_text(encoding="utf-8")
)
"""Axes by name; `axes.toml` documents the entries."""
NAMES: Mapping[str, str] = {name: axis["label"] for name, axis in TABLE.items()}
"""Axes by name, in reports."""
