"""Times one PPO update in PyTorch and writes seconds as JSON lines, one for each line read; compare.py starts it.

Usage: python3 benches/learning/pytorch.py f32|bf16|rsl_rl THREADS SAMPLES
"""

import json
import resource
import sys
import time

import torch

EPOCHS, MINIBATCHES, OBSERVATIONS, ACTIONS, HIDDEN = 5, 4, 235, 12, (512, 256, 128)
CLIP, ENTROPY, DESIRED_KL, MAX_NORM = 0.2, 0.005, 0.01, 1.0


def network(outputs):
    layers, width = [], OBSERVATIONS
    for hidden in HIDDEN:
        layers += [torch.nn.Linear(width, hidden), torch.nn.ELU()]
        width = hidden
    return torch.nn.Sequential(*layers, torch.nn.Linear(width, outputs))


class Plain:
    """The update as our learner makes it, in plain PyTorch."""

    def __init__(self, samples, autocast):
        self.actor, self.critic = network(ACTIONS), network(1)
        self.log_std = torch.nn.Parameter(torch.zeros(ACTIONS))
        self.parameters = [*self.actor.parameters(), *self.critic.parameters(), self.log_std]
        self.optimizer = torch.optim.Adam(self.parameters, lr=1e-3, fused=True)
        self.samples, self.autocast = samples, autocast
        self.observations = torch.randn(samples, OBSERVATIONS)
        with torch.no_grad():
            self.means = torch.cat([self.actor(part) for part in self.observations.split(4096)])
            self.values = torch.cat([self.critic(part) for part in self.observations.split(4096)])[:, 0]
        self.actions = self.means + torch.randn(samples, ACTIONS)
        self.log_probabilities = torch.distributions.Normal(self.means, 1.0).log_prob(self.actions).sum(-1)
        self.advantages = torch.randn(samples)
        self.targets = self.values + torch.randn(samples)

    def update(self):
        old_log_std = self.log_std.detach().clone()
        for _ in range(EPOCHS):
            for rows in torch.randperm(self.samples).chunk(MINIBATCHES):
                self.step(rows, old_log_std)

    def step(self, rows, old_log_std):
        observations = self.observations[rows]
        with torch.autocast("cpu", dtype=torch.bfloat16, enabled=self.autocast):
            mean, value = self.actor(observations), self.critic(observations)[:, 0]
        mean, value = mean.float(), value.float()
        deviation = (self.actions[rows] - mean) * torch.exp(-self.log_std)
        log_probability = (-0.5 * deviation**2 - self.log_std - 0.9189385).sum(-1)
        with torch.no_grad():
            old_mean = self.means[rows]
            variance = torch.exp(2 * self.log_std)
            kl = self.log_std - old_log_std + (torch.exp(2 * old_log_std) + (old_mean - mean) ** 2) / (2 * variance) - 0.5
            kl = kl.sum(-1).mean().item()
            for group in self.optimizer.param_groups:
                if kl > 2 * DESIRED_KL:
                    group["lr"] = max(1e-5, group["lr"] / 1.5)
                elif 0 < kl < DESIRED_KL / 2:
                    group["lr"] = min(1e-2, group["lr"] * 1.5)
        ratio = torch.exp(log_probability - self.log_probabilities[rows])
        advantage = self.advantages[rows]
        surrogate = torch.max(-advantage * ratio, -advantage * ratio.clamp(1 - CLIP, 1 + CLIP)).mean()
        old_value, target = self.values[rows], self.targets[rows]
        clipped = old_value + (value - old_value).clamp(-CLIP, CLIP)
        value_loss = torch.max((value - target) ** 2, (clipped - target) ** 2).mean()
        loss = surrogate + value_loss - ENTROPY * self.log_std.sum()
        self.optimizer.zero_grad(set_to_none=False)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.parameters, MAX_NORM)
        self.optimizer.step()


class RslRl:
    """The update of rsl_rl's own PPO, on a batch like Plain's."""

    def __init__(self, samples):
        from rsl_rl.algorithms import PPO
        from rsl_rl.models import MLPModel
        from rsl_rl.storage import RolloutStorage
        from tensordict import TensorDict

        steps, robots = 24, samples // 24
        batch = TensorDict({"policy": torch.zeros(robots, OBSERVATIONS)}, batch_size=[robots])
        groups = {"actor": ["policy"], "critic": ["policy"]}
        gaussian = {"class_name": "rsl_rl.modules.distribution:GaussianDistribution", "init_std": 1.0}
        actor = MLPModel(batch, groups, "actor", ACTIONS, HIDDEN, "elu", False, gaussian)
        critic = MLPModel(batch, groups, "critic", 1, HIDDEN, "elu")
        self.storage = RolloutStorage("rl", robots, steps, batch, [ACTIONS])
        self.ppo = PPO(actor, critic, self.storage, entropy_coef=ENTROPY)
        with torch.no_grad():
            for step in range(steps):
                seen = TensorDict({"policy": torch.randn(robots, OBSERVATIONS)}, batch_size=[robots])
                one = RolloutStorage.Transition()
                one.observations, one.actions = seen, actor(seen, stochastic_output=True)
                one.values, one.rewards, one.dones = critic(seen), torch.randn(robots), torch.zeros(robots)
                one.actions_log_prob = actor.get_output_log_prob(one.actions)
                one.distribution_params = actor.output_distribution_params
                self.storage.add_transition(one)
        self.storage.returns = self.storage.values + torch.randn_like(self.storage.values)
        self.storage.advantages = torch.randn_like(self.storage.values)

    def update(self):
        self.ppo.update()  # it forgets only how many steps are stored, which mini_batch_generator does not ask


def main():
    kind, threads, samples = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    torch.set_num_threads(threads)
    torch.manual_seed(1)
    learner = RslRl(samples) if kind == "rsl_rl" else Plain(samples, kind == "bf16")
    learner.update()
    for _ in sys.stdin:
        start, cpu = time.perf_counter(), time.process_time()
        learner.update()
        took = {"s": time.perf_counter() - start, "cpu_s": time.process_time() - cpu}
        print(json.dumps(took | {"resident_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}), flush=True)


if __name__ == "__main__":
    main()
