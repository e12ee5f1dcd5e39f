"""A simulated gateway to an avatar's arm, on the operator's bus."""

from .gateway import AVATAR_SAYS, OPERATOR_SAYS, SimGateway


class SimRemoteAvatar(SimGateway):
    """Tells the avatar where the operator's palm is.

    Attributes:
        wrench, joints, flags, energy: of the avatar's arm, as reported.
        pose, twist, own_flags, own_energy: of the operator's palm, as told.
    """

    says_to_peer, hears_of_peer = OPERATOR_SAYS, AVATAR_SAYS
