"""A simulated gateway to an operator's arm, on the avatar's bus."""

from .gateway import AVATAR_SAYS, OPERATOR_SAYS, SimGateway


class SimRemoteOperator(SimGateway):
    """Tells the operator's station what the avatar's arm feels.

    Attributes:
        pose, twist, flags, energy: of the operator's palm, as reported.
        wrench, joints, own_flags, own_energy: of the avatar's arm, as told.
    """

    says_to_peer, hears_of_peer = AVATAR_SAYS, OPERATOR_SAYS
