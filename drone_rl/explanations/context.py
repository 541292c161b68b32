"""State that all sections share: a policy, its environments, rollouts and heat maps."""

import copy
import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.envs import base_env
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.hooks import (
    feature_layer,
    find_layer,
    of_input,
    probabilities,
    rest_in,
    spatial_layers,
)
from drone_rl.explanations.rollouts import RolloutDataset, collect, render_frames, select_frames
from drone_rl.explanations.scenes import Scenes
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import ImageNetwork, make_actor
from drone_rl.trust.results import Proof
from drone_rl.trust.shifts_results import SavedShifts
from drone_rl.utils.limits import FILM_BYTES, FILM_STEPS
from drone_rl.utils.seeding import RootSeed, Stream, torch_generator, with_seed

FILMED = 0  # the episode shown as a film: always the first


Need = Callable[["Context"], str | None]
"""Returns why a policy or its task lacks something, as a sentence; None if it has it."""
Declared = TypeVar("Declared", bound=Callable[..., Any])


class LeftOutError(Exception):
    """A section turns out to be impossible while it is computed; the message says why."""


class Context:
    """One policy that is being explained.

    Each shared value is computed when it is first needed and does not depend on who needs it first,
    so sections can run in any order.
    """

    def __init__(
        self,
        env: EnvBase,
        network: ImageNetwork,
        settings: ExplainSettings,
        claim: Proof | None = None,
        measured: SavedShifts | None = None,
        unlike: Mapping[str, Any] | None = None,
        seed: RootSeed | None = None,
        observations: str | None = None,
        known_scenes: tuple[str, ...] = (),
    ) -> None:
        """Prepare the analysis of a policy; raise InputError if a setting does not fit it.

        The environments are held out, have not been stepped, and have the policy's transforms; the
        network is on the CPU. The verdict quotes `claim`, `measured`, `unlike` and `known_scenes`.
        The seed is the settings' by default. `observations` names the input that is explained, by
        default the first image, if any; the others keep each frame's own values.
        """
        self.scenes = Scenes(env, observations)
        self.env, self.claim = env, claim
        self.network: ImageNetwork = of_input(network, self.scenes.name)
        """The policy as a function of its observations."""
        self.remembers = network.is_recurrent
        """Whether the policy remembers earlier frames."""
        self.settings, self.seed = with_seed(settings, seed)
        self.measured, self.unlike, self.known_scenes = measured, unlike, known_scenes
        self.layer = settings.layer or feature_layer(self.network)
        """Layer whose features are embedded; None if the policy's layers are unknown."""
        layer = settings.grad_cam_layer
        views = [of_input(network, name) for name in self.scenes.others]
        if layer is not None and any(layer in spatial_layers(view) for view in views):
            layer = None  # it is one of another image
        self.explainer = Explainer(self.network, self.scenes.absent, layer)
        if self.layer is not None:
            find_layer(self.network, self.layer)  # refuse an unknown layer now
        self._start = base_env(env).state_dict()

    def restart(self) -> TensorDictModuleBase:
        """Return the environments to their first episodes; return an actor with a fresh stream."""
        base_env(self.env).load_state_dict(self._start)
        generator = torch_generator(self.seed.value, Stream.REPORT, device=str(self.env.device))
        return make_actor(self.network, self.env.action_spec, generator)

    def evaluate(self, inputs: Mapping[str, Tensor]) -> Tensor:
        """Return action probabilities for inputs by name. (T, *) to (T, parts), see `Actions`."""
        others = rest_in({name: inputs[name] for name in self.scenes.others})
        return probabilities(self.network, inputs[self.scenes.name], others)

    def copied_for_thread(self) -> "Context":
        """Return a copy for another thread, which must not step the environments.

        Hooks and gradients don't mix, since the network is a copy; all else is shared.
        """
        _ = self.dataset, self.film  # computed by the thread that owns the environments
        twin = copy.copy(self)
        if self.network.is_differentiable:
            twin.network = copy.deepcopy(self.network)
            twin.explainer = dataclasses.replace(self.explainer, network=twin.network)
        return twin

    @functools.cached_property
    def flights(self) -> RolloutDataset:
        """Every step of sampled episodes, without rendered frames."""
        return collect(
            self.env,
            self.restart(),
            num_episodes=self.settings.data_episodes,
            num_frames=self.settings.frames,
            observations=self.scenes.name,
        )

    @functools.cached_property
    def dataset(self) -> RolloutDataset:
        """The frames that are analysed, spread over all episodes."""
        rows = select_frames(self.flights.episode, self.settings.frames)
        layers = () if self.layer is None else (self.layer,)
        return render_frames(self.flights, rows, self.scenes, self.network, layers)

    @functools.cached_property
    def film(self) -> RolloutDataset:
        """The steps of the episode shown as a film, as many as a report shows."""
        view = self.scenes.view
        most = min(FILM_STEPS, FILM_BYTES // (3 * view.height * view.width))
        rows = np.flatnonzero(self.flights.episode == FILMED)[:most]
        return render_frames(self.flights, rows, self.scenes, self.network)


def needs(*whole: Need, **parts: Need) -> Callable[[Declared], Declared]:
    """Declare what a section needs of a policy and its task, or what its parts need, by name."""

    def declare(section: Declared) -> Declared:
        vars(section)["needs"] = (*((None, need) for need in whole), *parts.items())
        return section

    return declare


def find_lacking(sections: Mapping[str, Any], context: Context) -> dict[str, str]:
    """Return why sections, and parts of the others, will be left out, by name."""
    lacking: dict[str, str] = {}
    for title, section in sections.items():
        for part, need in getattr(section, "needs", ()):
            if title not in lacking and (why := need(context)):
                lacking[part or title] = why
    return lacking


def image(context: Context) -> str | None:
    """Need an image among the policy's inputs."""
    scenes = context.scenes
    return None if scenes.image else f"The policy sees no image, only {scenes.seen}."


def objects(context: Context) -> str | None:
    """Need objects that can be removed and moved."""
    task = context.scenes.task
    return None if task.edits is not None else f"Task {task.name} has no objects that can be moved."
