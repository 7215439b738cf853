"""Eq. 11 against its own words: rows of C sum to one, who is absent counts for nothing, order does not matter."""

import numpy as np
import pytest
import torch
from tests_model_states import random_features

from policy.model.features import Features
from policy.model.network import GcrlNetwork, Outputs
from policy.model.rgcn import Relations
from policy.model.spec import SIMILARITIES, ModelSpec


def run(network: GcrlNetwork, features: Features) -> Outputs:
    action = np.zeros((*features.uav.shape[:2], 1, 2), dtype=np.float32)
    arrays = (features.uav, features.user, features.uav_mask, features.user_mask, action)
    with torch.no_grad():
        return network(*(torch.from_numpy(array) for array in arrays))


@pytest.mark.parametrize("similarity", SIMILARITIES)
def test_each_row_of_relations_is_a_share(similarity: str) -> None:
    torch.manual_seed(0)
    nodes, mask = torch.randn(2, 6, 32), torch.ones(2, 6)
    mask[:, 4:] = 0.0
    shares = Relations(ModelSpec(similarity=similarity))(nodes, mask)
    assert torch.all(shares >= 0.0)
    torch.testing.assert_close(shares.sum(dim=-1), torch.ones(2, 6), rtol=0, atol=1e-4)
    assert torch.all(shares[..., 4:] == 0.0)


def test_embedded_gaussian_by_hand() -> None:
    """softmax of (W_i z_i) . (W_j z_j), scaled by 1 / sqrt(D)."""
    torch.manual_seed(1)
    relations = Relations(ModelSpec(width=4))
    nodes = torch.randn(1, 3, 4)
    query, key = nodes[0] @ relations.query.weight.T, nodes[0] @ relations.key.weight.T
    raw = np.exp((query @ key.T).detach().numpy() / 2.0)
    expected = raw / raw.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(relations(nodes, torch.ones(1, 3))[0].detach().numpy(), expected, rtol=1e-5)


@pytest.mark.parametrize("spec", [ModelSpec(), ModelSpec(similarity="cosine"), ModelSpec(use_rgcn=False)])
def test_the_absent_change_nothing(spec: ModelSpec) -> None:
    torch.manual_seed(2)
    network = GcrlNetwork(spec)
    features = random_features(np.random.default_rng(0), batch=2, uavs=2, users=6)
    padded = Features(
        uav=np.concatenate((features.uav, np.full((2, 1, features.uav.shape[2]), 3.0, dtype=np.float32)), axis=1),
        user=np.concatenate((features.user, np.full((2, 4, features.user.shape[2]), 9.0, dtype=np.float32)), axis=1),
        uav_mask=np.concatenate((features.uav_mask, np.zeros((2, 1), dtype=np.float32)), axis=1),
        user_mask=np.concatenate((features.user_mask, np.zeros((2, 4), dtype=np.float32)), axis=1),
    )
    few, more = run(network, features), run(network, padded)
    present = features.user_mask.astype(bool)
    for name in ("user_cost_slots", "user_next"):
        torch.testing.assert_close(getattr(more, name)[:, :6][present], getattr(few, name)[present], atol=1e-5, rtol=0)
    torch.testing.assert_close(more.uav_next[:, :2], few.uav_next, atol=1e-5, rtol=0)


def test_the_order_of_users_does_not_matter() -> None:
    torch.manual_seed(3)
    network = GcrlNetwork(ModelSpec())
    features = random_features(np.random.default_rng(4), batch=1, uavs=3, users=5)
    order = np.array([3, 0, 4, 1, 2])
    shuffled = Features(features.uav, features.user[:, order], features.uav_mask, features.user_mask[:, order])
    torch.testing.assert_close(
        run(network, shuffled).user_cost_slots, run(network, features).user_cost_slots[:, order], atol=1e-5, rtol=0
    )


def test_without_rgcn_a_uav_elsewhere_leaves_predictions_alone() -> None:
    """The ablation: no messages, so a user's own prediction depends on its own features only."""
    torch.manual_seed(4)
    features = random_features(np.random.default_rng(5), batch=1, uavs=2, users=4)
    moved = Features(features.uav + 1.0, features.user, features.uav_mask, features.user_mask)
    for use_rgcn in (True, False):
        network = GcrlNetwork(ModelSpec(use_rgcn=use_rgcn))
        same = torch.equal(run(network, features).user_next, run(network, moved).user_next)
        assert same is not use_rgcn


def test_a_user_costs_at_least_one_slot_of_age() -> None:
    torch.manual_seed(5)
    network = GcrlNetwork(ModelSpec())
    for seed in range(5):
        heads = run(network, random_features(np.random.default_rng(seed), batch=4, uavs=2, users=9))
        assert torch.all(heads.user_cost_slots >= 1.0)


def test_a_uav_flies_as_commanded_but_for_what_is_learned() -> None:
    torch.manual_seed(6)
    network = GcrlNetwork(ModelSpec())
    torch.nn.init.zeros_(network.predict_uav[-1].weight)
    features = random_features(np.random.default_rng(0), batch=2, uavs=2, users=6)
    action = torch.rand(2, 2, 4, 2)
    arrays = (features.uav, features.user, features.uav_mask, features.user_mask)
    heads: Outputs = network(*(torch.from_numpy(array) for array in arrays), action)
    torch.testing.assert_close(heads.uav_next[..., :2], action)
    assert torch.all(heads.uav_next[..., 2] == 0.0)
