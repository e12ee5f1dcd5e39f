"""A simulated gateway to the operator's head and foot, on the avatar's bus."""

from .gateway import BODY_SAYS, PILOT_SAYS, SimGateway


class SimRemotePilot(SimGateway):
    """Tells the operator's station what neck and base do.

    Attributes:
        head, paddle, flags: of the operator, as reported.
        way, speed, own_flags: of the avatar, as told.
    """

    says_to_peer, hears_of_peer = BODY_SAYS, PILOT_SAYS
