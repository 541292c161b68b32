# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false
# (dm_control's models of XML are untyped.)
"""A thing that means nothing, for policies to be distracted by and for people to look at."""

from dm_control import composer, mjcf

from drone_rl.sim.rendering.semantics import Meaning

KINDS = ("box", "sphere", "cylinder")
"""Of all that there are in a world, in turn."""


class Distractor(composer.Entity):
    """A box, a ball or a cylinder of 1 m, seen but never touched; worlds make it larger."""

    meaning = Meaning.DISTRACTOR

    def _build(self, kind: str, name: str = "distractor") -> None:
        """Makes one.

        Args:
            kind: One of `KINDS`.
            name: Prefix of its elements in the arena's model.
        """
        self._mjcf_root = mjcf.RootElement(model=name)
        self._geom = self._mjcf_root.worldbody.add(
            "geom",
            name="geom",
            type=kind,
            size=(0.5,) * 3,
            rgba=(0.6, 0.6, 0.6, 1.0),
            contype=0,
            conaffinity=0,
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """Its MJCF root."""
        return self._mjcf_root

    @property
    def geom(self) -> mjcf.Element:
        """What is seen of it."""
        return self._geom


def make_distractors(count: int) -> list[Distractor]:
    """So many, of all kinds in turn."""
    kinds = (KINDS[i % len(KINDS)] for i in range(count))
    return [Distractor(kind, name=f"distractor_{i}") for i, kind in enumerate(kinds)]
