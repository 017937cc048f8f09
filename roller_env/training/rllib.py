"""PPO by RLlib's new API stack, on as many machines as a Ray cluster has. Imports Ray.

Runners play, each its part of the environments with practice and explorers of its own, learners
learn. The driver, which is the process that was started, lets an update be made, merges what the
runners have seen, keeps the record and writes the checkpoints. A runner that is lost is missed and
comes back, with the weights of now and a practice that begins anew, where there is a CPU for it; so
does its whole node.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

import gymnasium as gym
import ray
import torch
from ray.rllib.algorithms import ppo as rllib_ppo
from ray.rllib.algorithms.ppo.torch.ppo_torch_learner import PPOTorchLearner
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner
from ray.rllib.env.single_agent_episode import SingleAgentEpisode
from ray.rllib.utils.schedules.scheduler import Scheduler
from stable_baselines3 import PPO

from roller_env.problems import shown
from roller_env.training.checkpoint import (
    CLUSTER,
    Checkpoint,
    CheckpointError,
    Progress,
    Tree,
    check_moments,
    load_checkpoint,
    write_checkpoint,
)
from roller_env.training.cluster import AUTO, LOCAL
from roller_env.training.config import TrainingConfig
from roller_env.training.files import RunError, RunFiles
from roller_env.training.network import network_of, network_spaces
from roller_env.training.normalisation import merged, running_moments, set_running_moments
from roller_env.training.ppo import make_environments, new_model
from roller_env.training.recording import Recording, new_logger
from roller_env.training.rllib_weights import from_rllib, to_rllib
from roller_env.training.rollout import Rollout
from roller_env.training.schedule import (
    entropy_coefficient,
    finality,
    is_complete,
    learning_rate,
)
from roller_env.training.vector import RecipeVectorEnv, part_of

_TRAINING: Final = "training"
"""Key of RLlib's ``env_config`` under which runners find the training's configuration."""

_MOMENTS: Final = "running_moments"
"""Key of a runner's state under which is what scales observations and rewards."""

_MODULE: Final = "default_policy"
"""RLlib's name for what learns, where one learns."""

_OBJECT_STORE_BYTES: Final = 2**28
"""Of a cluster that is this machine alone: an update's samples are a few megabytes."""

_PROBE_EVERY_S: Final = 5.0
"""A lost runner is asked so often whether it is back, and may take `_PROBE_S` to answer."""

_PROBE_S: Final = 1.0


