"""What the sections of an explanation share: one policy, its worlds, and what is made of them.

Each shared thing is made when it is first asked for, and is the same whoever asks first, so that
sections can run in any order.
"""

import copy
import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import TransformedEnv

from drone_rl.explanations.attribution import Explainer
from drone_rl.explanations.dataset import RolloutDataset
from drone_rl.explanations.hooks import feature_layer, features
from drone_rl.explanations.recording import draw, fly, spread
from drone_rl.explanations.response import ResponseMap, response_map
from drone_rl.explanations.scenes import Scenes, empty_scene
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.explanations.threads import Once
from drone_rl.policies import PictureNetwork, make_actor
from drone_rl.robustness.shifts_file import SavedShifts
from drone_rl.utils.seeding import RootSeed, Stream, torch_generator, with_seed
from drone_rl.verdicts.certificate import Claim

FILMED = 0
"""The flight that is shown: the first, whatever it is like."""


class LeftOutError(Exception):
    """A section can't be made of this policy; the message says in sentences why, and the remedy."""


class Context:
    """One policy that is being explained."""

    def __init__(
        self,
        env: TransformedEnv,
        network: PictureNetwork,
        settings: ExplainSettings,
        claim: Claim | None = None,
        measured: SavedShifts | None = None,
        unlike: Mapping[str, Any] | None = None,
        seed: RootSeed | None = None,
    ) -> None:
        """Takes the policy and its worlds.

        Args:
            env: A batch of worlds that have not flown yet, with the policy's pipeline.
            network: The policy's, on the CPU.
            settings: What to compute.
            claim: A certificate of it in the task of these worlds, if there is one.
            measured: Its flights under other conditions, if there are any.
            unlike: See `drone_rl.evaluation.judge.judge_policy`.
            seed: Root of all random streams; that of the settings by default.

        Raises:
            InputError: A setting doesn't fit the policy.
        """
        self.env, self.network, self.claim = env, network, claim
        self.settings, self.seed = with_seed(settings, seed)
        self.measured, self.unlike = measured, unlike
        self.scenes = Scenes(env)
        self.layer = settings.layer or feature_layer(network)
        """Whose features are embedded; None of a policy of which no layers are known."""
        self.absent = self.scenes.observe(empty_scene(self.scenes))[0]
        """The scene without a cube, as the policy gets it. Shape: (C, h, w)."""
        self.explainer = Explainer(network, self.absent, settings.grad_cam_layer)
        if self.layer is not None:
            features(network, self.absent[None], self.layer)  # refuses an unknown layer now
        self._maps: Once[dict[str, Tensor]] = Once()
        self._frame_maps: Once[dict[str, Tensor]] = Once()
        self._start = env.base_env.state_dict()

    def restart(self) -> TensorDictModuleBase:
        """Puts the worlds back to their first episodes; returns an actor with a fresh stream."""
        self.env.base_env.load_state_dict(self._start)
        generator = torch_generator(self.seed.value, Stream.REPORT, device=self.device)
        return make_actor(self.network, self.env.action_spec, generator)

    def aside(self) -> "Context":
        """The same for another thread, which may read the data set and must not move the worlds.

        Its network is a copy: what hooks, or gathers gradients in, the one meets not the other.
        Maps are made once, by whichever of the two asks first.
        """
        _ = self.dataset, self.film  # made by the thread that has the worlds
        twin = copy.copy(self)
        if self.network.is_differentiable:
            twin.network = copy.deepcopy(self.network)
            twin.explainer = Explainer(twin.network, self.absent, self.settings.grad_cam_layer)
        return twin

    @functools.cached_property
    def flights(self) -> RolloutDataset:
        """Sampled flights, every step of them, without pictures but for what the policy got."""
        return fly(
            self.env,
            self.restart(),
            num_episodes=self.settings.data_episodes,
            num_frames=self.settings.frames,
            meta={"layer": self.layer, "seed": self.seed.value},
        )

    @functools.cached_property
    def dataset(self) -> RolloutDataset:
        """The frames that are analysed, spread over all flights."""
        rows = spread(self.flights.episode, self.settings.frames)
        layers = () if self.layer is None else (self.layer,)
        return draw(self.flights, rows, self.scenes, self.network, layers)

    @functools.cached_property
    def film(self) -> RolloutDataset:
        """Every step of the flight that is shown."""
        rows = np.flatnonzero(self.flights.episode == FILMED)
        return draw(self.flights, rows, self.scenes, self.network)

    @property
    def device(self) -> str:
        """Where the worlds are."""
        return str(self.env.device)

    @property
    def episode(self) -> NDArray:
        """The episode of each frame of the data set. Shape: (T,)."""
        return self.dataset.episode

    @property
    def observations(self) -> Tensor:
        """What the policy got. Shape: (T, C, h, w)."""
        return self.dataset.tensor("observations")

    @property
    def actions(self) -> Tensor:
        """What it did. Shape: (T,)."""
        return self.dataset.tensor("actions")

    @property
    def maps(self) -> dict[str, Tensor]:
        """Heat maps of the actions taken by each method, as the policy's pictures: (T, h, w)."""
        seen = self.observations, self.actions
        methods = self.explainer.methods()
        return self._maps.get(lambda: {name: of(*seen) for name, of in methods.items()})

    @property
    def frame_maps(self) -> dict[str, Tensor]:
        """The same, put back to where they are in the camera's frame: (T, H, W)."""
        maps, back = self.maps, self.scenes.to_frame
        return self._frame_maps.get(lambda: {name: back(one) for name, one in maps.items()})

    @functools.cached_property
    def response(self) -> ResponseMap:
        """What it does about one cube at each place of a grid."""
        return response_map(self.scenes, self.network, seed=self.seed.value)
