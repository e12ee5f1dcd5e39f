#include "names.h"

#include "../hqp_fix.c"
