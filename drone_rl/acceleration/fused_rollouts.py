"""Runs a fixed number of steps of each environment in the fused kernel."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.acceleration.fused_episodes import END_REASON, PAID, REWARD, FusedEpisodes
from drone_rl.envs.drone_env import Entries
from drone_rl.policies.networks import require_finite
from drone_rl.sim.tasks import State


class FusedRollouts(FusedEpisodes):
    """Run T steps of each of N environments; new episodes start where old ones end.

    A launch stops in each environment at the end of its episode. New states are sampled in Python,
    from the environments' random streams, and the next launch goes on from there.
    """

    def advance(self, state: State, starts: Tensor) -> tuple[Entries, State]:
        """Step all environments.

        Args:
            state: Their states, in running episodes.
            starts: Those whose episodes start, indices (k,).

        Returns:
            The entries of the steps, (N, T, *): `REWARD`, `END_REASON`, `PAID` of several terms,
            the inputs by name, also below "next", "logits" and the action; and the states after
            them.
        """
        env, rules, count, length = self._env, self._rules, len(state), self._length
        self._prepare(state)
        self._inputs.begin(starts)
        rollout, opened = self._open(count, 0, ())
        after = torch.empty_like(opened["observations"])
        rollout.next_frames, rollout.next_observations = self._frames(after), wp.from_torch(after)
        begins = torch.zeros(count, dtype=torch.int32)
        rollout.begins = wp.from_torch(begins)
        paid = torch.zeros(count, length, rules.paid(count).shape[1])
        while bool((begins < length).any()):
            before = rules.steps.clone()
            self._launch(rollout, count)
            begins += rules.steps - before
            ended = (rules.end_reasons != 0).nonzero()[:, 0]
            if len(ended):
                paid[ended, begins[ended].long() - 1] = rules.paid(count)[ended]
                rules.begin(env.start(ended), ended)
                self._inputs.begin(ended)
                if env.appearances.varies:
                    self._inputs.look(rollout, env, env.worlds.state)
        require_finite(opened["logits"], self._owner)
        by_env = {name: values.unflatten(0, (count, length)) for name, values in opened.items()}
        end_reason, seen = by_env["end_reason"].long(), by_env["observations"]
        if self._inputs.num_frames > 1:
            self.last_observations[:] = seen[:, -1]
        after = after.unflatten(0, (count, length))
        following = torch.cat([seen[:, 1:], after[:, -1:]], 1)
        following[end_reason != 0] = after[end_reason != 0]
        action, inputs = by_env["action"], self._inputs
        following = inputs.by_name(inputs.seen(following))
        entries: Entries = {
            REWARD: by_env["reward"].clone(),
            END_REASON: end_reason,
            **inputs.by_name(inputs.seen(seen).clone()),
            **{("next", name): values for name, values in following.items()},
            "logits": by_env["logits"].clone(),
            "action": action.clone() if self._is_continuous else action.long(),
        }
        if paid.shape[-1] > 1:
            entries[PAID] = paid
        return entries, rules.current()
