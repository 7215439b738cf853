"""How long a rival is trained, the same for each of them."""

from dataclasses import asdict, dataclass, field
from typing import Any

from policy.training.campaign_draws import Variety


@dataclass(frozen=True)
class RivalTraining:
    """``episodes`` campaigns are flown, and the network as it is now and then is tested."""

    episodes: int = 2000
    seed: int = 0
    mission: str = ""  # whose users are trained on: the tables look for it
    batch: int | None = None  # None: as many at once as suit the method
    device: str = "cpu"
    threads: int = 1
    tests: int = 10  # times that the present network is tested, in equal steps; the best is kept
    test_campaigns: int = 16
    variety: Variety = field(default_factory=Variety)
    seconds: float | None = None  # stop early when so much time is spent; None: never

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        for name in ("episodes", "batch", "threads", "tests", "test_campaigns"):
            if (getattr(self, name) or 1) < 1 or getattr(self, name) == 0:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if self.seed < 0:
            raise ValueError("seed must not be negative")

    def to_json(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)


@dataclass(frozen=True)
class RivalProgress:
    """Told after every batch of campaigns."""

    episode: int  # flown so far
    episodes: int  # in all
    batch: int  # flown since last told
    score: float  # mean AoI of this batch, exploration included (Eq. 7)
    tested: float  # of the last test, flown as well as it can; NaN before the first
    best: float  # of the network that is kept
    loss: float  # mean of this batch's updates; NaN before the first
    eta_s: float  # seconds left, by the pace so far
