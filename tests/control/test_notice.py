"""One word for each intervention, however it trembles."""

from __future__ import annotations

import pytest
from hapticd.control.notice import Notice


def test_what_trembles_is_said_once_and_again_only_after_it_was_gone() -> None:
    notice = Notice(1.0, 0.3, 5)
    said = [notice.update(x) for x in (0.9, 1.0, 0.2, 1.5, 0.1, 0.1, 2.0)]
    assert said == [False, True, False, False, False, False, False]
    assert not any(notice.update(0.2) for _ in range(5)) and not notice.on
    assert notice.update(1.0)


def test_an_end_above_the_beginning_is_refused() -> None:
    with pytest.raises(ValueError, match="within"):
        Notice(1.0, 2.0, 5)
