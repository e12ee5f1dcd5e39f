"""The part of CiA 301 that is used here: identifiers, NMT and AL states, and a few objects.

The application-layer states are EtherCAT's, mapped onto NMT: PREOP is pre-operational; operational
is SAFEOP while the outputs in SYNC are marked not valid, and OP while they are valid.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final

# Identifiers; those of a device are the sum with its node id (predefined connection set).
NMT: Final = 0x000
SYNC: Final = 0x080
EMCY: Final = 0x080
TIME: Final = 0x100
OUTPUT: Final = 0x100  # 0x101, 0x102, ...: output frames that do not fit into SYNC
TPDO: Final = 0x180
SDO_RESPONSE: Final = 0x580
SDO_REQUEST: Final = 0x600
HEARTBEAT: Final = 0x700

MAX_NODE: Final = 127
MAX_OUTPUT_FRAME: Final = 63

Address = tuple[int, int]  # index and sub-index of an object

ERROR_REGISTER: Final = (0x1001, 0)
DEVICE_NAME: Final = (0x1008, 0)
HEARTBEAT_TIME: Final = (0x1017, 0)
VENDOR: Final = (0x1018, 1)
PRODUCT: Final = (0x1018, 2)
REVISION: Final = (0x1018, 3)
SERIAL: Final = (0x1018, 4)
RPDO_MAPPING: Final = 0x1600
TPDO_COB_ID: Final = (0x1800, 1)
TPDO_TRANSMISSION: Final = (0x1800, 2)
TPDO_MAPPING: Final = 0x1A00

# Manufacturer objects that this wire asks of every device
COUNTER_ECHO: Final = (0x2100, 1)
AL_STATE: Final = (0x2100, 2)
# ... and of every device that has outputs
SLOT_FRAME: Final = (0x2101, 1)
SLOT_OFFSET: Final = (0x2101, 2)
OUTPUT_WATCHDOG: Final = (0x2102, 0)

EMCY_RPDO_TIMEOUT: Final = 0x8250


class NmtCommand(IntEnum):
    """First byte of an NMT message; the second is the node, 0 = all."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """The byte of a heartbeat."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


class AlState(IntEnum):
    """The AL state in a TPDO; 0 stands for a device that was never heard."""

    UNKNOWN = 0
    INIT = 1
    PREOP = 2
    SAFEOP = 4
    OP = 8
