"""The way into training: Algorithm 1 from the first episode to a folder that agents can fly with.

``out`` then holds ``checkpoint.safetensors`` (weights), ``model.onnx`` (for flying), ``card.json`` (where they come
from), ``curve.csv`` (the learning curve), ``training_state.pt`` (to resume) and ``logs`` (TensorBoard). Everything is
written beside and renamed, so an interrupted run leaves its last good checkpoint.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch.utils.tensorboard import SummaryWriter

from policy.agents.gcrl import GcrlAgent, GcrlSettings
from policy.evaluation.learning_curve import CURVE, CurvePoint, read_curve
from policy.evaluation.rollout import SlotPhysics
from policy.model.checkpoint import CheckpointFiles
from policy.model.checkpoint_error import CheckpointError
from policy.model.evaluator import NetworkEvaluator
from policy.model.export import export_onnx, onnx_graph
from policy.model.network import GcrlNetwork
from policy.model.onnx_runner import OnnxRunner
from policy.model.weights import save_weights
from policy.search.paper_tree import TreeSettings
from policy.training.card import git_commit, write_card
from policy.training.collect import fly_episode
from policy.training.curve import curve_point, save_curve
from policy.training.learner import Learner
from policy.training.replay import Replay
from policy.training.settings import TrainingError, TrainingStoppedError, TrainProgress, TrainSettings
from policy.training.snapshot import FILE, load_snapshot, save_snapshot
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario
from policy.world.transition import step

__all__ = ["TrainProgress", "TrainSettings", "TrainingError", "TrainingStoppedError", "train"]

ROOT_CHILDREN = 3
"""Half of what flies, for shorter episodes: 9 + 27 (U - 1) states a decision instead of 9 + 54 (U - 1)."""


def train(
    scenario: Scenario,
    trace_sampler: Callable[[np.random.Generator], tuple[Scenario, FloatArray]],
    settings: TrainSettings,
    out: Path,
    *,
    resume: bool = False,
    progress: Callable[[TrainProgress], None] | None = None,
    physics: SlotPhysics = step,
    stop: Callable[[], bool] = lambda: False,
) -> Path:
    """Train for ``scenario``'s objective on the campaigns that ``trace_sampler`` draws; returns ``out``.

    ``trace_sampler(rng)`` gives an episode's scenario and its users' places [T+1, M, 2]; its ``description``, where
    it has one, goes into the model card. ``physics`` flies the slots, the world's ideal motion unless told otherwise.
    ``stop`` is asked after every episode; then the run is checkpointed and ends with TrainingStoppedError. Raises
    TrainingError with one line (not finite, disk full, nothing to resume, no such device); the last good checkpoint is
    kept.
    """
    torch.set_num_threads(settings.threads)
    run = _Run(scenario, trace_sampler, settings, out, physics)
    if resume:
        run.resume()
    with SummaryWriter(log_dir=str(out / "logs"), purge_step=run.episode + 1) as log:
        while run.episode < settings.episodes:
            told = run.one_episode()
            _log(log, told)
            if progress is not None:
                progress(told)
            if stop() and run.episode < settings.episodes:
                run.checkpoint()
                raise TrainingStoppedError(f"stopped after episode {run.episode}; {out} is complete, --resume goes on")
            if run.episode % settings.checkpoint_every == 0:
                run.checkpoint()
    run.finish()
    return out


class _Run:
    """One run's parts. ``episode`` counts those flown."""

    def __init__(
        self,
        scenario: Scenario,
        trace_sampler: Callable[[np.random.Generator], tuple[Scenario, FloatArray]],
        settings: TrainSettings,
        out: Path,
        physics: SlotPhysics,
    ) -> None:
        self._scenario, self._sampler, self._settings, self._out = scenario, trace_sampler, settings, out
        self._physics = physics
        check_device(settings.device)
        torch.manual_seed(settings.seed)
        self._learner = Learner(GcrlNetwork(settings.model), settings)
        self._replay = Replay(settings.replay_episodes)
        self._scores: list[float] = []
        self._curve: list[CurvePoint] = []
        self._losses = (float("nan"), float("nan"))
        self._begun_s = time.monotonic()
        self._resumed_at = 0
        self._commit = git_commit()  # of what runs, not of what the folder holds by the end

    @property
    def episode(self) -> int:
        return len(self._scores)

    def resume(self) -> None:
        self._scores = load_snapshot(self._out / FILE, self._settings, self._learner, self._replay)
        self._resumed_at = self.episode
        try:
            kept = read_curve(self._out / CURVE) or []  # a run that is older than this file begins its curve here
        except CheckpointError as error:
            raise TrainingError(str(error)) from None
        self._curve = [point for point in kept if point.episode <= self.episode]

    def one_episode(self) -> TrainProgress:
        rng = np.random.default_rng([self._settings.seed, self.episode])
        scenario, pos_enu_m = self._sampler(rng)
        share = self._settings.exploration(self.episode)
        episode, score = fly_episode(scenario, pos_enu_m, self._agent(), share, rng, self._physics)
        self._replay.add(episode)
        self._learn(rng)
        self._scores.append(score)
        told = self._told()
        self._curve.append(curve_point(told))
        return told

    def _agent(self) -> GcrlAgent:
        """Lines 4 to 10 of Algorithm 1, the network as it is now: what it shall judge is what its own search meets.

        It flies as the graph that ships: a decision's few states take half as long as by torch.
        """
        depth = self._settings.search_depth
        settings = replace(GcrlSettings.paper(depth), tree=TreeSettings(depth, root_children=ROOT_CHILDREN))
        if self.episode < self._settings.warmup_episodes:
            settings = GcrlSettings.for_warmup(self._settings.horizon_slots, self._settings.beam)
        return GcrlAgent(settings, NetworkEvaluator(OnnxRunner(onnx_graph(self._learner.network))))

    def _learn(self, rng: np.random.Generator) -> None:
        settings = self._settings
        losses = []
        for _ in range(settings.updates_per_episode):
            batch = self._replay.sample(rng, settings.batch_size, settings.n_step, settings.model.gamma)
            try:
                losses.append(self._learner.update(batch, settings.rate(self.episode)))
            except TrainingError as error:
                raise TrainingError(
                    f"episode {self.episode + 1}: {error}; the last good checkpoint in {self._out} is kept, "
                    "resume it with a smaller learning rate"
                ) from None
        prediction, value = np.mean(losses, axis=0)
        self._losses = (float(prediction), float(value))

    def _told(self) -> TrainProgress:
        done = self.episode - self._resumed_at
        left = self._settings.episodes - self.episode
        return TrainProgress(
            episode=self.episode,
            episodes=self._settings.episodes,
            score=self._scores[-1],
            mean_score=float(np.mean(self._scores[-20:])),
            value_loss=self._losses[1],
            prediction_loss=self._losses[0],
            eta_s=left * (time.monotonic() - self._begun_s) / max(1, done),
        )

    def checkpoint(self) -> None:
        """Weights and curve first: a snapshot never tells of what is not there."""
        try:
            save_weights(self._learner.network, CheckpointFiles.in_folder(self._out).weights)
        except OSError as error:
            raise TrainingError(f"{self._out}: cannot write the checkpoint ({error})") from None
        save_curve(self._out / CURVE, self._curve)
        save_snapshot(self._out / FILE, self._settings, self._learner, self._replay, self._scores)

    def finish(self) -> None:
        """The last checkpoint, the graph that flies, and the card that vouches for both."""
        self.checkpoint()
        try:
            self._export()
        except OSError as error:
            raise TrainingError(
                f"{self._out}: cannot write the exported network ({error}); the weights are kept, --resume exports them"
            ) from None

    def _export(self) -> None:
        files = CheckpointFiles.in_folder(self._out)
        export_onnx(self._learner.network.cpu(), files.graph)
        write_card(
            files,
            network=self._learner.network,
            settings=self._settings,
            objective=self._scenario.objective,
            data=getattr(self._sampler, "description", "as the caller's sampler draws them"),
            scores=self._scores,
            training_s=time.monotonic() - self._begun_s,
            commit=self._commit,
        )


def check_device(name: str) -> None:
    """Raise TrainingError unless torch can compute there."""
    try:
        torch.zeros(1, device=name).item()
    except (RuntimeError, AssertionError) as error:
        line = " ".join(str(error).split())[:120]
        raise TrainingError(f"--device {name}: not to be had on this machine ({line}); use cpu") from None


def _log(log: SummaryWriter, told: TrainProgress) -> None:
    for name in ("score", "mean_score", "value_loss", "prediction_loss"):
        log.add_scalar(name, getattr(told, name), told.episode)