class RecipeEnvRunner(SingleAgentEnvRunner):  # type: ignore[misc]
    """Plays a part of a training's environments, all rows at once.

    RLlib's own runner appends step by step to an episode a row, and starts a row anew in a step of
    its own, in which it lets the others go on; here rows start anew as `RecipeVectorEnv` does it,
    and a rollout becomes episodes when it is over.

    Attributes:
        moments: what scaled observations and rewards when the driver last said it.
    """

    moments: Tree | None = None
    _steps = 0

    def make_env(self) -> None:
        """Make the part that belongs to this runner's number."""
        training: TrainingConfig = self.config.env_config[_TRAINING]
        # RLlib counts runners from 1; number 0 is the driver's own, which plays nothing.
        self.env = RecipeVectorEnv(part_of(training, self.worker_index - 1))
        self.num_envs = self.env.num_envs
        self._needs_initial_reset = True

    def sample(self, **_: Any) -> list[SingleAgentEpisode]:
        """Play ``rollout_fragment_length`` steps in every row; return all, cut into episodes."""
        steps = self.config.get_rollout_fragment_length(self.worker_index)
        if self._needs_initial_reset:
            self.env.reset()
            self._needs_initial_reset = False
        rollout = Rollout(self.env)
        distribution = self.module.get_exploration_action_dist_cls()
        for _step in range(steps):
            batch = {Columns.OBS: torch.from_numpy(self.env.observations)}
            with torch.no_grad():
                logits = self.module.forward_exploration(batch)[Columns.ACTION_DIST_INPUTS]
                drawn = distribution.from_logits(logits)
                actions = drawn.sample()
                log_probability = drawn.logp(actions)
            rollout.step(actions.numpy(), logits.numpy(), log_probability.numpy())
        episodes = [
            SingleAgentEpisode(
                observations=piece.observations,
                observation_space=self.env.single_observation_space,
                actions=piece.actions,
                action_space=self.env.single_action_space,
                rewards=piece.rewards,
                terminated=piece.terminated,
                truncated=piece.truncated,
                extra_model_outputs={
                    Columns.ACTION_DIST_INPUTS: piece.logits,
                    Columns.ACTION_LOGP: piece.log_probability,
                },
                # Whatever RLlib counts in an episode's infos it finds empty.
                infos=[{} for _ in range(len(piece.observations))],
                len_lookback_buffer=0,
            )
            for piece in rollout.pieces()
        ]
        count = steps * self.num_envs
        self._increase_sampled_metrics(count, sum(episode.is_done for episode in episodes))
        self._steps += count
        return episodes

    def report(self) -> Tree:
        """Return what became known since the last report.

        Returns:
            ``steps`` made, the last infos of the episodes that ``ended``, the ``node`` where this
            is, and what all steps so far showed, of this runner and before the last update of
            others, as `running_moments`.
        """
        ended, self.env.ended = self.env.ended, []
        steps, self._steps = self._steps, 0
        told = {"steps": steps, "ended": ended, "node": ray.get_runtime_context().get_node_id()}
        return {**told, **running_moments(self.env.normaliser)}

    def snapshot(self) -> tuple[int, Tree]:
        """Return this runner's number, and all that its future depends on but the weights."""
        return self.worker_index, self.env.snapshot()

    def go_on(self, trees: dict[str, Tree]) -> None:
        """Go on with the games of a snapshot, if there is one of this runner's number."""
        tree = trees.get(str(self.worker_index))
        if tree is not None:
            self.env.restore(tree)
            self._needs_initial_reset = False

    def get_state(self, *args: Any, **kwargs: Any) -> dict[str, Any]:
        """Return what another runner needs to take this one's place."""
        state: dict[str, Any] = super().get_state(*args, **kwargs)
        if self.moments is not None:
            state[_MOMENTS] = self.moments
        return state

    def set_state(self, state: dict[str, Any]) -> None:
        """Take up what RLlib sends, and what scales observations and rewards."""
        super().set_state(state)
        if _MOMENTS in state:
            self.moments = moments = state[_MOMENTS]
            # The driver's own runner has no environments.
            if self.env is not None:
                set_running_moments(self.env.normaliser, moments)


class RecipeLearner(PPOTorchLearner):  # type: ignore[misc]
    """PPO with the recipe's Adam, and rates that the driver says before every update."""

    def configure_optimizers_for_module(self, module_id: str, config: Any = None) -> None:
        """Make Adam as Stable-Baselines3 does."""
        parameters = self.get_parameters(self._module[module_id])
        self.register_optimizer(
            module_id=module_id,
            optimizer=torch.optim.Adam(parameters, eps=1e-5),
            params=parameters,
            lr_or_lr_schedule=config.lr,
        )

    def set_rates(self, rate: float, entropy: float) -> None:
        """Say learning rate and entropy coefficient of the next update."""
        fixed = Scheduler(fixed_value_or_schedule=entropy, framework="torch", device=self._device)
        self.entropy_coeff_schedulers_per_module[_MODULE] = fixed
        optimizer = self.get_optimizer(_MODULE)
        fixed = Scheduler(fixed_value_or_schedule=rate, framework="torch", device=self._device)
        self._optimizer_lr_schedules[optimizer] = fixed
        self._set_optimizer_lr(optimizer, rate)

    def _network(self) -> Any:
        """Return the module itself; one of several learners has it in a wrapper."""
        return self._module[_MODULE].unwrapped()

    def snapshot(self) -> Tree:
        """Return weights, by RLlib's names, and what Adam has found."""
        weights = self._network().state_dict()
        moments = self.get_optimizer(_MODULE).state_dict()["state"]
        return {
            "policy": {name: values.cpu().numpy().copy() for name, values in weights.items()},
            # What Adam is told is the configuration's; this is what it has found.
            "optimizer": {
                str(number): {name: value.cpu().numpy().copy() for name, value in found.items()}
                for number, found in moments.items()
            },
        }

    def restore(self, tree: Tree) -> None:
        """Put back what `snapshot` returned.

        Raises:
            ValueError: it is of another network.
        """
        optimizer = self.get_optimizer(_MODULE)
        moments = {
            int(number): {name: torch.from_numpy(value.copy()) for name, value in found.items()}
            for number, found in tree.get("optimizer", {}).items()
        }
        check_moments(moments, [p for group in optimizer.param_groups for p in group["params"]])
        weights = {name: torch.from_numpy(value.copy()) for name, value in tree["policy"].items()}
        # Besides weights the module has constants, which Stable-Baselines3's has not.
        network = self._network()
        network.load_state_dict({**network.state_dict(), **weights})
        optimizer.load_state_dict({**optimizer.state_dict(), "state": moments})


