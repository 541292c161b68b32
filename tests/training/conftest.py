"""Training on a two-armed bandit with episodes of one to four steps, which takes milliseconds."""

import pytest
import torch
from tensordict import TensorDict
from torch import nn
from torchrl.data import Categorical

from drone_rl.objectives import ReinforceLoss, TimeBaseline
from drone_rl.policies import make_actor
from drone_rl.training import ReinforceLearner, Trainer


class Bandit:
    """A collector in which action 1 has reward 1, with two random generators."""

    def __init__(self, actor, episodes=8, seed=0, postproc=None):
        self.actor, self.episodes, self.postproc = actor, episodes, postproc
        self.generator = torch.Generator().manual_seed(seed)
        self.is_open = True

    def __iter__(self):
        while True:
            yield self.collect()

    @torch.no_grad()
    def collect(self):
        lengths = torch.randint(1, 5, (self.episodes,), generator=self.generator).tolist()
        steps = sum(lengths)
        batch = self.actor(
            TensorDict({"pixels": torch.randn(steps, 4, generator=self.generator)}, [steps])
        )
        done = torch.zeros(steps, 1, dtype=torch.bool)
        done[torch.tensor(lengths).cumsum(0) - 1] = True
        batch["next"] = {"reward": batch["action"][:, None].float(), "done": done}
        return batch if self.postproc is None else self.postproc(batch)

    def state_dict(self):
        return {"generator": self.generator.get_state()}

    def load_state_dict(self, state):
        self.generator.set_state(state["generator"])

    def shutdown(self):
        self.is_open = False


@pytest.fixture
def make_trainer():
    """Return a factory of trainers with a REINFORCE learner; arguments include its settings."""

    def build(seed=0, *, max_grad_norm=None, chunk_frames=512, **kwargs):
        network = nn.Linear(4, 2)
        nn.init.normal_(network.weight, generator=torch.Generator().manual_seed(seed))
        nn.init.zeros_(network.bias)
        actions = torch.Generator().manual_seed(seed + 100)
        actor = make_actor(network, Categorical(2), actions)
        optimizer = torch.optim.Adam(network.parameters(), lr=0.05)
        settings = {"target": None, "total_frames": 200, **kwargs}
        return Trainer(
            collector=Bandit(actor, seed=seed, postproc=TimeBaseline(0.9, max_steps=4)),
            learner=ReinforceLearner(
                network=network,
                loss=ReinforceLoss(actor, entropy_coeff=0.0),
                optimizer=optimizer,
                scheduler=torch.optim.lr_scheduler.StepLR(optimizer, 2, 0.9),
                max_grad_norm=max_grad_norm,
                chunk_frames=chunk_frames,
            ),
            generators={"actions": actions},
            **settings,
        )

    return build
