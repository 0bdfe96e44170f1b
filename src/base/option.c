/*
  option.c - registry of options: registered rows, values read so far, options given by the user.

  PETSc's database has the texts; this table has their meaning. A row is found by class, type and
  key; the full name is -<class>_<instance>_<key>. Two rows with the same full name (key b_c of body
  a, key c of body a_b) are an error when the second one is read. Names are case-insensitive, as in
  PETSc.
*/
#include "option.h"

SbOptionTable SbTheOptions;
const SbScope SbRunScope = {.klass = ""};

/* Grows an array with n elements of `size` bytes by one; capacity is doubled, for constant
   amortised cost. */
static PetscErrorCode grow(PetscInt n, size_t size, void *array)
{
  PetscFunctionBeginUser;
  if (!(n & (n - 1)))
    PetscCall(PetscRealloc(PetscMax(2 * (size_t)n, 1) * size, (void **)array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsRegister(const char *klass, const char *type, PetscInt n,
                                 const SbOption rows[])
{
  SbOptionRow *r = SbTheOptions.row;
  PetscInt at = -1;

  PetscFunctionBeginUser;
  if (n == PETSC_DECIDE)
    for (n = 0; rows[n].key;)
      n++;

  /* in the order of the manual: at the end of its class, rows of all types before those of one */
  for (PetscInt i = 0; i < SbTheOptions.nrow; i++) {
    if (strcmp(r[i].klass, klass))
      continue;
    if (r[i].row == rows && !strcmp(r[i].type, type))
      PetscFunctionReturn(PETSC_SUCCESS);
    if (type[0] || !r[i].type[0])
      at = i + 1;
    else if (at < 0)
      at = i;
  }
  if (at < 0)
    at = SbTheOptions.nrow;
  PetscCall(PetscRealloc((size_t)(SbTheOptions.nrow + n) * sizeof(*r), &SbTheOptions.row));
  r = SbTheOptions.row + at;
  PetscCall(PetscArraymove(r + n, r, SbTheOptions.nrow - at));
  for (PetscInt i = 0; i < n; i++) {
    PetscCheck(rows[i].count <= SB_OPTION_COUNT_MAX, PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "Option %s has more than %d values", rows[i].key, SB_OPTION_COUNT_MAX);
    r[i] = (SbOptionRow){klass, type, &rows[i]};
  }
  SbTheOptions.nrow += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbScopeSet(SbScope *scope, const char *klass, const char *type, const char *instance)
{
  SbFormat(sizeof(scope->klass), scope->klass, "%s", klass);
  SbFormat(sizeof(scope->type), scope->type, "%s", type);
  SbFormat(sizeof(scope->instance), scope->instance, "%s", instance);
}

const SbOption *SbOptionFind(const SbScope *scope, const char *key)
{
  for (const SbOptionRow *r = SbTheOptions.row; r < SbTheOptions.row + SbTheOptions.nrow; r++)
    if (!strcasecmp(r->row->key, key) && !strcmp(r->klass, scope->klass) &&
        (!r->type[0] || !strcmp(r->type, scope->type)))
      return r->row;
  return NULL;
}

PetscErrorCode SbOptionNeed(const SbScope *scope, const char *key, const SbOption **row)
{
  PetscFunctionBeginUser;
  *row = SbOptionFind(scope, key);
  PetscCheck(*row, PETSC_COMM_SELF, PETSC_ERR_PLIB, "No row for key '%s' of class '%s', type '%s'",
             key, scope->klass, scope->type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbOptionName(const SbScope *scope, const char *key, size_t size, char name[])
{
  SbFormat(size, name, scope->klass[0] ? "-%s_%s_%s" : "-%s%s%s", scope->klass,
           scope->klass[0] ? scope->instance : "", key);
}

PetscErrorCode SbOptionFindRecord(const SbScope *scope, const SbOption *row,
                                  SbOptionRecord **record)
{
  char name[SB_OPTION_NAME_MAX];
  SbOptionRecord *r;

  PetscFunctionBeginUser;
  SbOptionName(scope, row->key, sizeof(name), name);
  for (PetscInt i = 0; i < SbTheOptions.nrecord; i++) {
    r = &SbTheOptions.record[i];
    if (strcasecmp(r->name, name))
      continue;
    PetscCheck(!strcmp(r->row->key, row->key), PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s has two meanings: %s of %s '%s' and %s of %s '%s'; rename one of the two", name,
               r->row->key, r->scope.klass, r->scope.instance, row->key, scope->klass,
               scope->instance);
    *record = r;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(grow(SbTheOptions.nrecord, sizeof(*r), &SbTheOptions.record));
  r = &SbTheOptions.record[SbTheOptions.nrecord++];
  *r = (SbOptionRecord){.scope = *scope, .row = row};
  PetscCall(PetscStrncpy(r->name, name, sizeof(r->name)));
  *record = r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Place of an instance in the hash table of those that inherit; letters of both cases are one. */
static size_t heir_hash(const char *klass, const char *instance)
{
  size_t hash = 5381;

  for (const char *c = klass; *c; c++)
    hash = 33 * hash + (size_t)(*c | 32);
  for (const char *c = instance; *c; c++)
    hash = 33 * hash + (size_t)(*c | 32);
  return hash & (size_t)(SbTheOptions.nslot - 1);
}

/* The scope of an instance that inherits, or NULL. */
static const SbScope *heir_of(const char *klass, const char *instance)
{
  if (!SbTheOptions.nslot)
    return NULL;
  for (size_t at = heir_hash(klass, instance); SbTheOptions.slot[at] >= 0;
       at = (at + 1) & (size_t)(SbTheOptions.nslot - 1)) {
    const SbScope *heir = &SbTheOptions.inherit[SbTheOptions.slot[at]];

    if (!strcmp(heir->klass, klass) && !strcasecmp(heir->instance, instance))
      return heir;
  }
  return NULL;
}

/* Puts number i into the table, which is doubled when it is half full. */
static PetscErrorCode add_heir(PetscInt i)
{
  PetscInt first = i;

  PetscFunctionBeginUser;
  if (2 * SbTheOptions.ninherit > SbTheOptions.nslot) {
    SbTheOptions.nslot = PetscMax(64, 2 * SbTheOptions.nslot);
    PetscCall(PetscFree(SbTheOptions.slot));
    PetscCall(PetscMalloc1(SbTheOptions.nslot, &SbTheOptions.slot));
    for (PetscInt k = 0; k < SbTheOptions.nslot; k++)
      SbTheOptions.slot[k] = -1;
    first = 0;
  }
  for (; first <= i; first++) {
    const SbScope *heir = &SbTheOptions.inherit[first];
    size_t at = heir_hash(heir->klass, heir->instance);

    while (SbTheOptions.slot[at] >= 0)
      at = (at + 1) & (size_t)(SbTheOptions.nslot - 1);
    SbTheOptions.slot[at] = first;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsInherit(const char *klass, const char *instance, const char *from)
{
  PetscFunctionBeginUser;
  if (heir_of(klass, instance))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(grow(SbTheOptions.ninherit, sizeof(*SbTheOptions.inherit), &SbTheOptions.inherit));
  SbScopeSet(&SbTheOptions.inherit[SbTheOptions.ninherit++], klass, from, instance);
  PetscCall(add_heir(SbTheOptions.ninherit - 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionFindValue(const SbScope *scope, const char *key, SbScope *where,
                                 const char **value, PetscBool *given)
{
  char name[SB_OPTION_NAME_MAX];
  const char *unused;
  const SbScope *copy;
  PetscBool there;
  SbScope all;

  PetscFunctionBeginUser;

  /* the instance's own value, or that of the instance it is a copy of */
  *where = *scope;
  SbOptionName(where, key, sizeof(name), name);
  PetscCall(PetscOptionsFindPair(NULL, NULL, name, value, given));
  copy = *given ? NULL : heir_of(scope->klass, scope->instance);
  if (copy) {
    PetscCall(PetscStrncpy(where->instance, copy->type, sizeof(where->instance)));
    SbOptionName(where, key, sizeof(name), name);
    PetscCall(PetscOptionsFindPair(NULL, NULL, name, value, given));
  }

  /* else the value for all bodies, which always counts as read */
  if (strcmp(scope->klass, "body"))
    PetscFunctionReturn(PETSC_SUCCESS);
  SbScopeSet(&all, "body", "", SB_OPTION_DEFAULT);
  SbOptionName(&all, key, sizeof(name), name);
  PetscCall(
    PetscOptionsFindPair(NULL, NULL, name, *given ? &unused : value, *given ? &there : given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionGiven(const SbScope *scope, const char *key, PetscBool *given)
{
  const char *value;
  const SbOption *row;
  SbScope where;

  PetscFunctionBeginUser;
  PetscCall(SbOptionNeed(scope, key, &row));
  PetscCall(SbOptionFindValue(scope, key, &where, &value, given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add_user(PetscInt *n, SbOptionUser **users, const char *name,
                               const char *value)
{
  PetscFunctionBeginUser;
  PetscCall(grow(*n, sizeof(**users), users));
  PetscCall(PetscStrallocpy(name, &(*users)[*n].name));
  PetscCall(PetscStrallocpy(value, &(*users)[*n].value)); /* NULL stays NULL */
  (*n)++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc lists only options that have not been read. Those read are found in a string of all, by
   name. */
PetscErrorCode SbOptionUsersGet(PetscInt *n, SbOptionUser **users)
{
  PetscInt nleft;
  char **names, **values, *all, *rest;

  PetscFunctionBeginUser;
  *n = 0;
  *users = NULL;
  PetscCall(PetscOptionsLeftGet(NULL, &nleft, &names, &values));
  for (PetscInt i = 0; i < nleft; i++)
    PetscCall(add_user(n, users, names[i], values[i]));
  PetscCall(PetscOptionsLeftRestore(NULL, &nleft, &names, &values));
  PetscCall(PetscOptionsGetAll(NULL, &all));
  for (char *token = strtok_r(all, " ", &rest); token; token = strtok_r(NULL, " ", &rest)) {
    PetscBool read = PETSC_FALSE;
    const char *value;

    if (token[0] == '-' && token[1])
      PetscCall(PetscOptionsUsed(NULL, token + 1, &read));
    if (!read)
      continue;
    PetscCall(PetscOptionsFindPair(NULL, NULL, token, &value, &read));
    PetscCall(add_user(n, users, token + 1, value));
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionUsersFree(PetscInt *n, SbOptionUser **users)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < *n; i++) {
    PetscCall(PetscFree((*users)[i].name));
    PetscCall(PetscFree((*users)[i].value));
  }
  PetscCall(PetscFree(*users));
  *n = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsRemember(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionUsersFree(&SbTheOptions.nuser, &SbTheOptions.user));
  PetscCall(SbOptionUsersGet(&SbTheOptions.nuser, &SbTheOptions.user));
  SbTheOptions.remembered = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an option, without its dash, is a list of names: -effects, -body_liver_inclusions. */
static PetscBool is_list(const char *name)
{
  for (const SbOptionRow *r = SbTheOptions.row; r < SbTheOptions.row + SbTheOptions.nrow; r++) {
    const size_t length = strlen(name);
    const size_t prefix = strlen(r->klass);
    const size_t n = strlen(r->row->key);

    if (r->row->kind != SB_OPTION_NAMES || length < n || strcasecmp(name + length - n, r->row->key))
      continue;
    if (prefix ? length > n + prefix && !strncasecmp(name, r->klass, prefix) : length == n)
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscErrorCode SbOptionsFile(MPI_Comm comm, const char *file)
{
  PetscOptions database;
  PetscInt n;
  char **names, **values;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsCreate(&database));
  PetscCall(PetscOptionsInsertFile(comm, database, file, PETSC_TRUE));
  PetscCall(PetscOptionsLeftGet(database, &n, &names, &values));
  for (PetscInt i = 0; i < n; i++) {
    char *text, *rest;

    if (!values[i] || !is_list(names[i]))
      continue;
    PetscCall(PetscStrallocpy(values[i], &text));
    for (char *name = strtok_r(text, ", ", &rest); name; name = strtok_r(NULL, ", ", &rest)) {
      PetscCall(grow(SbTheOptions.nlisted, sizeof(*SbTheOptions.listed), &SbTheOptions.listed));
      PetscCall(PetscStrallocpy(name, &SbTheOptions.listed[SbTheOptions.nlisted++]));
    }
    PetscCall(PetscFree(text));
  }
  PetscCall(PetscOptionsLeftRestore(database, &n, &names, &values));
  PetscCall(PetscOptionsDestroy(&database));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsReset(void)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < SbTheOptions.nrecord; i++)
    PetscCall(PetscFree(SbTheOptions.record[i].text));
  for (PetscInt i = 0; i < SbTheOptions.nlisted; i++)
    PetscCall(PetscFree(SbTheOptions.listed[i]));
  PetscCall(PetscFree(SbTheOptions.record));
  PetscCall(PetscFree(SbTheOptions.row));
  PetscCall(PetscFree(SbTheOptions.listed));
  PetscCall(PetscFree(SbTheOptions.inherit));
  PetscCall(PetscFree(SbTheOptions.slot));
  PetscCall(SbOptionUsersFree(&SbTheOptions.nuser, &SbTheOptions.user));
  SbTheOptions = (SbOptionTable){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}
