# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false
# (dm_control's models of XML are untyped.)
"""The thing to collect."""

from dm_control import composer, mjcf

from drone_rl.sim.rendering.semantics import Meaning


class Cube(composer.Entity):
    """A cube that is seen but never pushes: touching is a rule, not a contact."""

    meaning = Meaning.TARGET

    def _build(self, size: float, color: tuple[float, float, float], name: str = "cube") -> None:
        """Makes the cube.

        Args:
            size: Edge in metres.
            color: Red, green, blue in [0, 1].
            name: Prefix of its elements in the arena's model.
        """
        self._mjcf_root = mjcf.RootElement(model=name)
        self._geom = self._mjcf_root.worldbody.add(
            "geom",
            name="geom",
            type="box",
            size=(size / 2,) * 3,
            rgba=(*color, 1.0),
            contype=0,
            conaffinity=0,
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """The cube's MJCF root."""
        return self._mjcf_root

    @property
    def geom(self) -> mjcf.Element:
        """The visible box."""
        return self._geom
