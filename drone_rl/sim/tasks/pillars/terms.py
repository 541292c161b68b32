"""The words of flying through pillars."""

import dataclasses

from drone_rl.config import PillarsSettings
from drone_rl.sim.vocabulary import Terms
from drone_rl.utils.text import plural

_TERMS = Terms(
    goal="row",
    reach="pass",
    reached="passed",
    target="pillar",
    handle="get past the pillar",
    handled="flown around",
    unhandled="touched, or never passed",
    follows=False,
    sides={
        "left": "that call for a turn left",
        "ahead": "that are open straight ahead",
        "right": "that call for a turn right",
    },
    places={
        "left": "that call for a turn left",
        "ahead": "that leave the way free",
        "right": "that call for a turn right",
    },
    classes={"row": "at the {value} row", "gap": "at gaps of {value}"},
    labels={
        "row": "number of the row",
        "side": "nearest way through",
        "gap": "width of the gap",
        "end": "how it ended",
    },
    ends={
        "finish_line": "at the line",
        "pillar_touched": "by touching a pillar",
        "side_boundary": "outside the field, left or right",
        "step_limit": "at the step limit",
        "lost_control": "with the drone out of control",
    },
)


def terms(settings: PillarsSettings) -> Terms:
    """The words of the task with these settings."""
    tested = (
        f"{plural(settings.num_rows, 'row')} of pillars {settings.width:g} m wide, "
        f"{settings.density:g} for each metre across, {settings.spacing:g} m from row to row"
    )
    return dataclasses.replace(_TERMS, tested=tested)
