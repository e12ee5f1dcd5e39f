#include "names.h"

#include "../hqp_join.c"
