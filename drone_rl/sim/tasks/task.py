"""A task: all that simulators, verdicts and explanations must know of it."""

from typing import Protocol

from drone_rl.sim.tasks.explainable import Explainable
from drone_rl.sim.tasks.judgeable import Judgeable
from drone_rl.sim.tasks.playable import Playable, S


class Task(Playable[S], Judgeable, Explainable[S], Protocol[S]):
    """Something to do. It holds no world: all its methods are functions of what they are given."""
