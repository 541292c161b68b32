"""Settings of the task `reach`: fly to a goal in a scene file."""

from typing import Annotated, Any, ClassVar

from drone_rl.config.task import add_task
from drone_rl.config.term_task import ObjectSettings, SiteName, StartSettings, TermTaskSettings
from drone_rl.config.terms import Ends, Rewards, Success
from drone_rl.utils.schema import Listed, Real, Span, Whole

_GOAL = ObjectSettings(
    shape="ball", role="goal", size=(0.4, 0.4, 0.4), color=(0.9, 0.1, 0.5), site="goal"
)


class ReachStartSettings(StartSettings):
    """Where the drone starts in a scene. Metres and degrees, world frame."""

    heading: Annotated[Any, Span(Real(-360.0, 360.0, unit="deg"))] = (-180.0, 180.0)
    """To the left of the x axis, or of that of the site."""
    apart: Annotated[float, Real(0.0, 1000.0, unit="m")] = 0.1
    """Least distance between the drone's surface and those of solids, obstacles and goals."""
    site: SiteName = "start"
    """Where it starts: at one of the sites whose names begin with this, anywhere in the site if
    that is a box; in all free space if there is none, or with `anywhere`."""


@add_task
class ReachSettings(TermTaskSettings):
    """Reach a goal in a scene without touching what is solid; see `TermTaskSettings`."""

    name: ClassVar[str] = "reach"
    scene: Annotated[tuple[str, ...], Listed("scene file", 16)] | None = ("indoor",)
    """File of the scene, MJCF or a mesh, or the name of a shipped one, or several, one of which
    each episode draws."""
    objects: dict[str, ObjectSettings] = {"goal": _GOAL}
    """Objects by name; the goal is at the sites whose names begin with goal."""
    start: ReachStartSettings = ReachStartSettings()  # pyright: ignore[reportIncompatibleVariableOverride] (settings are frozen)
    """Where the drone starts."""
    reward: Rewards = {"progress": 0.3, "reached": 2.0, "contact": -1.0, "time": -0.01}  # pyright: ignore[reportAssignmentType] (read)
    """Its terms by name, with weights; progress is along the shortest path."""
    end: Ends = ["contact", "out_of_bounds"]  # pyright: ignore[reportAssignmentType] (read)
    """Reasons to end an episode, by name; earlier ones precede later ones and success."""
    success: Success = ["all_goals"]  # pyright: ignore[reportAssignmentType] (read)
    """The one meaning of success, by name."""
    margin: Annotated[float, Real(0.0, 1000.0, unit="m")] = 1.0
    """How far outside the scene's solids the bounds are."""
    drone_size: Annotated[float, Real(0.01, 10.0, unit="m")] = 0.3
    """Diameter of the ball that touches solids and objects."""
    step_length: Annotated[float, Real(0.001, 100.0, unit="m")] = 0.3
    """Length of one move."""
    step_limit: Annotated[int, Whole(1, 100_000, "steps")] = 300
    """Steps after which an episode is truncated."""
