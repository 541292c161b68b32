"""Types that several settings share."""

from typing import Annotated

from drone_rl.utils.schema import Real, Whole

Seed = Annotated[int, Whole(0)]
NumEpisodes = Annotated[int, Whole(1, unit="episodes")]
NumEnvs = Annotated[int, Whole(1, unit="environments")]
Steps = Annotated[int, Whole(1, 100_000, "steps")]
Pixels = Annotated[int, Whole(1, 1024, "pixels")]
Fraction = Annotated[float, Real(0.0, 1.0)]
OpenFraction = Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)]
"""Neither 0 nor 1."""
