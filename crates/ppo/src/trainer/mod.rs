//! The learner: collects a rollout, estimates advantages, takes gradient steps.

mod collect;
mod resume;
mod update;

use std::time::Instant;

use policy::{CheckpointError, Mlp, StepBuffers, VecEnv};

use crate::{
    adam::Adam,
    config::{Config, ConfigError, Precision},
    deal::Deal,
    exchange::{Alone, Exchange, RankError},
    gradient::{Engine, MinibatchLoss, Networks, Workspace},
    network::Architecture,
    panels::Single,
    partials::Partials,
    rollout::{Rollout, normalize},
    rounded::Rounded,
    symmetry::Symmetry,
    team::Team,
};

/// Why training cannot begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// A setting is out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The checkpoint cannot be read or is of another shape.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The environments refuse their saved state.
    #[error("state of the environments: {0}")]
    Environment(String),
    /// Something is not a number any more. The iteration was not finished: weights may be those before it, or between, or no numbers
    /// either, so the way on is from a checkpoint.
    #[error("{what} is not finite in iteration {iteration}")]
    NonFinite {
        /// What.
        what: &'static str,
        /// Which iteration, from 0.
        iteration: u64,
    },
    /// Another rank cannot go on.
    #[error(transparent)]
    Rank(#[from] RankError),
    /// The environments and the settings do not fit.
    #[error("{0}")]
    Shape(String),
}

/// What one iteration showed.
#[derive(Clone, Debug, PartialEq)]
pub struct Iteration {
    /// Its number, from 0.
    pub index: u64,
    /// Environment steps of all iterations so far.
    pub env_steps: u64,
    /// Mean reward of a step.
    pub step_reward: f64,
    /// Mean return of the episodes that ended in this iteration; of earlier ones if none did.
    pub episode_return: f64,
    /// Mean length of those episodes \[steps\].
    pub episode_length: f64,
    /// Mean clipped surrogate.
    pub surrogate_loss: f64,
    /// Mean value loss.
    pub value_loss: f64,
    /// Mean divergence from the rollout's policy over the gradient steps.
    pub kl: f64,
    /// Share of samples beyond the clip range.
    pub clip_fraction: f64,
    /// Mean squared distance of the mean action from halfway between its neighbors in time.
    pub roughness: f64,
    /// Mean length of the gradient before limiting.
    pub gradient_norm: f64,
    /// Mean standard deviation of the actions.
    pub action_std: f64,
    /// Learning rate at the end.
    pub learning_rate: f64,
    /// Time of the rollout but for choosing actions (environments, values of last states, waiting for other ranks), of choosing
    /// actions, and of advantages and gradient steps \[s\].
    pub times_s: [f64; 3],
    /// Of these times, that spent in exchange with other ranks, waiting for them included \[s\].
    pub exchange_s: f64,
    /// Bytes this rank sent to others.
    pub exchange_bytes: u64,
    /// What the environments report.
    pub environment: Vec<(String, f64)>,
}

/// Proximal policy optimization of a policy for the environments `E`.
pub struct Trainer<E> {
    config: Config,
    seed: u64,
    team: Team,
    deal: Deal,
    env: E,
    networks: Networks,
    symmetry: Symmetry,
    observation_scale: Vec<f32>,
    parameters: Vec<f32>,
    adam: Adam,
    learning_rate: f32,
    iteration: u64,
    rollout: Rollout,
    buffers: StepBuffers,
    engine: Box<dyn Engine>,
    gradient: Vec<f32>,
    /// Return and length of each running episode, then those of the last mean over finished ones.
    episode_returns: Vec<f32>,
    episode_lengths: Vec<f32>,
    finished: [f32; 2],
}

impl<E: VecEnv> Trainer<E> {
    /// A learner with new weights, its environments reset.
    ///
    /// # Errors
    /// A setting is out of range or does not fit the environments.
    pub fn new(config: Config, seed: u64, env: E) -> Result<Self, TrainError> {
        Self::with_ranks(config, seed, env, Box::new(Alone))
    }

