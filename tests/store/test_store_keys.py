"""API keys."""

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcs.store.keys import Keys, Role
from gcs.store.models import KeyRow
from gcs.store.store import Store


def test_a_key_is_known_by_its_text_alone(store: Store) -> None:
    record, text = store.keys.add("ann", Role.OPERATOR)
    verified = store.keys.verify(text)
    assert verified is not None
    assert (verified.id, verified.name, verified.role) == (record.id, "ann", Role.OPERATOR)
    assert store.keys.verify(text[:-1]) is None
    assert store.keys.verify(f"xxx_{text.partition('_')[2]}") is None


@given(st.text(st.characters(), max_size=60))
@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_rubbish_is_no_key(store: Store, text: str) -> None:
    assert store.keys.verify(text) is None
    assert store.keys.verify(f"ucs_{text}") is None
    assert store.keys.verify(f"ucs__{text}") is None


def test_the_secret_is_not_in_the_store(store: Store) -> None:
    _, text = store.keys.add("ann", Role.ADMIN)
    secret = text.split("_", 2)[2]
    with store.engine.connect() as connection:
        rows = connection.execute(KeyRow.__table__.select()).all()
    assert len(rows) == 1
    assert secret not in str(rows)


def test_a_revoked_key_is_refused_at_once_here_and_soon_elsewhere(store: Store) -> None:
    record, text = store.keys.add("ann", Role.VIEWER)
    clock = [0.0]
    elsewhere = Keys(store.engine, lambda: clock[0])
    assert elsewhere.verify(text) is not None
    assert store.keys.revoke(record.id)
    assert not store.keys.revoke(record.id)
    assert store.keys.verify(text) is None
    assert not store.keys.any_active()
    clock[0] = 6.0
    assert elsewhere.verify(text) is None
    assert [key.revoked_at is not None for key in store.keys.all()] == [True]


def test_roles_include_the_lower_ones() -> None:
    allowed = {(role, needed) for role in Role for needed in Role if role.allows(needed)}
    assert allowed == {
        (Role.REPORTER, Role.REPORTER),
        (Role.VIEWER, Role.VIEWER),
        (Role.OPERATOR, Role.REPORTER),
        (Role.OPERATOR, Role.VIEWER),
        (Role.OPERATOR, Role.OPERATOR),
        (Role.ADMIN, Role.REPORTER),
        (Role.ADMIN, Role.VIEWER),
        (Role.ADMIN, Role.OPERATOR),
        (Role.ADMIN, Role.ADMIN),
    }
