#include "names.h"

#include "../hqp.c"
