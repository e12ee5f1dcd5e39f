#include "names.h"

#include "../hqp_tries.c"
