"""Trains one of the paper's rivals: many campaigns at once, the same loop, budget and tests for each method.

``out`` then holds ``checkpoint.safetensors`` (the network that tested best), ``card.json``, ``training_state.pt`` (to
resume) and ``logs`` (TensorBoard). The network that is kept is the one with the least episodic AoI on training
campaigns, as in the paper (Section VII-A); campaigns that are evaluated later are never looked at.
"""

import io
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch.utils.tensorboard import SummaryWriter

from policy.agents.rivals.checkpoint import CARD, WEIGHTS, save_learner
from policy.agents.rivals.learner import Learner
from policy.environments.vector_world import VectorWorld
from policy.model.files import write_atomically
from policy.training.campaign_draws import Sampler, draw_campaigns
from policy.training.rival_card import write_rival_card
from policy.training.rival_settings import RivalProgress, RivalTraining
from policy.training.settings import TrainingError, check_same

STATE = "training_state.pt"
TEST_SEED = 7_654_321
"""Of the campaigns on which networks are compared, the same for all of a training."""


def train_rival(
    learner: Learner,
    sampler: Sampler,
    settings: RivalTraining,
    out: Path,
    *,
    resume: bool = False,
    progress: Callable[[RivalProgress], None] | None = None,
) -> Path:
    """Train ``learner`` on the campaigns that ``sampler`` draws; returns ``out``.

    Raises TrainingError with one line (not finite, disk full, nothing to resume); the last good checkpoint is kept.
    """
    torch.set_num_threads(settings.threads)
    run = _Run(learner, sampler, settings, out)
    if resume:
        run.resume()
    with SummaryWriter(log_dir=str(out / "logs"), purge_step=run.episode) as log:
        while not run.done:
            told = run.one_round()
            for name in ("score", "tested", "loss"):
                log.add_scalar(name, getattr(told, name), told.episode)
            if progress is not None:
                progress(told)
    run.finish()
    return out


