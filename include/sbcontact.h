/*
  sbcontact.h - layer 5: contact.
*/
#pragma once
#include "sbeffect.h"

extern const SbEffectType SbEffectContact;
