/* sb.h - everything. */
#pragma once
#include "sbledger.h"
#include "sbnewton.h"
#include "sbremesh.h"
#include "sbscene.h"