    /// As [`Trainer::new`], one of several that learn together, each with environments of its own: they are numbered in order of
    /// ranks, as those of one learner with all of them are, and give the same bits as that one. All ranks call the same
    /// methods in the same order; those that wait for the others are named so.
    ///
    /// # Errors
    /// As [`Trainer::new`]; or there are more ranks than partial gradients.
    pub fn with_ranks(
        config: Config,
        seed: u64,
        mut env: E,
        exchange: Box<dyn Exchange>,
    ) -> Result<Self, TrainError> {
        config.validate()?;
        let partials = Partials::new(config.gradient_blocks, &*exchange);
        let ranks = exchange.ranks();
        if ranks > partials.count() {
            return Err(TrainError::Shape(format!(
                "gradient_blocks is {}, must be at least {} for {ranks} ranks ({ranks} is best)",
                config.gradient_blocks,
                (ranks * config.gradient_blocks).div_ceil(partials.count())
            )));
        }
        let team = Team::new(exchange, env.num_envs());
        let (num_envs, observation_dim, action_dim) =
            (env.num_envs(), env.observation_dim(), env.action_dim());
        let samples = team.total_envs() * config.steps_per_env;
        if config.minibatches > samples {
            return Err(TrainError::Shape(format!(
                "minibatches is {}, must be at most the {samples} samples of an iteration",
                config.minibatches
            )));
        }
        let networks = Networks {
            actor: Architecture::new(observation_dim, &config.actor_hidden, action_dim),
            critic: Architecture::new(observation_dim, &config.critic_hidden, 1),
            actions: action_dim,
        };
        let parameters = networks.initial_parameters(seed, &config);
        let symmetry = Symmetry::new(config.symmetry, env.mirror(), &networks).map_err(TrainError::Shape)?;
        let mut buffers = StepBuffers::new(num_envs, observation_dim);
        env.reset(&mut buffers.observations);
        let mut trainer = Self {
            rollout: Rollout::new(num_envs, config.steps_per_env, observation_dim, action_dim),
            adam: Adam::new(parameters.len()),
            engine: engine(config.precision, &networks, partials),
            deal: Deal::new(observation_dim, action_dim),
            gradient: vec![0.0; parameters.len()],
            learning_rate: config.learning_rate,
            observation_scale: env.observation_scale(),
            episode_returns: vec![0.0; num_envs],
            episode_lengths: vec![0.0; num_envs],
            finished: [0.0; 2],
            iteration: 0,
            seed,
            config,
            team,
            env,
            networks,
            symmetry,
            parameters,
            buffers,
        };
        trainer.store_observations(0);
        if trainer.config.kinks_at_observations {
            trainer.move_kinks();
        }
        if let Some(images) = trainer.symmetry.of_networks() {
            images.impose(&mut trainer.parameters);
        }
        Ok(trainer)
    }

    /// Chooses the first layers' biases so that every unit has its kink at one of the first observations, of environments spread
    /// over those of all ranks.
    fn move_kinks(&mut self) {
        let Self { networks, parameters, rollout, team, .. } = self;
        let (own, total) = (team.own_envs(), team.total_envs());
        let width = rollout.observation_dim;
        let observations = rollout.observations_at(0);
        let (actor, critic, _) = networks.split_mut(parameters);
        for (architecture, parameters) in [(&networks.actor, actor), (&networks.critic, critic)] {
            let (weights, biases) = architecture.first_layer_mut(parameters);
            let units = biases.len();
            let bias = |(unit, weights): (usize, &[f32])| {
                let env = unit * total / units;
                let row = own.contains(&env).then(|| &observations[(env - own.start) * width..][..width]);
                let products = row.into_iter().flat_map(|row| row.iter().zip(weights));
                -products.map(|(x, w)| f64::from(x * w)).sum::<f64>()
            };
            let of_ranks = team.gather_f64(weights.chunks(width).enumerate().map(bias).collect());
            for (unit, bias) in biases.iter_mut().enumerate() {
                *bias = of_ranks[unit..].iter().step_by(units).sum::<f64>() as f32;
            }
        }
    }

    /// The environments.
    pub fn env(&self) -> &E {
        &self.env
    }

    /// The ranks that learn together.
    pub fn exchange(&self) -> &dyn Exchange {
        self.team.exchange()
    }

    /// Iterations made so far.
    pub fn iteration(&self) -> u64 {
        self.iteration
    }

    /// Environment steps of one iteration, of all ranks.
    pub fn steps_per_iteration(&self) -> u64 {
        (self.team.total_envs() * self.config.steps_per_env) as u64
    }

    /// Named numbers whose distribution tells how training goes: weights, and what the last rollout held. Waits for all ranks;
    /// rank 0 has what all of them held.
    pub fn distributions(&self) -> Vec<(String, Vec<f32>)> {
        let (actor, critic, log_std) = self.networks.split(&self.parameters);
        let rollout = &self.rollout;
        [
            ("weights/actor", actor.to_vec()),
            ("weights/critic", critic.to_vec()),
            ("policy/std", log_std.iter().map(|s| s.exp()).collect()),
            ("rollout/actions", self.team.gather_to_lead(&rollout.actions)),
            ("rollout/rewards", self.team.gather_to_lead(&rollout.rewards)),
            ("rollout/values", self.team.gather_to_lead(&rollout.values)),
            ("rollout/value_targets", self.team.gather_to_lead(&rollout.value_targets)),
        ]
        .map(|(name, values)| (name.to_owned(), values))
        .into()
    }

