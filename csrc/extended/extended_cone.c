#include "names.h"

#include "../hqp_cone.c"
