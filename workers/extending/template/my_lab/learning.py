"""REINFORCE with a baseline: the policy's gradient is that of log pi(a|s) times how much better than expected it went."""

import numpy as np
import torch

from my_lab import ReinforceConfig
from workers.extending.learning import Learner, ReturnScaler, Setting, generalized_advantages


class Reinforce(Learner):
    """One step up the policy gradient for each rollout.

    A return ends with the rollout; what would have followed is what the baseline expects of it.
    """

    def __init__(self, config: ReinforceConfig, setting: Setting) -> None:
        self.config = config
        self.actor = setting.build_actor(config.initial_std)
        self.baseline = setting.build_network(outputs=1, number=1)
        self.rollout = setting.build_rollout(config.rollout_steps)
        self.scaler = ReturnScaler(setting.robots, config.gamma)
        super().__init__(
            setting,
            policy=self.actor.network,
            modules={"actor": self.actor, "baseline": self.baseline},
            optimizers={
                "actor": torch.optim.Adam(self.actor.parameters()),
                "baseline": torch.optim.Adam(self.baseline.parameters()),
            },
            generator=setting.generator(),
            steps_per_update=config.rollout_steps,
        )

    @torch.no_grad()
    def act(self, observations):
        """A sample of the policy for each robot."""
        rollout, step = self.rollout, self.rollout.step
        rollout.observations[step] = torch.from_numpy(observations)
        rollout.noise[step].normal_(generator=self.generator)
        mean = self.actor(rollout.observations[step])
        rollout.actions[step] = mean + rollout.noise[step] * self.actor.log_std.exp()
        return rollout.actions[step].cpu().numpy()

    def record(self, observations, rewards, terminations, truncations, final_observations):
        """Remember what followed."""
        self.rollout.add_outcome(rewards, terminations, truncations, final_observations)
        if self.rollout.full:
            self.rollout.observations[-1] = torch.from_numpy(observations)

    def update(self, progress):
        """Learn from the rollout, in which every robot drove `rollout_steps` steps."""
        for optimizer in self.optimizers.values():
            optimizer.param_groups[0]["lr"] = self.config.learning_rate * (1.0 - progress)
        returns, advantages = self.estimate()
        seen, actions = self.rollout.observations[:-1].flatten(0, 1), self.rollout.actions.flatten(0, 1)

        log_std = self.actor.log_std
        log_probs = (-0.5 * ((actions - self.actor(seen)) / log_std.exp()) ** 2 - log_std).sum(dim=1)
        policy_loss = -(log_probs * (advantages - advantages.mean()) / (advantages.std() + 1e-8)).mean()
        value_loss = 0.5 * (self.baseline(seen)[:, 0] - returns).square().mean()
        for optimizer in self.optimizers.values():
            optimizer.zero_grad()
        (policy_loss + value_loss).backward()
        torch.nn.utils.clip_grad_norm_([*self.actor.parameters(), *self.baseline.parameters()], 1.0)
        for optimizer in self.optimizers.values():
            optimizer.step()
        self.rollout.clear()
        return {"loss/policy": policy_loss.item(), "loss/value": value_loss.item()}

    @torch.no_grad()
    def estimate(self):
        """Returns and advantages of the rollout (steps * robots,), in scaled rewards."""
        rollout, gamma = self.rollout, self.config.gamma
        self.scaler.update(rollout.rewards, rollout.dones)
        rewards = rollout.rewards * np.float32(self.scaler.scale)
        steps, robots, final_observations = rollout.truncations()
        if steps.size:
            rewards[steps, robots] += gamma * self.baseline(final_observations)[:, 0].cpu().numpy()
        values = self.baseline(rollout.observations.flatten(0, 1)).view(len(rewards) + 1, -1)
        advantages = generalized_advantages(rewards, values.cpu().numpy(), rollout.dones, gamma, 1.0)
        advantages = torch.from_numpy(advantages).to(values.device)
        return (advantages + values[:-1]).flatten(), advantages.flatten()

    def own_state(self):
        """The scaler's, beside modules, optimisers and generator."""
        return self.scaler.state()

    def load_own_state(self, state):
        """Continue where `own_state` was taken."""
        self.scaler.load_state(state)
