#include "names.h"

#include "../hqp_clash.c"
