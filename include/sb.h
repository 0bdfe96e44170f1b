/* sb.h - everything. */
#pragma once
#include "sbestimate.h"
#include "sbscene.h"
