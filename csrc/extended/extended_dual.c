#include "names.h"

#include "../hqp_dual.c"
