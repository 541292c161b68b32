"""A small second task, which shows that whatever knows a task knows none in particular.

Fly past posts that stand beside the way and touch none: a post that is passed earns 1, a touched
one ends the episode. Nothing is collected and nothing vanishes.
"""

import dataclasses
import enum
import types

import torch
from torch import Tensor

from drone_rl.sim.actions import MOVES, Entry
from drone_rl.sim.entities import Cube
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import Goals, Grid, OracleRule, State, Task
from drone_rl.sim.vocabulary import TaskVocabulary

NUM_POSTS = 2
REACH = 1.0
"""Metres along an axis up to which drone and post touch."""


class End(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    THROUGH = 1
    TOUCHED = 2
    TIME = 3


@dataclasses.dataclass
class PostsState(State):
    """Worlds with posts."""

    posts: Tensor  # (num_worlds, NUM_POSTS, 3) float64
    passed: Tensor  # (num_worlds, NUM_POSTS) bool


class Post(Cube):
    """A box that must not be touched."""

    semantic_class = SemanticClass.OBSTACLE


class Posts(Task[PostsState]):
    """The task."""

    name = "posts"
    ends = End
    truncation = End.TIME
    success_end = End.THROUGH
    expected_end = End.TIME
    observed = ("passed", "end_reason")
    vocabulary = TaskVocabulary(
        goal="post",
        reach="pass",
        reached="passed",
        target="post",
        handle="get past the post",
        handled="untouched",
        unhandled="touched",
        follows=False,
        tested="two posts",
    )
    strata = ("left", "right")
    blind_baselines = ("random", "forward")
    scored = ("passed", "sides")
    remembered = types.MappingProxyType(
        {"posts": "positions of the posts (T, 2, 3)", "next_target": "number of the next post (T,)"}
    )
    oracle = OracleRule(("end_reason",), lambda end: torch.zeros_like(end[..., 0]), MOVES)
    largest_reward = float(NUM_POSTS)

    @property
    def entries(self):
        """Which posts are passed, on which side they stand, and the end."""
        return {
            "passed": Entry((NUM_POSTS,), torch.bool),
            "sides": Entry((NUM_POSTS,), torch.int64, 0, 1),
            "end_reason": Entry((1,), torch.int64, 0, len(End) - 1),
            "posts": Entry((NUM_POSTS, 3), torch.float32),
        }

    def make_props(self):
        """The posts."""
        return [Post(1.0, (0.1, 0.1, 0.6), name=f"post_{i}") for i in range(NUM_POSTS)]

    def draw(self, random_state):
        """A side for each post: 1 to the left, -1 to the right."""
        return torch.from_numpy(random_state.choice([-1.0, 1.0], size=NUM_POSTS))

    def start(self, drawn, body):
        """Posts stand 3 m and 6 m ahead, 1.5 m aside."""
        ahead = 3.0 * torch.arange(1, NUM_POSTS + 1, dtype=torch.float64)
        posts = torch.stack([ahead.expand_as(drawn), 1.5 * drawn, torch.ones_like(drawn)], -1)
        return PostsState(
            body=body,
            posts=posts,
            passed=drawn > 2.0,
            steps=torch.zeros(len(drawn), dtype=torch.int64),
            end_reason=torch.zeros(len(drawn), dtype=torch.int64),
        )

    def judge(self, state, body):
        """A reward for each post that is now behind the drone."""
        away = (body.position[:, None] - state.posts).abs().amax(-1)
        passed = state.passed | (body.position[:, None, 0] > state.posts[..., 0])
        steps = state.steps + 1
        end = torch.zeros_like(steps).masked_fill(steps >= 12, End.TIME)
        end = end.masked_fill((away <= REACH).any(-1), End.TOUCHED)
        end = end.masked_fill(passed.all(-1), End.THROUGH)
        reward = (passed & ~state.passed).sum(-1, dtype=torch.float64)
        new = dataclasses.replace(state, body=body, passed=passed, steps=steps, end_reason=end)
        return new, reward

    def places(self, state):
        """Where the posts are."""
        return state.posts

    def info(self, state):
        """See `entries`."""
        return {
            "passed": state.passed.clone(),
            "sides": (state.posts[..., 1] < 0).long(),
            "end_reason": state.end_reason[:, None].clone(),
            "posts": state.posts.float(),
        }

    def score(self, info):
        """Each post is a goal; all come up at once."""
        sides = info["sides"]
        return Goals(reached=info["passed"], stratum=sides, world=sides.double())

    def remember(self, info):
        """Where the posts are, and how many lie behind."""
        return {"posts": info["posts"], "next_target": info["passed"].sum(-1)}

    def tally(self, info):
        passed = info["passed"].sum(-1)
        return passed, torch.zeros_like(passed)

    def recall(self, kept, body):
        """The posts as they stood."""
        index = torch.arange(NUM_POSTS)
        return PostsState(
            body=body,
            posts=kept["posts"].double(),
            passed=index < kept["next_target"][:, None],
            steps=kept["step"].clone(),
            end_reason=torch.zeros(len(kept["step"]), dtype=torch.int64),
        )

    def next_target(self, state):
        """The nearest post ahead."""
        return state.passed.sum(-1)

    def is_reached(self, state, target):
        """Whether it was passed."""
        return state.passed[torch.arange(len(state)), target]

    def needed(self, offset):
        """Away from a post in the way."""
        lateral = offset[..., 1]
        away = torch.where(lateral > 0, MOVES.right, MOVES.left)
        return away.masked_fill(lateral.abs() > REACH, 0)

    def stratum_at(self, offset):
        """Left or right."""
        return (offset[..., 1] < 0).long()

    def grid(self, num_forward, num_lateral):
        """Up to six metres ahead and three aside."""
        return Grid(
            torch.zeros(1).double(),
            torch.linspace(2.0, 6.0, num_forward).double(),
            torch.linspace(3.0, -3.0, num_lateral).double(),
        )

    def one_target(self, body, offset):
        """The last post there, the others behind."""
        state = self.start(torch.ones(len(offset), NUM_POSTS).double(), body)
        state.posts[:, :-1] -= 100.0
        state.posts[:, -1] = body.position + offset
        state.passed[:, :-1] = True
        return state

    def without_targets(self, state):
        """All posts far behind."""
        gone = torch.ones_like(state.passed)
        return dataclasses.replace(state, posts=state.posts - 100.0, passed=gone)

    def without_next(self, state):
        """The next one far behind."""
        following = self._is_next(state)
        posts = state.posts - 100.0 * following[..., None]
        return dataclasses.replace(state, posts=posts, passed=state.passed | following)

    def next_moved(self, state, metres):
        """The next one to the left."""
        posts = state.posts.clone()
        move = torch.as_tensor(metres).expand(len(state))[:, None]
        posts[..., 1] += move * self._is_next(state)
        return dataclasses.replace(state, posts=posts)

    def elsewhere(self, state, camera, generator):
        """All posts ahead, somewhere to either side."""
        draw = torch.rand(*state.posts.shape, generator=generator, dtype=torch.float64)
        away = torch.stack([3.0 + 3.0 * draw[..., 0], 4.0 * draw[..., 1] - 2.0], -1)
        posts = state.posts.clone()
        posts[..., :2] = state.body.position[:, None, :2] + away
        return dataclasses.replace(state, posts=posts, passed=torch.zeros_like(state.passed))
