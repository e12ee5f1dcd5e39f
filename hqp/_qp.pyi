from typing import Any, Final, Self

from .problem import Array
from .solver import Status

INFEASIBLE: Final[int]
UNBOUNDED: Final[int]
ITERATION_CAP: Final[int]
TIME_LIMIT: Final[int]
NOT_PROVEN: Final[int]
NOT_CONVEX: Final[int]
NOT_SYMMETRIC: Final[int]

def is_proven(
    P: Any, q: Any, G: Any, h: Any, A: Any, b: Any, lb: Any, ub: Any, x: Any, multipliers: Array, /
) -> bool: ...

class Solution:
    x: Array
    status: Status
    found: bool
    iterations: int
    objective: float
    conflict: list[tuple[str, int, float]]
    _multipliers: Array | None
    _equalities: int
    _inequalities: int
    @property
    def _ends(self) -> int: ...
    @classmethod
    def solve(
        cls,
        P: Any,
        q: Any,
        G: Any,
        h: Any,
        A: Any,
        b: Any,
        lb: Any,
        ub: Any,
        initvals: Any,
        max_iterations: int,
        time_limit: float,
        solved: Status,
        /,
    ) -> Self: ...
