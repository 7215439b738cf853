"""MuZero's tree on a model that is known exactly: it finds what value iteration finds; its noise and first visits."""

import pytest
import torch

from policy.agents.rivals.tree import TreeSettings, _Tree, add_noise, search

GAMMA, PLACES = 0.9, 7
PRIZES = torch.tensor([2.0, 0.0, 0.0, 0.5, 0.0, 0.0, 3.0])


def moved(place, action):
    """Action 1 goes up, 2 down, the others stay."""
    return min(max(place + {1: 1, 2: -1}.get(action, 0), 0), PLACES - 1)


def exact_values():
    """What each place is worth to one UAV that moves as well as can be: value iteration [PLACES]."""
    value = torch.zeros(PLACES)
    for _ in range(300):
        value = torch.stack(
            [max(PRIZES[moved(p, a)] + GAMMA * value[moved(p, a)] for a in range(3)) for p in range(PLACES)]
        )
    return value


EXACT = exact_values()


class Corridor:
    """UAVs on places 0..6; each earns what lies where it arrives."""

    def __init__(self, value=EXACT):
        self._value = value

    def step(self, hidden, actions):
        place = hidden[..., 0] + (actions == 1).float() - (actions == 2).float()
        place = place.clamp(0, PLACES - 1)
        return place[..., None], PRIZES[place.long()].sum(-1)

    def judge(self, hidden):
        """An even policy: nothing of the plan is given away."""
        return torch.zeros((*hidden.shape[:2], 9)), self._value[hidden[..., 0].long()].sum(-1)


ALL_LEGAL = torch.ones(PLACES, 1, 9, dtype=torch.bool)


def test_with_an_exact_model_and_value_it_chooses_as_value_iteration_does():
    roots = torch.arange(PLACES, dtype=torch.float32)[:, None, None]
    found = search(Corridor(), roots, ALL_LEGAL, TreeSettings(simulations=40, gamma=GAMMA), noisy=False)
    for place in range(PLACES):
        worth = [float(PRIZES[moved(place, a)] + GAMMA * EXACT[moved(place, a)]) for a in range(9)]
        chosen = int(found.visits[place].argmax())
        assert worth[chosen] == pytest.approx(max(worth), abs=0.05 * max(worth))
        seen = found.visits[place] > 0
        assert bool((found.q[place][seen] <= torch.tensor(worth)[seen] + 1e-3).all())  # nothing is promised too much
        assert float(found.q[place, chosen]) == pytest.approx(worth[chosen], rel=0.1)


def test_two_uavs_both_go_where_the_prize_is():
    torch.manual_seed(0)
    root = torch.tensor([[[5.0], [4.0]]]).expand(32, -1, -1)  # up for both: 3 + 0 at once, 3 + 3 a slot later
    legal = torch.zeros(32, 2, 9, dtype=torch.bool)
    legal[..., :4] = True
    found = search(Corridor(), root, legal, TreeSettings(96, 48, GAMMA), noisy=False)  # 48 draws of 16 joint actions
    best = found.actions[torch.arange(32), found.visits.argmax(-1)]
    assert (best == 1).float().mean(0).min() > 0.85


def test_drawn_actions_get_their_turn_where_values_tell_hardly_anything_yet():
    settings = TreeSettings(simulations=16, width=16, gamma=GAMMA)
    root = torch.full((8, 2, 1), 3.0)
    torch.manual_seed(0)
    even = Corridor(torch.full((PLACES,), 5.0))
    found = search(even, root, torch.ones(8, 2, 9, dtype=torch.bool), settings, noisy=False)
    assert int((found.visits > 0).sum(-1).min()) >= 5  # "never visited: worth the least" looks at two or three
    assert found.visits.sum(-1).tolist() == [16.0] * 8


def test_noise_keeps_to_legal_actions_and_brings_up_forgotten_ones():
    torch.manual_seed(0)
    legal = torch.ones(4000, 1, 9, dtype=torch.bool)
    legal[..., 4] = False
    logits = torch.full((4000, 1, 9), -20.0)
    logits[..., 1] = 0.0
    noisy = add_noise(logits.masked_fill(~legal, -1e9), legal, TreeSettings(noise_share=0.25)).softmax(-1)[:, 0]
    mean = noisy.mean(0)
    assert mean[4] == 0.0
    assert mean[1] == pytest.approx(0.75 + 0.25 / 8, abs=0.01)
    assert mean[0] == pytest.approx(0.25 / 8, abs=0.01)


@pytest.mark.parametrize("uavs", [1, 2])
def test_what_is_not_legal_at_the_root_is_never_looked_at(uavs):
    torch.manual_seed(0)
    legal = torch.zeros(6, uavs, 9, dtype=torch.bool)
    legal[..., [0, 2]] = True
    found = search(Corridor(), torch.full((6, uavs, 1), 3.0), legal, TreeSettings(12, 8, GAMMA), noisy=True)
    assert set(found.actions[found.visits > 0].flatten().tolist()) <= {0, 2}


def test_close_values_are_not_pulled_apart():
    """After two visits whose values differ by a hundredth of the least spread the prior still decides."""
    tree = _Tree(Corridor(), torch.full((1, 1, 1), 3.0), ALL_LEGAL[:1], TreeSettings(), noisy=False)
    tree._visits[0, 0, :2], tree._total[0, 0, :2] = 1.0, torch.tensor([5.0, 5.0005])
    tree._low, tree._high = torch.tensor([5.0]), torch.tensor([5.0005])
    tree._judged[0, 0] = 5.0
    assert int(tree._pick(torch.tensor([0]))) >= 2
