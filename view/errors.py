"""What can be wrong with a dashboard that is asked for."""

from ..runtime.errors import HapticdError


class ViewError(HapticdError):
    """The dashboard cannot be served as asked."""

    code = "view"
    exit_status = 2
