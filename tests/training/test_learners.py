"""A user-defined learner: a critic, batches of fixed length and two epochs per batch."""

import pytest
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import RewardSum, TransformedEnv
from torchrl.modules import ProbabilisticActor

from drone_rl.envs.three_state import ThreeStateEnv
from drone_rl.policies.actor import SeededCategorical
from drone_rl.training import CheckpointCallback, Trainer
from drone_rl.training.learners import check_batch, check_finite
from drone_rl.utils.checkpoint import load_checkpoint
from drone_rl.utils.errors import InputError
from tests.training_loop import run

GAMMA, PASSES = 0.9, 2


class CriticLearner:
    """One-step actor-critic that bootstraps unless the episode terminated."""

    in_keys = ("observation", "action", *(("next", k) for k in ("observation", "reward")))

    def __init__(self, actor):
        self.actor, self.critic = actor, nn.Linear(3, 1)
        parameters = [*actor.parameters(), *self.critic.parameters()]
        self.optimizer = torch.optim.Adam(parameters, lr=0.05)

    def update(self, batch):
        for _ in range(PASSES):
            value = self.critic(batch["observation"])
            following = self.critic(batch["next", "observation"]).detach()
            goes_on = (~batch["next", "terminated"]).float()
            error = batch["next", "reward"] + GAMMA * goes_on * following - value
            log_prob = self.actor.get_dist(batch).log_prob(batch["action"])
            losses = {
                "actor": -(log_prob * error[..., 0].detach()).mean(),
                "critic": error.square().mean(),
            }
            for name, loss in losses.items():
                check_finite(loss, name)
            self.optimizer.zero_grad()
            sum(losses.values()).backward()
            self.optimizer.step()
        return {f"loss/{name}": float(loss.detach()) for name, loss in losses.items()}

    def state_dict(self):
        return {
            "policy": self.actor.state_dict(),
            "critic": self.critic.state_dict(),
            "optimizer": self.optimizer.state_dict(),
        }

    def check_state(self, state):
        pass

    def load_state_dict(self, state):
        self.actor.load_state_dict(state["policy"])
        self.critic.load_state_dict(state["critic"])
        self.optimizer.load_state_dict(state["optimizer"])


def make_actor():
    torch.manual_seed(0)
    env = ThreeStateEnv(4)
    return ProbabilisticActor(
        TensorDictModule(nn.Linear(3, 2), in_keys=["observation"], out_keys=["logits"]),
        in_keys=["logits"],
        spec=env.action_spec,
        distribution_class=SeededCategorical,
    )


@pytest.fixture
def trainer(tmp_path):
    """Return a trainer with TorchRL's collector: 4 environments, 5 steps, episodes of up to 3."""
    actor = make_actor()
    collector = Collector(
        TransformedEnv(ThreeStateEnv(4), RewardSum()),
        actor,
        frames_per_batch=20,
        total_frames=-1,
        auto_register_policy_transforms=False,
    )
    yield Trainer(
        collector=collector,
        learner=CriticLearner(actor),
        callbacks=[CheckpointCallback(tmp_path)],
        target=None,
        total_frames=4000,
    )
    collector.shutdown()


def leaving(learner):
    """Return the probability of the rewarded action in state 0."""
    start = TensorDict({"observation": torch.tensor([1.0, 0.0, 0.0])}, [])
    return float(learner.actor.get_dist(start).probs[1].detach())


def test_critic_learns_from_partial_episodes(trainer, tmp_path):
    before = leaving(trainer.learner)
    assert run(trainer) == "frames"
    assert leaving(trainer.learner) > max(before, 0.9)
    progress = trainer.progress
    assert (progress.frames, progress.updates) == (4000, 200)
    assert 4000 / 3 - 4 <= progress.episodes <= 4000
    assert 0.5 < progress.running_reward < 0.95  # the optimum is 0.75
    state = load_checkpoint(tmp_path / "last.pt")
    assert {"policy", "critic", "optimizer", "progress"} <= set(state)
    again = CriticLearner(make_actor())
    again.load_state_dict(state)
    assert leaving(again) == leaving(trainer.learner)


def test_training_ends_with_the_collector(trainer):
    batches = [next(iter(trainer.collector)) for _ in range(2)]
    trainer.collector = batches
    trainer.collector = type("Two", (list,), {"state_dict": dict})(batches)
    assert run(trainer) == "frames"
    assert (trainer.progress.updates, trainer.progress.frames) == (2, 40)


def test_batch_without_learner_inputs_raises(trainer):
    batch = next(iter(trainer.collector))
    check_batch(batch, trainer.learner.in_keys, "CriticLearner")
    del batch["next", "observation"]
    message = r"no entry \('next', 'observation'\), which CriticLearner learns from"
    with pytest.raises(InputError, match=message):
        check_batch(batch, trainer.learner.in_keys, "CriticLearner")
