"""Whole runs, small: what they leave behind, and what an interruption costs."""

import errno
import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tests_training_small import SMALL_PLACE, SMALL_RUN, Poisoned, small_scenario

from policy.agents.gcrl import GcrlAgent
from policy.model.checkpoint import load_evaluator
from policy.model.weights import load_weights
from policy.training.api import train
from policy.training.settings import TrainingError, TrainingStoppedError, TrainProgress


class Pulled(Exception):
    """The plug."""


def pull_after(episodes: int):  # type: ignore[no-untyped-def]
    def told(progress: TrainProgress) -> None:
        if progress.episode > episodes:
            raise Pulled

    return told


def test_an_interrupted_run_goes_on_to_the_same_weights(tmp_path: Path) -> None:
    heard: list[TrainProgress] = []
    whole = train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "whole", progress=heard.append)
    with pytest.raises(Pulled):
        train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "cut", progress=pull_after(2))
    cut = train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "cut", resume=True)
    one, other = (load_weights(out / "checkpoint.safetensors").state_dict() for out in (whole, cut))
    assert all(torch.equal(one[name], other[name]) for name in one)

    assert [told.episode for told in heard] == [1, 2, 3, 4]
    assert heard[-1].eta_s == 0.0
    assert all(told.score >= 1.0 and told.value_loss >= 0.0 for told in heard)
    card = json.loads((whole / "card.json").read_text())
    assert card["data"] == SMALL_PLACE.description
    assert card["seeds"] == [5]
    assert load_evaluator(whole).spec == SMALL_RUN.model
    assert GcrlAgent.load(whole).name == "gcrl"
    assert any((whole / "logs").iterdir())
    assert not [path for path in whole.iterdir() if path.name.startswith(".")]


@pytest.mark.filterwarnings("ignore:invalid value encountered")
def test_numbers_that_are_none_end_the_run_and_keep_the_last_good_checkpoint(tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="last good checkpoint") as refusal:
        train(small_scenario(), Poisoned(good=2), replace(SMALL_RUN, warmup_episodes=4), tmp_path)
    assert "\n" not in str(refusal.value)
    kept = load_weights(tmp_path / "checkpoint.safetensors", SMALL_RUN.model)
    assert all(torch.isfinite(tensor).all() for tensor in kept.state_dict().values())


def test_resuming_needs_something_to_resume_with_the_same_settings(tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="nothing to resume"):
        train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "empty", resume=True)
    with pytest.raises(Pulled):
        train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path, progress=pull_after(2))
    with pytest.raises(TrainingError, match="seed 5 instead of 6") as refusal:
        train(small_scenario(), SMALL_PLACE, replace(SMALL_RUN, seed=6), tmp_path, resume=True)
    assert "\n" not in str(refusal.value)
    state = tmp_path / "training_state.pt"
    state.write_bytes(state.read_bytes()[:200])
    with pytest.raises(TrainingError, match="cannot be resumed") as refusal:
        train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path, resume=True)
    assert "\n" not in str(refusal.value)


def test_asked_to_stop_it_keeps_everything(tmp_path: Path) -> None:
    heard: list[int] = []
    with pytest.raises(TrainingStoppedError, match="after episode 3") as stopped:
        train(
            small_scenario(),
            SMALL_PLACE,
            SMALL_RUN,
            tmp_path / "cut",
            progress=lambda told: heard.append(told.episode),
            stop=lambda: len(heard) == 3,
        )
    assert "\n" not in str(stopped.value)
    train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "cut", resume=True)
    train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "whole")
    one, other = ((tmp_path / name / "checkpoint.safetensors").read_bytes() for name in ("cut", "whole"))
    assert one == other


def test_a_full_disk_ends_the_run_in_one_line_and_what_was_kept_still_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk is full from episode 3 on: the checkpoint of episode 2 stays whole."""
    heard: list[int] = []
    real = os.fsync

    def full(handle: int) -> None:
        if len(heard) >= 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        real(handle)

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(TrainingError, match="No space left") as refusal:
            train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path, progress=lambda told: heard.append(told.episode))
    assert "\n" not in str(refusal.value)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
    train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path, resume=True)
    train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path / "whole")
    one, other = (load_weights(out / "checkpoint.safetensors").state_dict() for out in (tmp_path, tmp_path / "whole"))
    assert all(torch.equal(one[name], other[name]) for name in one)


def test_a_disk_that_fills_up_while_exporting_keeps_the_weights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("policy.training.api.export_onnx", full)
        with pytest.raises(TrainingError, match="--resume exports"):
            train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path)
    train(small_scenario(), SMALL_PLACE, SMALL_RUN, tmp_path, resume=True)
    assert load_evaluator(tmp_path).spec == SMALL_RUN.model


def test_a_device_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="cuda:9"):
        train(small_scenario(), SMALL_PLACE, replace(SMALL_RUN, device="cuda:9"), tmp_path)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU on this machine")
def test_a_gpu_ends_near_where_the_processor_does(tmp_path: Path) -> None:
    """Sums are rounded in another order, so the runs part slowly; over four small episodes hardly at all."""
    runs = {
        device: train(small_scenario(), SMALL_PLACE, replace(SMALL_RUN, device=device), tmp_path / device)
        for device in ("cpu", "cuda")
    }
    one, other = (load_weights(out / "checkpoint.safetensors").state_dict() for out in runs.values())
    assert all(torch.allclose(one[name], other[name], atol=1e-3) for name in one)
