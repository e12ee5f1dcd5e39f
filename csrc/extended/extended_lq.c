#include "names.h"

#include "../hqp_lq.c"
