"""What a quadratic program has for an answer."""

from typing import Any

from ._qp import Solution
from .problem import Array, HqpError
from .solver import Status


class UnboundedError(HqpError):
    """The objective falls for ever along `ray`, (n,), inside the constraints."""

    def __init__(self, ray: Array) -> None:
        super().__init__(
            "objective",
            "is unbounded below: P ray = 0, q ray < 0 and no constraint ends the ray",
            "bound x along the ray that this error carries, or correct the sign of q",
        )
        self.args = (ray,)
        self.ray = ray


class QpSolution(Solution):
    """What solve_qp found.

    P x + q + A^T y + G^T z + z_box = 0 with z >= 0, and z_box > 0 at ub, < 0 at lb.

    Attributes:
        x: (n,).
        status: SOLVED: x is proven optimal, or, if `found` is False, proven to break the constraints least:
            the sum of squares of its distances to them is.
        found: x is optimal and meets the constraints.
        iterations: rows added to the working set and released.
        objective: 1/2 x^T P x + q^T x; NaN where the constraints contradict each other.
        conflict: where the constraints contradict each other, the rows at fault, the worst first:
            ("A" | "G" | "box", row, multiplier). With these multipliers the rows add up to 0 x < 0.
    """

    __slots__ = ()

    def __init__(
        self,
        x: Array,
        status: Status,
        found: bool,
        iterations: int,
        objective: float,
        conflict: list[tuple[str, int, float]],
        multipliers: Array | None,  # y, z, z_box
        equalities: int,
        inequalities: int,
    ) -> None:
        self.x = x
        self.status = status
        self.found = found
        self.iterations = iterations
        self.objective = objective
        self.conflict = conflict
        self._multipliers = multipliers
        self._equalities = equalities
        self._inequalities = inequalities

    def __reduce__(self) -> tuple[Any, ...]:
        parts = (self.x, self.status, self.found, self.iterations, self.objective, self.conflict)
        return type(self), (*parts, self._multipliers, self._equalities, self._inequalities)

    def __repr__(self) -> str:
        return (
            f"QpSolution(x={self.x!r}, status={self.status!r}, found={self.found},"
            f" iterations={self.iterations}, objective={self.objective}, conflict={self.conflict})"
        )

    @property
    def y(self) -> Array:
        """Multipliers of A x = b, (rows of A,)."""
        return self._known()[: self._equalities]

    @property
    def z(self) -> Array:
        """Multipliers of G x <= h, (rows of G,)."""
        return self._known()[self._equalities : self._equalities + self._inequalities]

    @property
    def z_box(self) -> Array:
        """Multipliers of lb <= x <= ub, (n,)."""
        return self._known()[self._equalities + self._inequalities :]

    def _known(self) -> Array:
        if self._multipliers is None:
            raise HqpError("multipliers", "do not exist: the QP is not solved", "look at status and conflict")
        return self._multipliers
