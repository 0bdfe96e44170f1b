/*
  option.h - shared declarations of option*.c: registered rows, values read so far.
*/
#pragma once
#include "sbbase.h"

#define SB_OPTION_COUNT_MAX 16 /* most numbers or formulas in one option */

#define SB_OPTION_NAME_MAX \
  (3 * SB_NAME_MAX) /* "-" klass "_" instance "_" key, with the terminating zero */

/* A registered row. */
typedef struct {
  const char *klass, *type;
  const SbOption *row;
} SbOptionRow;

/* A value that has been read. */
typedef struct {
  char name[SB_OPTION_NAME_MAX]; /* "-body_liver_young" */
  SbScope scope;
  const SbOption *row;
  PetscBool given; /* given by the user, else `text` is the default */
  char *text;      /* owned */
  char
    want[SB_NAME_MAX]; /* for messages: " in (0, inf) Pa", " in m"; "" without interval and unit */
} SbOptionRecord;

/* An option given by the user, of supple or PETSc. */
typedef struct {
  char *name;  /* name without the dash; owned */
  char *value; /* value; owned; NULL: none */
} SbOptionUser;

typedef struct {
  PetscInt nrow, nrecord, nuser;
  SbOptionRow *row;       /* [nrow] in the order of the manual */
  SbOptionRecord *record; /* [nrecord] in the order of the first reading */
  PetscBool remembered;   /* SbOptionsRemember() has filled `user` */
  SbOptionUser *user;     /* [nuser] */
  PetscInt ninherit;
  SbScope *
    inherit; /* [ninherit] `instance` of `klass` inherits missing values from the instance `type` */
  PetscInt nslot, *slot; /* [nslot] hash table of numbers in `inherit`, -1: free; a power of two */
  PetscInt nlisted;
  char **listed; /* [nlisted] names in the lists of the scenario files, with duplicates; owned */
} SbOptionTable;
extern SbOptionTable SbTheOptions; /* the registry of options */

/* SbOptionFind(), an internal error if there is none. */
PetscErrorCode SbOptionNeed(const SbScope *scope, const char *key, const SbOption **row);
/* Value of an option, given for the instance or for one from which it inherits, and the scope in
   which it is recorded: its own, or that of the original of a copy. */
PetscErrorCode SbOptionFindValue(const SbScope *scope, const char *key, SbScope *where,
                                 const char **value, PetscBool *given);
/* Finds or creates the record of an option by its full name; borrowed. */
PetscErrorCode SbOptionFindRecord(const SbScope *scope, const SbOption *row,
                                  SbOptionRecord **record);
/* Raises the error of a missing required option; the message suggests one that the user has
   misspelt. */
PetscErrorCode SbOptionMissing(const SbOptionRecord *record);
/* All names and values in the database at present. Free with SbOptionUsersFree(). */
PetscErrorCode SbOptionUsersGet(PetscInt *n, SbOptionUser **users);
PetscErrorCode SbOptionUsersFree(PetscInt *n, SbOptionUser **users);
/* Error for a value of one of PETSc's options that PETSc takes and that cannot be meant, among
   those that SbOptionsRemember() has. Not collective. */
PetscErrorCode SbOptionsCheckPetsc(void);
