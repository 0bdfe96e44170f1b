/* sb.h - everything. */
#pragma once
#include "sbscene.h"