class RecipePPO(rllib_ppo.PPO):  # type: ignore[misc]
    """RLlib's PPO, which does not wait for lost runners in every update."""

    _probed_s = 0.0

    def restore_env_runners(self, env_runner_group: Any) -> list[int]:
        """Look for runners that are back, now and then."""
        if time.monotonic() - self._probed_s < _PROBE_EVERY_S:
            return []
        self._probed_s = time.monotonic()
        restored: list[int] = super().restore_env_runners(env_runner_group)
        return restored


def algorithm_config(config: TrainingConfig) -> Any:
    """Return RLlib's configuration for a training."""
    ppo, cluster = config.ppo, config.cluster
    learners = max(cluster.learners, 1)
    return (
        rllib_ppo.PPOConfig(algo_class=RecipePPO)
        .environment("roller_env:Roller/Level-v0", env_config={_TRAINING: config})
        .api_stack(enable_rl_module_and_learner=True, enable_env_runner_and_connector_v2=True)
        .framework("torch")
        .env_runners(
            env_runner_cls=RecipeEnvRunner,
            num_env_runners=cluster.runners,
            num_envs_per_env_runner=config.num_envs // cluster.runners,
            num_cpus_per_env_runner=1,
            gym_env_vectorize_mode=gym.VectorizeMode.VECTOR_ENTRY_POINT,
            rollout_fragment_length=ppo.rollout_steps,
            # What runners have seen is merged by the driver, which also keeps it.
            merge_env_runner_states=False,
            broadcast_env_runner_states=False,
            sample_timeout_s=cluster.patience_s,
        )
        .learners(
            learner_class=RecipeLearner,
            num_learners=cluster.learners,
            num_gpus_per_learner=cluster.gpus_per_learner,
        )
        .rl_module(
            model_config=DefaultModelConfig(
                fcnet_hiddens=list(ppo.hidden_sizes),
                fcnet_activation=ppo.activation,
                vf_share_layers=False,
            )
        )
        .training(
            train_batch_size_per_learner=config.steps_per_update // learners,
            minibatch_size=ppo.batch_size // learners,
            num_epochs=ppo.epochs,
            lr=ppo.learning_rate,
            gamma=ppo.gamma,
            lambda_=ppo.gae_lambda,
            clip_param=ppo.clip_range,
            # RLlib clips the squared error, which Stable-Baselines3 does not.
            vf_clip_param=float("inf"),
            vf_loss_coeff=ppo.value_coefficient,
            entropy_coeff=ppo.entropy_coefficient,
            use_kl_loss=False,
            grad_clip=ppo.max_grad_norm,
            grad_clip_by="global_norm",
        )
        .fault_tolerance(
            restart_failed_env_runners=True,
            env_runner_health_probe_timeout_s=_PROBE_S,
            env_runner_restore_timeout_s=cluster.patience_s,
        )
        .debugging(seed=config.seed, log_level="ERROR")
    )


