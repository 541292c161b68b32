"""A small user-defined task, to test that no code depends on a particular task.

The drone flies past posts next to its path without touching them. The reward is 1 for each passed
post; touching one ends the episode. Nothing is collected or removed.
"""

import dataclasses
import enum

import torch
from torch import Tensor

from drone_rl.sim.actions import MOVES, Entry
from drone_rl.sim.entities import Cube
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import Goals, Grid, OracleRule, State, Task
from drone_rl.sim.tasks.common import Side
from drone_rl.sim.vocabulary import TaskVocabulary

NUM_POSTS = 2
REACH = 1.0
"""Greatest distance along each axis, in metres, at which drone and post touch."""


class End(enum.IntEnum):
    """The reason why an episode ended."""

    RUNNING = 0
    THROUGH = 1
    TOUCHED = 2
    TIME = 3


@dataclasses.dataclass
class PostsState(State):
    """The state of environments with posts."""

    posts: Tensor  # (num_envs, NUM_POSTS, 3) float64
    passed: Tensor  # (num_envs, NUM_POSTS) bool


class Post(Cube):
    """A box that the drone must not touch."""

    semantic_class = SemanticClass.OBSTACLE


class Posts(Task[PostsState]):
    """Fly past all posts without touching one."""

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
    oracle = OracleRule(("end_reason",), lambda end: torch.zeros_like(end[..., 0]), MOVES)
    largest_reward = float(NUM_POSTS)

    @property
    def entries(self):
        """The passed posts, the sides of the posts, the end reason and the positions."""
        return {
            "passed": Entry((NUM_POSTS,), torch.bool),
            "sides": Entry((NUM_POSTS,), torch.int64, 0, 1),
            "end_reason": Entry((1,), torch.int64, 0, len(End) - 1),
            "posts": Entry((NUM_POSTS, 3), torch.float32),
        }

    def make_props(self):
        """Return the posts."""
        return [Post(1.0, (0.1, 0.1, 0.6), name=f"post_{i}") for i in range(NUM_POSTS)]

    def sample(self, random_state):
        """Sample a side for each post: 1 for left, -1 for right."""
        return torch.from_numpy(random_state.choice([-1.0, 1.0], size=NUM_POSTS))

    def start(self, drawn, body):
        """Place posts 3 m and 6 m ahead and 1.5 m to the side."""
        ahead = 3.0 * torch.arange(1, NUM_POSTS + 1, dtype=torch.float64)
        posts = torch.stack([ahead.expand_as(drawn), 1.5 * drawn, torch.ones_like(drawn)], -1)
        return PostsState(
            body=body,
            posts=posts,
            passed=drawn > 2.0,
            steps=torch.zeros(len(drawn), dtype=torch.int64),
            end_reason=torch.zeros(len(drawn), dtype=torch.int64),
        )

    def step(self, state, body):
        """Reward each post that the drone has passed in this step."""
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
        """Return the positions of the posts."""
        return state.posts

    def info(self, state):
        """Return the values of `entries`."""
        return {
            "passed": state.passed,
            "sides": (state.posts[..., 1] < 0).long(),
            "end_reason": state.end_reason[:, None],
            "posts": state.posts.float(),
        }

    def score(self, info):
        """Return each post as a goal; all are available from the start."""
        sides = info["sides"]
        return Goals(reached=info["passed"], stratum=sides, world=sides.double())

    @property
    def edits(self):
        """How explanations change its scenes, as of `SceneEdits`."""
        return self

    def next_target(self, state):
        """Return the index of the nearest post ahead."""
        return state.passed.sum(-1)

    def next_offset(self, state):
        """Return where the next post stands, seen from the drone."""
        target = self.next_target(state).clamp(max=NUM_POSTS - 1)
        away = state.posts[torch.arange(len(state)), target] - state.body.position
        return torch.where(state.passed.all(-1)[:, None], torch.nan, away)

    def is_behind(self, state, target):
        """Return whether a post is behind the drone."""
        return state.body.position[:, 0] > state.posts[torch.arange(len(state)), target, 0]

    def is_reached(self, state, target):
        """Return whether the target was passed."""
        return state.passed[torch.arange(len(state)), target]

    def needed(self, offset):
        """Return the action that moves away from a post in the path."""
        lateral = offset[..., 1]
        away = torch.where(lateral > 0, MOVES.right, MOVES.left)
        return away.masked_fill(lateral.abs() > REACH, 0)

    def stratum_at(self, offset):
        """Return the side of an offset, left or right."""
        return torch.where(offset[..., 1] < 0, Side.RIGHT, Side.LEFT)

    def grid(self, num_forward, num_lateral):
        """Return a grid up to 6 m ahead and 3 m to each side."""
        return Grid(
            torch.zeros(1).double(),
            torch.linspace(2.0, 6.0, num_forward).double(),
            torch.linspace(3.0, -3.0, num_lateral).double(),
        )

    def one_target(self, body, offset):
        """Place the last post at an offset and the others behind the drone."""
        state = self.start(torch.ones(len(offset), NUM_POSTS).double(), body)
        state.posts[:, :-1] -= 100.0
        state.posts[:, -1] = body.position + offset
        state.passed[:, :-1] = True
        return state

    def without_next(self, state):
        """Place the next post far behind the drone."""
        following = is_next(self, state)
        posts = state.posts - 100.0 * following[..., None]
        return dataclasses.replace(state, posts=posts, passed=state.passed | following)

    def next_moved(self, state, metres):
        """Move the next post to the left."""
        posts = state.posts.clone()
        move = torch.as_tensor(metres).expand(len(state))[:, None]
        posts[..., 1] += move * is_next(self, state)
        return dataclasses.replace(state, posts=posts)

    def elsewhere(self, state, camera, generator):
        """Place all posts at random positions ahead."""
        sample = torch.rand(*state.posts.shape, generator=generator, dtype=torch.float64)
        away = torch.stack([3.0 + 3.0 * sample[..., 0], 4.0 * sample[..., 1] - 2.0], -1)
        posts = state.posts.clone()
        posts[..., :2] = state.body.position[:, None, :2] + away
        return dataclasses.replace(state, posts=posts, passed=torch.zeros_like(state.passed))


def is_next(task, state):
    """Return which post is the next target. Shape: (N, NUM_POSTS)."""
    return torch.arange(NUM_POSTS) == task.next_target(state)[:, None]
