"""Learning curves as training keeps them; those of older runs come from their TensorBoard logs:

python -m policy.training.curve DIR ...      # writes DIR/curve.csv from DIR/logs
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from policy.evaluation.learning_curve import COLUMNS, CURVE, CurvePoint, curve_text
from policy.model.files import write_atomically
from policy.training.settings import TrainingError, TrainProgress


def curve_point(told: TrainProgress) -> CurvePoint:
    """What the curve keeps of an episode."""
    return CurvePoint(**{name: getattr(told, name) for name in COLUMNS})


def save_curve(path: Path, points: Sequence[CurvePoint]) -> None:
    """Written beside and renamed; TrainingError where it cannot be."""
    try:
        write_atomically(path, curve_text(points).encode())
    except OSError as error:
        raise TrainingError(f"{path}: cannot write the learning curve ({error})") from None


def curve_of_logs(logs: Path) -> list[CurvePoint]:
    """The curve that a run's TensorBoard events tell; where an episode was flown again after a resumption, the later
    one counts. TrainingError where there are none.
    """
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator  # noqa: PLC0415 - slow

    events = EventAccumulator(str(logs), size_guidance={"scalars": 0})
    names = COLUMNS[1:]
    if logs.is_dir():
        events.Reload()
    if not set(names) <= set(events.Tags()["scalars"]):
        raise TrainingError(f"{logs}: holds no TensorBoard events of {', '.join(names)}; name a folder of policy train")
    told: Mapping[str, Mapping[int, float]] = {
        name: {event.step: event.value for event in events.Scalars(name)} for name in names
    }
    return [CurvePoint(episode, *(told[name][episode] for name in names)) for episode in sorted(told[names[0]])]


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code 2 and one line where a folder has no logs."""
    parser = argparse.ArgumentParser(prog="python -m policy.training.curve", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DIR", help="as training wrote it")
    try:
        for folder in parser.parse_args(arguments).folders:
            save_curve(folder / CURVE, curve_of_logs(folder / "logs"))
            print(folder / CURVE)
    except TrainingError as error:
        print(f"policy.training.curve: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