def learn(config: TrainingConfig, files: RunFiles, address: str) -> tuple[PPO, Progress]:
    """Train on a cluster to the end of the configuration, from the checkpoint if there is one.

    Args:
        config: of the training.
        files: where checkpoint and logs are or go.
        address: of the cluster; see `roller_env.training.train`.

    Returns:
        A learner of Stable-Baselines3 that has learnt what RLlib's has, and how far it came.

    Raises:
        CheckpointError: the checkpoint is damaged, or of one machine's training.
        RunError: there is no such cluster, it is too small, or all its runners are lost.
    """
    files.directory.mkdir(parents=True, exist_ok=True)
    # Made here for its first weights too, which are those that it would begin with alone.
    model, checkpoint = new_model(config, make_environments(config)), None
    if files.checkpoint.exists():
        checkpoint = load_checkpoint(files.checkpoint)
        if CLUSTER not in checkpoint.state:
            message = "of one machine's training; go on without --cluster"
            raise CheckpointError(f"{shown(files.checkpoint)}: {message}")
        _check_weights(config, checkpoint)
    if checkpoint is None or not is_complete(config, checkpoint.progress):
        with _connected(config, address):
            checkpoint = Driver(config, files, model, checkpoint).train()
    state = checkpoint.state[CLUSTER]
    weights = {name: torch.from_numpy(value) for name, value in state["policy"].items()}
    model.policy.load_state_dict(from_rllib(config, weights))
    normaliser = model.get_vec_normalize_env()
    assert normaliser is not None
    set_running_moments(normaliser, state["normaliser"])
    return model, checkpoint.progress


def _check_weights(config: TrainingConfig, checkpoint: Checkpoint) -> None:
    """Refuse the weights of other networks here, where it can be told, and not in a learner."""
    try:
        found = checkpoint.state[CLUSTER]["policy"]
        weights = {name: torch.from_numpy(value) for name, value in found.items()}
        network_of(config, *network_spaces(config, None), from_rllib(config, weights))
    except (LookupError, TypeError, ValueError) as error:
        message = f"not of a training with this configuration ({error})"
        raise CheckpointError(f"{shown(checkpoint.file)}: {message}") from None


@contextmanager
def _connected(config: TrainingConfig, address: str) -> Iterator[None]:
    """Be part of a cluster that has the CPUs that a training needs."""
    needed = config.cluster.runners + config.cluster.learners
    options: dict[str, Any] = {"logging_level": logging.ERROR, "log_to_driver": False}
    if address == LOCAL:
        options |= {"num_cpus": needed, "object_store_memory": _OBJECT_STORE_BYTES}
        options |= {"include_dashboard": False}
    try:
        ray.init(address=address, **options)
    except (ConnectionError, RuntimeError, ValueError) as error:
        how = "'ray start --head' begins one" if address == AUTO else "is its head node running?"
        raise RunError(f"cluster {address}: cannot be reached ({error}); {how}") from error
    try:
        there = int(ray.cluster_resources().get("CPU", 0))
        if there < needed:
            raise RunError(
                f"cluster {address}: has {there} CPUs; {config.cluster.runners} runners and "
                f"{config.cluster.learners} learners need {needed}; let more nodes join, or "
                "--set cluster.runners=..."
            )
        yield
    finally:
        ray.shutdown()


