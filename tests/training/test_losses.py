import torch

from policy.model.network import Outputs
from policy.training.losses import ENERGY_WEIGHT, STANDING_WALKS, STATE_WEIGHT, WAY_WEIGHT, prediction_loss, value_loss


def test_value_loss_by_hand() -> None:
    """Two users cost 2 and 4 (mean 3), told 5 and 4: errors 1 and 0 of 3; the state's mean is off by 0.5."""
    told, target = torch.tensor([[5.0, 4.0]]), torch.tensor([[2.0, 4.0]])
    expected = STATE_WEIGHT * 0.5**2 + (1.0**2 + 0.0) / 2
    torch.testing.assert_close(value_loss(told, target, torch.ones(1, 2)), torch.tensor(expected))


def test_who_is_absent_teaches_nothing() -> None:
    told = torch.tensor([[5.0, 99.0]], requires_grad=True)
    value_loss(told, torch.tensor([[2.0, 1.0]]), torch.tensor([[1.0, 0.0]])).backward()
    assert told.grad is not None
    assert told.grad[0, 1] == 0.0
    assert told.grad[0, 0] > 0.0


def heads(user_next: torch.Tensor, uav_next: torch.Tensor) -> Outputs:
    return Outputs(torch.ones(1, 1), user_next, uav_next, torch.ones(1, 1, 1))


def test_prediction_loss_by_hand() -> None:
    """UAV off by 2 ways and a hundredth of its battery; user's way by 3 walks (absolute), its AoI by 0.5 (squared)."""
    told = heads(torch.tensor([[[3.0, 0.0, 0.5, 0.0]]]), torch.tensor([[[2.0, 0.0, 0.01]]]))
    loss = prediction_loss(told, torch.zeros(1, 1, 3), torch.zeros(1, 1, 4), torch.ones(1, 1), torch.ones(1, 1))
    torch.testing.assert_close(
        loss, torch.tensor(4.0 * WAY_WEIGHT + 1e-4 * ENERGY_WEIGHT + (3.0 - STANDING_WALKS / 2) + 0.25)
    )


def test_most_stand_so_standing_is_predicted() -> None:
    """Seven stand, three ride ten walks: the best single answer is to stand, not the mean of three walks."""
    ways = torch.tensor([0.0] * 7 + [10.0] * 3)
    target = torch.zeros(1, 10, 4)
    target[0, :, 0] = ways
    losses = []
    for answer in (0.0, 3.0):
        told = torch.zeros(1, 10, 4)
        told[..., 0] = answer
        losses.append(
            prediction_loss(
                heads(told, torch.zeros(1, 1, 3)), torch.zeros(1, 1, 3), target, torch.ones(1, 1), torch.ones(1, 10)
            )
        )
    assert losses[0] < losses[1]
