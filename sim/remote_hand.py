"""A simulated gateway to a hand of the avatar, on the operator's bus."""

from .gateway import GLOVE_SAYS, HAND_SAYS, SimGateway


class SimRemoteHand(SimGateway):
    """Tells the avatar what a glove measures.

    Attributes:
        current, flags: of the avatar's hand, as reported.
        angle, own_flags: of the operator's glove, as told.
    """

    says_to_peer, hears_of_peer = GLOVE_SAYS, HAND_SAYS
