"""Trains and judges the forecast of users' places (``policy.model.forecast``).

``python -m policy.training.forecast --out NAME.safetensors [--traces purdue_59 ...]`` trains on synthetic walkers, with
``--traces`` also on those real sets (leave out the one that it shall be judged on); ``--judge [NAME.safetensors]``
prints a Markdown table of how good forecasts are on walkers or, with ``--traces``, on real sets.
"""

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch
from safetensors.torch import save
from torch import Tensor

from policy.mobility.traces import TraceError
from policy.model.checkpoint_error import CheckpointError
from policy.model.features import Float32Array
from policy.model.files import sha256, write_atomically
from policy.model.forecast import FORECAST_SLOTS, LEAST_BLUR
from policy.model.forecast_file import load_forecaster
from policy.model.states import WALK_MPS
from policy.training.card import card_head
from policy.training.forecast_data import Examples, examples, real_examples, seen_at, walker_examples
from policy.training.forecast_network import ForecastNetwork, ranked_score
from policy.training.places import Place, real_names, real_place, walker_places
from policy.training.settings import TrainingError
from policy.world.arrays import FloatArray

BATCH = 1024
LEARNING_RATE = 2e-3
DEVIATION_FLOOR = 1e-3


def train_forecast(
    walkers: Sequence[Examples],
    real: Sequence[Examples] = (),
    *,
    updates: int,
    seed: int,
    device: str = "cpu",
    tell: Callable[[int, float], None] | None = None,
) -> ForecastNetwork:
    """Adam on batches of which real sets, where given, are half. TrainingError where the score is not finite."""
    torch.manual_seed(seed)
    draws = torch.Generator().manual_seed(seed)
    pools = [_pool(walkers, device), *([_pool(real, device)] if real else [])]
    mean, deviation = pools[0][0].mean(dim=0), pools[0][0].std(dim=0) + DEVIATION_FLOOR
    network = ForecastNetwork(mean, deviation).to(device)
    adam = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    for update in range(updates):
        parts = [_draw(pool, BATCH // len(pools), draws) for pool in pools]
        features, true_way = (torch.cat(part) for part in zip(*parts, strict=True))
        way, blur = network(features)
        score = torch.mean(ranked_score(way, blur, true_way))
        if not math.isfinite(score.item()):
            raise TrainingError(f"the score is not finite after {update} updates; are the places finite?")
        adam.zero_grad(set_to_none=True)
        score.backward()  # type: ignore[no-untyped-call]
        for group in adam.param_groups:
            group["lr"] = LEARNING_RATE * (1.0 - 0.95 * update / updates)
        adam.step()
        if tell is not None:
            tell(update + 1, score.item())
    return network


def _pool(parts: Sequence[Examples], device: str) -> tuple[Tensor, Tensor]:
    features = torch.from_numpy(np.concatenate([part.features for part in parts])).to(device)
    return features, torch.from_numpy(np.concatenate([part.way for part in parts])).to(device)


def _draw(pool: tuple[Tensor, Tensor], size: int, draws: torch.Generator) -> tuple[Tensor, Tensor]:
    rows = torch.randint(pool[0].shape[0], (size,), generator=draws).to(pool[0].device)
    return pool[0][rows], pool[1][rows]


def save_forecast(network: ForecastNetwork, path: Path, *, data: str, updates: int, seed: int, seconds: float) -> None:
    """Weights and, beside them, the model card."""
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in network.state_dict().items()}
    write_atomically(path, save(tensors))
    card = {
        **card_head("forecast of users' places"),
        "data": data,
        "objective": "CRPS of the chance to lie within the blur of the place, 1 to 15 slots ahead",
        "seeds": [seed],
        "updates": updates,
        "training_s": round(seconds, 1),
        "sha256": sha256(path),
        "limits": ["Learned for slots of 15 s and people on foot, on bicycles and in cars on campus-sized areas."],
    }
    write_atomically(path.with_suffix(".json"), (json.dumps(card, indent=2) + "\n").encode())


HALF_WAY, GROWTH, MOST_BLUR_M = 0.5, 0.5, 200.0
"""The fixed rule that a forecast is compared with: half of the mean way in the last four slots, growing by half of
that a slot.
"""


def judge(place: Place, path: Path | None) -> dict[str, FloatArray]:
    """Scores in metres [H] of "they stay", of the fixed rule of doubt and of the forecast."""
    moments = np.arange(place.pos_enu_m.shape[0] - FORECAST_SLOTS)
    walk_m = WALK_MPS * place.scenario.slot_s
    seen = examples(place.pos_enu_m, place.scenario.slot_s, moments)
    ways, blurs = load_forecaster(path).outputs(seen.features)
    four_m = np.linalg.norm(seen_at(place.pos_enu_m, moments).steps_m[:, :, :4], axis=-1).mean(axis=2).reshape(-1, 1)
    rule_m = np.clip(HALF_WAY * four_m * (1.0 + GROWTH * np.arange(FORECAST_SLOTS)), LEAST_BLUR, MOST_BLUR_M)
    stay = np.zeros_like(ways)
    sure = np.full(blurs.shape, 1e-4)
    guesses = {
        "stay": (stay, sure),
        "stay, rule": (stay, rule_m / walk_m),
        "forecast": (ways, blurs.astype(np.float64)),
    }
    return {name: walk_m * _score(way, blur, seen.way) for name, (way, blur) in guesses.items()}


def _score(way: Float32Array, blur: FloatArray, true_way: Float32Array) -> FloatArray:
    each = ranked_score(torch.from_numpy(way), torch.from_numpy(blur.astype(np.float32)), torch.from_numpy(true_way))
    return np.asarray(each.mean(dim=0).numpy(), dtype=np.float64)


def main() -> int:
    """Exit code 0, or 2 with one line on stderr."""
    parser = argparse.ArgumentParser(prog="python -m policy.training.forecast", description=__doc__)
    parser.add_argument("--out", type=Path, help="file to write, NAME.safetensors; its card goes beside it")
    parser.add_argument("--judge", type=Path, nargs="?", const=None, default=False, help="a file; default: the shipped")
    parser.add_argument("--traces", nargs="*", choices=real_names(), help="real sets (UCS_DATA_DIR); none named: all")
    parser.add_argument("--half", action="store_true", help="learn from half of the real sets' users only")
    parser.add_argument("--crowds", type=int, default=600, help="synthetic crowds to learn from")
    parser.add_argument("--updates", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device", default="cpu", help="cpu (default) or cuda")
    arguments = parser.parse_args()
    if (arguments.out is None) == (arguments.judge is False):
        parser.error("either --out or --judge")
    try:
        if arguments.out is None:
            _print_judged(arguments.judge, arguments.traces)
        else:
            _train(arguments)
    except (TrainingError, TraceError, CheckpointError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


def _train(arguments: argparse.Namespace) -> None:
    torch.set_num_threads(1)
    begun_s = time.monotonic()
    names = arguments.traces if arguments.traces or arguments.traces is None else real_names()
    walkers = list(walker_examples(arguments.crowds, arguments.seed))
    real = [real_examples(name, 0 if arguments.half else None) for name in names or ()]
    told = {"updates": arguments.updates, "seed": arguments.seed}
    network = train_forecast(walkers, real, device=arguments.device, tell=_tell, **told)
    users = "half of the users of " if arguments.half else ""
    also = f"; half of each batch from {users}the real sets {', '.join(names)}" if names else "; no real trace"
    data = f"{arguments.crowds} crowds of synthetic walkers of random kind{also}"
    save_forecast(network, arguments.out, data=data, seconds=time.monotonic() - begun_s, **told)


def _tell(update: int, score: float) -> None:
    if update % 1000 == 0:
        sys.stdout.write(f"{update} score {score:.3f}\n")
        sys.stdout.flush()


def _print_judged(path: Path | None, traces: Sequence[str] | None) -> None:
    places = walker_places() if traces is None else map(real_place, traces or real_names())
    sys.stdout.write("| users | forecast | 1 | 3 | 6 | 10 | 15 slots ahead | mean |\n" + "| --- " * 8 + "|\n")
    for place in places:
        for name, score_m in judge(place, path).items():
            cells = (*(score_m[slot - 1] for slot in (1, 3, 6, 10, 15)), score_m.mean())
            sys.stdout.write(f"| {place.name} | {name} | " + " | ".join(f"{cell:.1f}" for cell in cells) + " |\n")


if __name__ == "__main__":
    sys.exit(main())
