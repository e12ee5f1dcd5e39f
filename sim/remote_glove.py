"""A simulated gateway to a glove of the operator, on the avatar's bus."""

from .gateway import GLOVE_SAYS, HAND_SAYS, SimGateway


class SimRemoteGlove(SimGateway):
    """Tells the operator's station what a hand's motors take.

    Attributes:
        angle, flags: of the operator's glove, as reported.
        current, own_flags: of the avatar's hand, as told.
    """

    says_to_peer, hears_of_peer = HAND_SAYS, GLOVE_SAYS
