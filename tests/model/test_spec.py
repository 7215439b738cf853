import pytest

from policy.model.spec import ModelSpec


def test_json_and_back() -> None:
    spec = ModelSpec(width=16, layers=1, similarity="square", use_rgcn=False)
    assert ModelSpec.from_json(spec.to_json()) == spec


@pytest.mark.parametrize(
    "change", [{"similarity": "dot"}, {"width": 0}, {"layers": -1}, {"gamma": 1.0}, {"extra": 1}, {"width": "32"}]
)
def test_what_is_no_network_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError):
        ModelSpec.from_json({**ModelSpec().to_json(), **change})