class _Run:
    """One training. ``episode`` counts the campaigns flown."""

    def __init__(self, learner: Learner, sampler: Sampler, settings: RivalTraining, out: Path) -> None:
        self._learner, self._sampler, self._settings, self._out = learner, sampler, settings, out
        self._batch = min(settings.batch or learner.settings.campaigns, settings.episodes)
        self._rounds = -(-settings.episodes // self._batch)
        self._round, self._owed, self._updates = 0, 0.0, 0
        self._tested, self._best = float("nan"), float("inf")
        self._scores: list[tuple[int, float]] = []
        self._begun_s, self._begun_processor_s = time.monotonic(), time.process_time()
        self._spent_s, self._spent_processor_s = 0.0, 0.0  # before a resumption
        self._resumed_at = 0

    @property
    def episode(self) -> int:
        return min(self._round * self._batch, self._settings.episodes)

    @property
    def seconds(self) -> float:
        """Spent so far, by the clock."""
        return self._spent_s + time.monotonic() - self._begun_s

    @property
    def processor_s(self) -> float:
        """The same without what other programs held the processor for."""
        return self._spent_processor_s + time.process_time() - self._begun_processor_s

    @property
    def done(self) -> bool:
        limit_s = self._settings.seconds
        return self._round >= self._rounds or (limit_s is not None and self.seconds > limit_s)

    def one_round(self) -> RivalProgress:
        settings = self._settings
        rng = np.random.default_rng([settings.seed, self._round])
        torch.manual_seed(int(rng.integers(2**31)))
        score, loss = self._fly_and_learn(rng)
        self._round += 1
        every = max(1, self._rounds // settings.tests)
        if self._round % every == 0 or self.done:
            self._test()
        return self._told(score, loss)

    def _fly_and_learn(self, rng: np.random.Generator) -> tuple[float, float]:
        settings, learner = self._settings, self._learner
        world = VectorWorld(draw_campaigns(self._sampler, rng, self._batch, settings.variety, settings.device))
        share = learner.settings.exploration(self._round / self._rounds)
        learner.begin(world.scenario, self._batch)
        fresh, losses = 0.0, []
        while not world.done:
            reward = world.step(learner.choose(world.state, world.legal(), share))
            learner.remember(reward, last=world.done)
            fresh += float(world.mean_aoi().mean())
            self._owed += learner.settings.updates_per_slot
            while self._owed >= 1.0:
                self._owed -= 1.0
                loss = learner.learn()
                if loss is None:
                    self._owed = 0.0
                    continue
                losses.append(loss)
        self._updates += len(losses)
        mean = float(np.mean(losses)) if losses else float("nan")
        if losses and not np.isfinite(mean):
            raise TrainingError(
                f"round {self._round + 1}: the loss is {mean}; the last good checkpoint in {self._out} is kept, "
                "start anew with a smaller learning rate"
            )
        return fresh / world.scenario.slots, mean

    def _test(self) -> None:
        """Keep the network if it is the best so far."""
        rng = np.random.default_rng([TEST_SEED, self._settings.seed])
        draw = (self._sampler, rng, self._settings.test_campaigns, self._settings.variety, self._settings.device)
        self._tested = mean_episodic_aoi(self._learner, VectorWorld(draw_campaigns(*draw)))
        self._scores.append((self.episode, self._tested))
        if self._tested <= self._best:
            self._best = self._tested
            self._save_network()
        self._save_state()

    def _save_network(self) -> None:
        try:
            save_learner(self._learner, self._out / WEIGHTS)
        except OSError as error:
            raise TrainingError(f"{self._out}: cannot write the checkpoint ({error})") from None

    def _save_state(self) -> None:
        buffer = io.BytesIO()
        state = {
            "method": self._learner.name,
            "settings": self._learner.settings.to_json(),
            "network": self._learner.network.state_dict(),
            "optimiser": self._learner.optimiser_state(),
            "round": self._round,
            "updates": self._updates,
            "best": self._best,
            "scores": self._scores,
            "seconds": self.seconds,
            "processor_s": self.processor_s,
        }
        torch.save(state, buffer)
        try:
            write_atomically(self._out / STATE, buffer.getvalue())
        except OSError as error:
            raise TrainingError(f"{self._out}: cannot write the checkpoint ({error})") from None

    def resume(self) -> None:
        """Network, optimiser and counts; what was remembered is gathered anew."""
        path = self._out / STATE
        if not path.is_file():
            raise TrainingError(f"{path}: nothing to resume; start without --resume")
        try:
            state = torch.load(path, map_location=self._settings.device, weights_only=True)
            if state["method"] != self._learner.name:
                raise TrainingError(f'{path}: is of "{state["method"]}"; resume it with --policy {state["method"]}')
            check_same(path, state["settings"], self._learner.settings.to_json())
            self._learner.network.load_state_dict(state["network"])
            self._learner.restore_optimiser(state["optimiser"])
            self._round, self._updates, self._best = int(state["round"]), int(state["updates"]), float(state["best"])
            self._scores = [(int(episode), float(score)) for episode, score in state["scores"]]
            self._spent_s, self._spent_processor_s = float(state["seconds"]), float(state["processor_s"])
            self._resumed_at = self._round
        except (RuntimeError, KeyError, TypeError, ValueError, EOFError, OSError) as error:
            if isinstance(error, TrainingError):
                raise
            line = " ".join(str(error).split())[:160]
            raise TrainingError(f"{path}: cannot be resumed from ({line}); start without --resume") from None

    def _told(self, score: float, loss: float) -> RivalProgress:
        done = max(1, self._round - self._resumed_at)
        pace_s = (time.monotonic() - self._begun_s) / done
        return RivalProgress(
            episode=self.episode,
            episodes=self._settings.episodes,
            batch=min(self._batch, self.episode - (self._round - 1) * self._batch),
            score=score,
            tested=self._tested,
            best=self._best,
            loss=loss,
            eta_s=(self._rounds - self._round) * pace_s,
        )

    def finish(self) -> None:
        write_rival_card(
            self._out / CARD,
            weights=self._out / WEIGHTS,
            learner=self._learner,
            settings=self._settings,
            data=getattr(self._sampler, "description", "as the caller's sampler draws them"),
            episodes=self.episode,
            updates=self._updates,
            tests=self._scores,
            training_s=self.seconds,
            processor_s=self.processor_s,
        )


def mean_episodic_aoi(learner: Learner, world: VectorWorld) -> float:
    """Episodic AoI (Eq. 7) of ``world``'s campaigns, flown as well as ``learner`` can."""
    learner.begin(world.scenario, world.state.uav_pos_enu_m.shape[0])
    fresh = 0.0
    with torch.no_grad():
        while not world.done:
            world.step(learner.choose(world.state, world.legal()))
            fresh += float(world.mean_aoi().mean())
    return fresh / world.scenario.slots