class Driver:
    """Makes updates, one after the other, and keeps what must not be lost."""

    def __init__(
        self,
        config: TrainingConfig,
        files: RunFiles,
        model: PPO,
        checkpoint: Checkpoint | None,
    ) -> None:
        self._config = config
        self._files = files
        # It would tell that its new API stack is new.
        logging.getLogger("ray.rllib").setLevel(logging.ERROR)
        self._algorithm = algorithm_config(config).build_algo()
        self._runners = self._algorithm.env_runner_group
        self._learners = self._algorithm.learner_group
        if checkpoint is None:
            normaliser = model.get_vec_normalize_env()
            assert normaliser is not None
            weights = to_rllib(config, model.policy.state_dict())
            self._moments = running_moments(normaliser)
            learnt: Tree = {"policy": {name: value.numpy() for name, value in weights.items()}}
            games: dict[str, Tree] = {}
            progress = Progress()
        else:
            learnt = checkpoint.state[CLUSTER]
            self._moments = learnt["normaliser"]
            # The games of another number of runners do not fit, and begin anew.
            same = checkpoint.config.cluster.runners == config.cluster.runners
            games = learnt.get("runners", {}) if same else {}
            progress = checkpoint.progress
        self._recording = Recording(config, progress)
        self._logger = new_logger(files, progress)
        self._steps = progress.steps
        self._on_learners(lambda learner: learner.restore(learnt))
        self._runners.sync_weights(from_worker_or_learner_group=self._learners)
        self.on_runners(lambda runner: runner.go_on(games))

    def train(self) -> Checkpoint:
        """Train to the end; return the last checkpoint, which is written as well."""
        config, recording = self._config, self._recording
        answered_s = time.monotonic()
        try:
            while not is_complete(config, recording.progress):
                if self.update():
                    answered_s = time.monotonic()
                    recording.update(self._steps, self._logger)
                elif time.monotonic() - answered_s > config.cluster.patience_s:
                    raise RunError(
                        f"no runner has answered for {config.cluster.patience_s:g} s "
                        "(cluster.patience_s); --resume goes on from the last checkpoint"
                    )
                if recording.checkpoint_is_due():
                    checkpoint = self._checkpoint()
                    write_checkpoint(checkpoint)
                    recording.checkpoint_written()
            return checkpoint
        finally:
            self.stop()

    def stop(self) -> None:
        """End the runners, the learners, the display and the logs."""
        self._recording.close()
        self._logger.close()
        self._algorithm.stop()

    def update(self) -> bool:
        """Let one update be made; return whether there was anything to learn from."""
        config, progress = self._config, self._recording.progress
        rate = learning_rate(config)(1.0 - finality(config, progress))
        entropy = entropy_coefficient(config, progress)
        moments = self._moments
        self._on_learners(lambda learner: learner.set_rates(rate, entropy))
        self.on_runners(lambda runner: runner.set_state({_MOMENTS: moments}), local=True)
        self._algorithm.train()
        reports = self.on_runners(lambda runner: runner.report())
        steps = sum(int(report["steps"]) for report in reports)
        self._steps += steps
        self._recording.add(info for report in reports for info in report["ended"])
        self._moments = _merged(moments, reports)
        self._logger.record("cluster/runners", len(reports))
        self._logger.record("cluster/nodes", len({report["node"] for report in reports}))
        return steps > 0

    def _checkpoint(self) -> Checkpoint:
        """Return all that a training depends on; games that a lost runner played are not there."""
        learnt = self._on_learners(lambda learner: learner.snapshot())[0]
        games = {
            str(number): tree for number, tree in self.on_runners(lambda runner: runner.snapshot())
        }
        state = {**learnt, "normaliser": self._moments, "runners": games}
        files, progress = self._files, self._recording.progress
        return Checkpoint(files.checkpoint, self._config, progress, {CLUSTER: state})

    def on_runners(self, do: Callable[[Any], Any], *, local: bool = False) -> list[Any]:
        """Return what is done on each runner that can be reached, and with the driver's own."""
        told = self._runners.foreach_env_runner(
            do, local_env_runner=local, timeout_seconds=self._config.cluster.patience_s
        )
        return list(told)

    def _on_learners(self, do: Callable[[Any], Any]) -> list[Any]:
        """Return what is done on each learner."""
        return [told.get() for told in self._learners.foreach_learner(do)]


def _merged(base: Tree, reports: Sequence[Tree]) -> Tree:
    """Return the moments that several runners have come to from the same ones."""
    return {
        "observations": {
            name: merged(moments, [report["observations"][name] for report in reports])
            for name, moments in base["observations"].items()
        },
        "rewards": merged(base["rewards"], [report["rewards"] for report in reports]),
    }
