"""A scene file of two rooms, for tests: 6 x 4 m, with a wall at x = 3 and a doorway in it."""

from pathlib import Path

SITES = """
<site name="start" type="box" pos="1.5 2 1" size="1 1.5 0.2"/>
<site name="goal" pos="5 3.2 1" size="0.1"/>
"""


def write_house(folder: Path, sites: str = SITES, wall: float = 1.4, name: str = "house") -> Path:
    """Write the scene; the wall goes from y = 0 to `wall` and from 2.6 to 4 m."""
    high, side = 1.25, 'type="box" rgba="0.8 0.75 0.6 1"'
    boxes = [
        (3, -0.05, high, 3.1, 0.05, high),
        (3, 4.05, high, 3.1, 0.05, high),
        (-0.05, 2, high, 0.05, 2, high),
        (6.05, 2, high, 0.05, 2, high),
        (3, wall / 2, high, 0.05, wall / 2, high),
        (3, 3.3, high, 0.05, 0.7, high),
    ]
    geoms = "".join(
        f'<geom {side} pos="{x} {y} {z}" size="{a} {b} {c}"/>' for x, y, z, a, b, c in boxes
    )
    path = folder / f"{name}.xml"
    path.write_text(
        f'<mujoco><worldbody><light name="sun" directional="true" dir="0.3 0.4 -1"/>'
        f'<geom type="plane" size="5 5 1" rgba="0.5 0.5 0.5 1"/>{geoms}{sites}'
        "</worldbody></mujoco>"
    )
    return path
