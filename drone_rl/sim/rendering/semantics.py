"""What the things in a world are to a drone."""

import enum


class Meaning(enum.IntEnum):
    """Of one thing. Which target is the next one is not told here: that is the state's business."""

    SKY = 0
    GROUND = 1
    TARGET = 2
    OBSTACLE = 3
    DRONE = 4
    DISTRACTOR = 5
