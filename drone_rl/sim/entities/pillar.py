# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false
# (dm_control's models of XML are untyped.)
"""The thing to fly around."""

from dm_control import composer, mjcf

from drone_rl.sim.rendering.semantics import Meaning


class Pillar(composer.Entity):
    """An upright box that is seen but never pushes back: touching it is a rule, not a contact."""

    meaning = Meaning.OBSTACLE

    def _build(
        self,
        width: float,
        height: float,
        color: tuple[float, float, float],
        name: str = "pillar",
    ) -> None:
        """Makes the pillar; its frame is in its middle.

        Args:
            width: Edge of its square cross-section, metres.
            height: Metres.
            color: Red, green, blue in [0, 1].
            name: Prefix of its elements in the arena's model.
        """
        self._mjcf_root = mjcf.RootElement(model=name)
        self._geom = self._mjcf_root.worldbody.add(
            "geom",
            name="geom",
            type="box",
            size=(width / 2, width / 2, height / 2),
            rgba=(*color, 1.0),
            contype=0,
            conaffinity=0,
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """The pillar's MJCF root."""
        return self._mjcf_root

    @property
    def geom(self) -> mjcf.Element:
        """The visible box."""
        return self._geom
