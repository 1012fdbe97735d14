"""Three gradient steps of PPO in PyTorch: what crates/ppo/src/gradient.rs must compute, too.

Usage: python3 scripts/reference/mint_ppo_update.py crates/ppo/tests/golden/update.safetensors

Needs the packages torch, numpy and safetensors. Everything is computed in double precision from single-precision inputs, by
autograd. The loss is rsl_rl's (clipped surrogate, clipped value loss, entropy bonus), the optimizer torch.optim.Adam, the length of
the gradient limited by torch.nn.utils.clip_grad_norm_. The file is laid out as one of our checkpoints.
"""

import pathlib
import sys

import numpy as np
import torch
from safetensors.numpy import save_file

SAMPLES, OBSERVATIONS, ACTIONS = 96, 37, 12
ACTOR, CRITIC = (40, 24), (33, 16)
CLIP, ENTROPY, MAX_NORM, RATE = 0.2, 0.005, 1.0, 1e-3


def network(widths):
    layers = []
    for inputs, outputs in zip(widths, widths[1:]):
        layers += [torch.nn.Linear(inputs, outputs), torch.nn.ELU()]
    return torch.nn.Sequential(*layers[:-1]).double()


def flat(parameters):
    return torch.cat([parameter.detach().reshape(-1) for parameter in parameters])


def main():
    torch.manual_seed(5)
    actor, critic = network((OBSERVATIONS, *ACTOR, ACTIONS)), network((OBSERVATIONS, *CRITIC, 1))
    log_std = torch.nn.Parameter(torch.linspace(-0.6, 0.2, ACTIONS).float().double())
    parameters = [*actor.parameters(), *critic.parameters(), log_std]
    single = lambda *shape: torch.randn(*shape).float().double()  # noqa: E731
    with torch.no_grad():
        for parameter in parameters:
            parameter.copy_(parameter.float().double())
        observations, noise = single(SAMPLES, OBSERVATIONS), single(SAMPLES, ACTIONS)
        means = (actor(observations) + 0.1 * single(SAMPLES, ACTIONS)).float().double()
        old_log_std = (log_std + 0.05).detach().float().double().clone()
        actions = (means + torch.exp(old_log_std) * noise).float().double()
        old = torch.distributions.Normal(means, torch.exp(old_log_std))
        log_probabilities = old.log_prob(actions).sum(-1).float().double()
        values = (critic(observations)[:, 0] + 0.2 * single(SAMPLES)).float().double()
        advantages, targets = single(SAMPLES), (values + single(SAMPLES)).float().double()
    out = {
        "parameters/0": flat(parameters), "old_log_std": old_log_std, "observations": observations, "means": means,
        "actions": actions, "log_probabilities": log_probabilities, "values": values, "advantages": advantages,
        "value_targets": targets,
    }
    optimizer = torch.optim.Adam(parameters, lr=RATE)
    for step in range(3):
        mean, value = actor(observations), critic(observations)[:, 0]
        new = torch.distributions.Normal(mean, torch.exp(log_std))
        kl = torch.distributions.kl_divergence(old, new).sum(-1).mean()
        ratio = torch.exp(new.log_prob(actions).sum(-1) - log_probabilities)
        surrogate = torch.max(-advantages * ratio, -advantages * ratio.clamp(1 - CLIP, 1 + CLIP)).mean()
        clipped = values + (value - values).clamp(-CLIP, CLIP)
        value_loss = torch.max((value - targets) ** 2, (clipped - targets) ** 2).mean()
        loss = surrogate + value_loss - ENTROPY * new.entropy().sum(-1).mean()
        optimizer.zero_grad()
        loss.backward()
        out[f"gradient/{step}"] = flat([parameter.grad for parameter in parameters])
        norm = torch.nn.utils.clip_grad_norm_(parameters, MAX_NORM)
        out[f"loss/{step}"] = torch.stack([surrogate, value_loss, kl, norm]).detach()
        optimizer.step()
    out["parameters/3"] = flat(parameters)
    tensors = {f"tensor/{name}": value.reshape(-1).numpy().astype(np.float32) for name, value in out.items()}
    path = pathlib.Path(sys.argv[1])
    path.parent.mkdir(parents=True, exist_ok=True)
    made = {"engine": f"PyTorch {torch.__version__}", "script": "scripts/reference/mint_ppo_update.py"}
    save_file(tensors, path, metadata={"guidedog_checkpoint": "1"} | made)


if __name__ == "__main__":
    main()
