#include "names.h"

#include "../hqp_sweep.c"
