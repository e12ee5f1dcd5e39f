"""What is copied side by side."""

import numpy as np
import pytest
from hapticd.binding import BindError
from hapticd.control.copies import Copies


def test_every_part_is_where_it_is_read_to_the_bit() -> None:
    first, second, both = np.zeros(2), np.zeros(3), np.full(6, 7.0)
    copies = Copies(((first, both[:2]), (second, both[2:5])))
    first[:], second[:] = (1.0, np.nan), (-0.0, np.inf, 5e-324)
    copies.update()
    assert both.tobytes() == np.array([*first, *second, 7.0]).tobytes()


def test_parts_of_another_size_and_targets_that_must_not_be_written_are_refused() -> None:
    with pytest.raises(BindError, match=r"copies_part\.to has shape \(3,\)"):
        Copies(((np.zeros(2), np.zeros(3)),))
    target = np.zeros(2)
    target.flags.writeable = False
    with pytest.raises(BindError, match="read-only"):
        Copies(((np.zeros(2), target),))
