"""A simulated gateway to the avatar's neck and base, on the operator's bus."""

from .gateway import BODY_SAYS, PILOT_SAYS, SimGateway


class SimRemoteBody(SimGateway):
    """Tells the avatar where the operator's head is, and what the foot does.

    Attributes:
        way, speed, flags: of the avatar, as reported.
        head, paddle, own_flags: of the operator, as told.
    """

    says_to_peer, hears_of_peer = PILOT_SAYS, BODY_SAYS
