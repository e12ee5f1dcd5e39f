#include "names.h"

#include "../hqp_set.c"
