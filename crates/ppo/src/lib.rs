//! Proximal policy optimization: rollout, advantage, loss, gradient, optimizer, trainer.
