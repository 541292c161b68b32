"""Live heat maps: the method that passes the report's tests on this policy, if any does.

The tests take up to a minute. They run in another process, so that the flight goes on meanwhile.
"""

import logging
import multiprocessing
import os
from collections.abc import Sequence
from typing import Any

import torch
from numpy.typing import NDArray

from drone_rl.explanations import trust
from drone_rl.explanations.context import Context
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.hooks import of_input
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.flight.fly_page.world import Seen, World
from drone_rl.policies.policy import Policy
from drone_rl.utils.plugins import IMPORTED, import_plugin
from drone_rl.utils.seeding import root_seed

_log = logging.getLogger(__name__)
_NICE = 5
"""Lower priority of the process."""
_NUM_ENVS = 32


def find_trusted(policy: Policy) -> str | None:
    """Return the method that `drone-rl explain` would trust, or None; see `trust.check_maps`."""
    seed = root_seed(None)
    env = policy.make_env(_NUM_ENVS, seed=seed.value)
    context = Context(env, policy.make_network(), ExplainSettings(), seed=seed)
    trial = trust.make_trial(context)
    env.close()
    return trust.check_maps(trial, trust.method_maps(context.explainer)).trusted


def _work(policy: Policy, plugins: Sequence[str]) -> str | None:
    """Call `find_trusted` in a process of its own."""
    os.nice(_NICE)
    torch.set_num_threads(1)
    for plugin in plugins:  # which may register the policy's task
        import_plugin(plugin)
    return find_trusted(policy)


class LiveSaliency:
    """Heat maps of the observations of a world."""

    def __init__(self, world: World) -> None:
        """Take the world; nothing is tested or computed yet."""
        self._world = world
        self.state = "off"
        """off; testing; shown; none, if no method passed the tests; or failed."""
        self.method: str | None = None
        """The trusted method."""
        self.problem: str | None = None
        """Why the tests failed."""
        self._pool: Any = None
        self._result: Any = None
        self._explainer: Explainer | None = None

    def start(self) -> None:
        """Begin the tests, unless they have begun."""
        if self.state == "off":
            self._pool = multiprocessing.get_context("spawn").Pool(1)
            self._result = self._pool.apply_async(_work, (self._world.policy, [*IMPORTED]))
            self.state = "testing"

    def poll(self) -> None:
        """Take the result of the tests, if they have ended."""
        if self._result is None or not self._result.ready():
            return
        try:
            self.trust(self._result.get())
        except Exception as error:  # any of the process; also of a task that can't be sent there
            self.state, self.problem = "failed", str(error)
            name = self._world.policy.name
            _log.warning("the heat maps of policy %s can't be tested: %s", name, error)
        self.close()

    def trust(self, method: str | None) -> None:
        """Show the maps of a method, None for none."""
        self.method, self.state = method, "shown" if method else "none"

    def heat(self, seen: Seen) -> NDArray | None:
        """Return the map of an observation for the likeliest part of an action, see `Actions.part`.

        Shape: (h, w), that of the observation; None without a trusted method.
        """
        if self.method is None:
            return None
        world = self._world
        if self._explainer is None:
            network = of_input(world.policy.make_network(), world.scenes.name)
            self._explainer = Explainer(network, world.scenes.absent)
        part = torch.tensor(seen.probabilities).argmax()[None]
        maps = self._explainer.methods()[self.method](seen.observation, part, seen.rest)
        return maps[0].numpy()

    def close(self) -> None:
        """End the tests."""
        if self._pool is not None:
            self._pool.terminate()
        self._pool = self._result = None
