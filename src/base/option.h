/*
  option.h - what the option files of layer 0 share: the registered rows, and the values read so far.
*/
#pragma once
#include "sbbase.h"

#define SB_OPTION_NAME_MAX (3 * SB_NAME_MAX) /* "-" klass "_" instance "_" key, with the terminating zero */

/* Rows registered by one call. */
typedef struct {
  char klass[SB_NAME_MAX];
  char type[SB_NAME_MAX];
  PetscInt n;
  const SbOption *rows; /* [n] borrowed, static */
} SbOptionBlock;

/* A value that was read. */
typedef struct {
  char name[SB_OPTION_NAME_MAX]; /* "-body_liver_young" */
  SbScope scope;
  const SbOption *row;
  PetscBool given; /* by the user, else `text` is the preset */
  char *text;      /* owned */
} SbOptionRecord;

/* An option of the user's, ours or PETSc's. */
typedef struct {
  char *name;  /* without the dash; owned */
  char *value; /* owned; NULL when there is none */
} SbOptionUser;

typedef struct {
  PetscBool at_end; /* freed in PetscFinalize() */
  PetscInt nblock, nrecord, nuser;
  SbOptionBlock *block;   /* [nblock] in the order of registration */
  SbOptionRecord *record; /* [nrecord] in the order of the first reading */
  PetscBool remembered;   /* SbOptionsRemember() filled `user` */
  SbOptionUser *user;     /* [nuser] */
  PetscInt ninherit;
  SbScope *inherit; /* [ninherit] `instance` of `klass` takes what it is not given from the instance `type` */
  PetscInt nlisted;
  char **listed; /* [nlisted] names in the lists of the scenario files, with repeats; owned */
} SbOptionTable;
extern SbOptionTable SbTheOptions; /* the registry of options */

/* The row of a key in a scope; NULL when there is none. */
const SbOption *SbOptionFind(const SbScope *scope, const char *key);
/* Whether something has read the option of this full name, without its dash. */
PetscBool SbOptionIsRead(const char *name);
/* The text of an option, given for the instance or for what it inherits from, and the scope under which it is recorded: its own, or that of what it is a copy of. */
PetscErrorCode SbOptionFindValue(const SbScope *scope, const char *key, SbScope *where, const char **value,
                                 PetscBool *given);
/* The record of an option, by its full name; made when there is none yet. Lent. */
PetscErrorCode SbOptionFindRecord(const SbScope *scope, const SbOption *row, SbOptionRecord **record);
/* The error that a required option is missing; names a misspelt option of the user, if there is one. */
PetscErrorCode SbOptionMissing(const SbOptionRecord *record);
/* The database as it is now: every name and value. Free with SbOptionUsersFree(). */
PetscErrorCode SbOptionUsersGet(PetscInt *n, SbOptionUser **users);
PetscErrorCode SbOptionUsersFree(PetscInt *n, SbOptionUser **users);
/* Name as in the manual: "-body_<name>_young", "-ts_dt". */
PetscErrorCode SbOptionManualName(const SbOptionBlock *block, const SbOption *row, size_t size, char name[]);
