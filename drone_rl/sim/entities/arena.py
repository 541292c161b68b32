# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false
# (dm_control's models of XML are untyped.)
"""The empty world: floor, light and sky. Its boundaries are invisible: they are rules."""

from dm_control import composer

from drone_rl.sim.rendering.semantics import Meaning

SKY_COLOR = (0.62, 0.74, 0.92)
"""Red, green, blue of everything that is neither floor, cube nor drone."""
FLOOR_COLOR = (0.5, 0.54, 0.48)
FLOOR_SIZE = (300.0, 300.0, 100.0)
"""Half extents in metres and the spacing of OpenGL's grid: coarse is 20 times faster there."""
DRAW_DISTANCE = 200.0
"""Metres beyond which nothing is drawn."""


class Field(composer.Arena):
    """A flat floor under an even sky, lit by one sun."""

    meaning = Meaning.GROUND

    def _build(self, name: str = "field") -> None:
        super()._build(name=name)
        root = self._mjcf_root
        root.statistic.extent = 1.0
        root.visual.map.set_attributes(znear=0.05, zfar=DRAW_DISTANCE)
        root.visual.headlight.active = 0
        root.visual.quality.shadowsize = 2048
        root.visual.rgba.haze = (*SKY_COLOR, 1.0)
        sky = {"rgb1": SKY_COLOR, "rgb2": SKY_COLOR, "width": 8, "height": 48}
        root.asset.add("texture", name="sky", type="skybox", builtin="flat", **sky)
        root.worldbody.add(
            "geom", name="floor", type="plane", size=FLOOR_SIZE, rgba=(*FLOOR_COLOR, 1.0)
        )
        root.worldbody.add(
            "light",
            name="sun",
            directional=True,
            pos=(0, 0, 50),
            dir=(0.35, -0.45, -0.82),
            ambient=(0.35,) * 3,
            diffuse=(0.75,) * 3,
            specular=(0, 0, 0),
            castshadow=False,
        )
