"""Live heat maps: the method that passes the report's tests on this policy, if any does.

The tests take up to a minute. They run in another process, so that the flight goes on meanwhile.
"""

import importlib
import logging
import multiprocessing
import os
import pickle
from collections.abc import Sequence
from multiprocessing.connection import Connection
from typing import Any

import torch
from numpy.typing import NDArray

from drone_rl.explanations import trust
from drone_rl.explanations.context import Context
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.scenes import empty_scene
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.flight.fly_page.world import Seen, World
from drone_rl.policies.policy import Policy
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import IMPORTED
from drone_rl.utils.seeding import root_seed

_log = logging.getLogger(__name__)
_NICE = 5
"""Lower priority of the process."""
_NUM_ENVS = 32


def find_trusted(policy: Policy) -> str | None:
    """Return the method that `drone-rl explain` would trust, or None; see `trust.check_maps`."""
    settings, seed = ExplainSettings(), root_seed(None)
    env = policy.make_env(_NUM_ENVS, seed=seed.value)
    context = Context(env, policy.make_network(), settings, seed=seed)
    data, scenes = context.dataset, context.scenes
    state = data.state(scenes.task, scenes.worlds.dynamics)
    trial = trust.make_trial(
        scenes,
        context.network,
        state,
        data.tensor("actions"),
        data.episode,
        context.seed.value,
    )
    env.close()
    return trust.check_maps(trial, trust.method_maps(context.explainer)).trusted


def _work(connection: Connection, policy: Policy, plugins: Sequence[str]) -> None:
    os.nice(_NICE)
    torch.set_num_threads(1)
    for module in plugins:  # which may register the policy's task
        importlib.import_module(module)
    try:
        connection.send((find_trusted(policy), None))
    except InputError as error:
        connection.send((None, str(error)))


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
        self._process: Any = None
        self._connection: Connection | None = None
        self._explainer: Explainer | None = None

    def start(self) -> None:
        """Begin the tests, unless they have begun."""
        if self.state != "off":
            return
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe(duplex=False)
        policy = self._world.policy
        process = context.Process(target=_work, args=(theirs, policy, [*IMPORTED]), daemon=True)
        try:
            process.start()
        except (pickle.PicklingError, AttributeError, TypeError):  # as of a task object
            self._fail("its task, or another part, can't be sent to another process")
        else:
            self._process, self.state = process, "testing"
        theirs.close()

    def _fail(self, problem: str) -> None:
        self.state, self.problem = "failed", problem
        name = self._world.policy.name
        _log.warning("the heat maps of policy %s can't be tested: %s", name, problem)
        self.close()

    def poll(self) -> None:
        """Take the result of the tests, if they have ended."""
        if self._connection is None or not self._connection.poll():
            return
        try:
            method, problem = self._connection.recv()
        except EOFError:
            method, problem = None, "the process ended early"
        self.trust(method)
        if problem is not None:
            self._fail(problem)
        else:
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
            network = world.policy.make_network()
            self._explainer = Explainer(network, world.scenes.observe(empty_scene(world.scenes))[0])
        part = torch.tensor(seen.probabilities).argmax()[None]
        maps = self._explainer.methods()[self.method](seen.observation, part)
        return maps[0].numpy()

    def close(self) -> None:
        """End the tests."""
        if self._process is not None:
            self._process.terminate()
            self._process.join()
            self._process = None
        if self._connection is not None:
            self._connection.close()
            self._connection = None
