/* sb.h - everything. */
#pragma once
#include "sbledger.h"
#include "sbscene.h"
