"""Keys of a session."""

from hapticd.link.agreement import session_keys
from hapticd.link.stations import Role, Station

ALICE, ROBOT = Station("alice", Role.OPERATOR), Station("robot", Role.AVATAR)
ONE, TWO = bytes(32), bytes(range(32))


def test_keys_depend_on_both_secrets_the_session_and_both_stations() -> None:
    """Whose random numbers repeat does not repeat a key as long as the other's do not."""
    made = [
        session_keys(7, ONE, TWO, ALICE, ROBOT),
        session_keys(8, ONE, TWO, ALICE, ROBOT),
        session_keys(7, TWO, TWO, ALICE, ROBOT),
        session_keys(7, ONE, ONE, ALICE, ROBOT),
        session_keys(7, ONE, TWO, Station("bob", Role.OPERATOR), ROBOT),
        session_keys(7, ONE, TWO, ALICE, Station("other", Role.AVATAR)),
    ]
    found = {key for keys in made for key in (keys.to_avatar, keys.to_operator)}
    assert len(found) == 2 * len(made)
    assert session_keys(7, ONE, TWO, ALICE, ROBOT) == made[0]