    /// The mean policy, taking raw observations, its outputs limited as the environments say.
    pub fn policy(&self) -> Mlp {
        let (actor, _, _) = self.networks.split(&self.parameters);
        let mlp = self.networks.actor.to_mlp(actor, &self.observation_scale);
        Mlp { output_limits: self.env.output_limits(), ..mlp }
    }

    /// One rollout and its update. Waits for all ranks; the numbers are those of all of them.
    ///
    /// # Errors
    /// Something is not finite any more, on this rank or another: all of them end.
    pub fn iterate(&mut self) -> Result<Iteration, TrainError> {
        self.team.take_clock();
        self.limit_noise();
        let start = Instant::now();
        let collected = self.collect();
        let (inference_s, own) = self.team.exchange().agree(collected)?;
        let [rewards, returns, lengths, ended] = self.add_up(own);
        if ended > 0.0 {
            self.finished = [(returns / ended) as f32, (lengths / ended) as f32];
        }
        let collected_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        self.estimate_advantages();
        let losses = self.update()?;
        self.team.compare(&self.parameters)?;
        // ELU makes 0 of NaN, so no loss need show it. All ranks have the same weights by now, and end together.
        if !self.parameters.iter().all(|parameter| parameter.is_finite()) {
            return Err(self.non_finite("a parameter"));
        }
        let update_s = start.elapsed().as_secs_f64();
        let index = self.iteration;
        self.iteration += 1;
        self.rollout.start_over();

        let mean =
            |of: &dyn Fn(&MinibatchLoss) -> f64| losses.iter().map(of).sum::<f64>() / losses.len() as f64;
        let (_, _, log_std) = self.networks.split(&self.parameters);
        let sums = self.team.gather_f64(self.env.take_sums());
        let environment = self.env.report(&sums);
        let (exchange_s, exchange_bytes) = self.team.take_clock();
        Ok(Iteration {
            index,
            env_steps: self.iteration * self.steps_per_iteration(),
            step_reward: rewards / self.steps_per_iteration() as f64,
            episode_return: f64::from(self.finished[0]),
            episode_length: f64::from(self.finished[1]),
            surrogate_loss: mean(&|loss| loss.surrogate),
            value_loss: mean(&|loss| loss.value),
            kl: mean(&|loss| loss.kl),
            clip_fraction: mean(&|loss| loss.clipped),
            roughness: mean(&|loss| loss.roughness),
            gradient_norm: mean(&|loss| loss.gradient_norm),
            action_std: log_std.iter().map(|s| f64::from(s.exp())).sum::<f64>() / log_std.len() as f64,
            learning_rate: f64::from(self.learning_rate),
            times_s: [collected_s - inference_s, inference_s, update_s],
            exchange_s,
            exchange_bytes,
            environment,
        })
    }

    /// Cuts off the noise of the actions.
    fn limit_noise(&mut self) {
        let most = self.config.max_std.ln();
        let (_, _, log_std) = self.networks.split_mut(&mut self.parameters);
        log_std.iter_mut().for_each(|log_std| *log_std = log_std.min(most));
    }

    /// The sum over all ranks.
    fn add_up<const N: usize>(&self, own: [f64; N]) -> [f64; N] {
        let mut sum = [0.0; N];
        for of_rank in self.team.gather_f64(own.to_vec()).as_chunks::<N>().0 {
            sum.iter_mut().zip(of_rank).for_each(|(sum, value)| *sum += value);
        }
        sum
    }

    /// Fills advantages, normalized over the samples of all ranks, those of quiet environments included, and value targets.
    fn estimate_advantages(&mut self) {
        self.rollout.estimate_advantages(self.config.gamma, self.config.lambda);
        self.rollout.smooth_means();
        let advantages = &mut self.rollout.advantages;
        // In the order of one rank with all environments, so that the sums round as its do.
        let all = if self.team.is_alone() {
            advantages.clone()
        } else {
            self.team.gather_samples(advantages, self.config.steps_per_env)
        };
        normalize(advantages, &all);
        self.rollout.disregard_quiet();
    }

    fn non_finite(&self, what: &'static str) -> TrainError {
        TrainError::NonFinite { what, iteration: self.iteration }
    }
}

/// The arithmetic of a precision, by the instructions that this processor has.
fn engine(precision: Precision, networks: &Networks, partials: Partials) -> Box<dyn Engine> {
    match precision {
        #[cfg(target_arch = "x86_64")]
        Precision::Bf16 if precision.is_accelerated() => {
            Box::new(Workspace::<crate::brain::Brain>::new(networks, partials))
        }
        Precision::Bf16 => Box::new(Workspace::<Rounded>::new(networks, partials)),
        Precision::F32 => Box::new(Workspace::<Single>::new(networks, partials)),
    }
}
