/*
  parts.h - test scenes, one for each effect, element, material, integrator, field, other output and
  estimator of the program.

  The lists come from the program's registries; the table below has the options that name each one
  in the scene. The test of unused features (tests/verify/verify_unnamed.c) and the cost table
  (tests/perf/effect_cost.c) loop over both, so that a new type fails the test until it has a row
  here.
*/
#pragma once
#include "../src/time/time_impl.h"
#include "../src/effect/effect_impl.h"
#include "../src/output/output_impl.h"
#include "../src/base/option.h"
#include "scene.h"

#define PART_TEXT 4096 /* longest scenario, characters */
#define PART_STEPS "8" /* steps of every run */

/* A soft bar along x that rotates about its centre; one linear solve per step. Its sets are used by
   the parts only. */
#define PART_SCENE                                                                               \
  "-bodies bar -body_bar_mesh %s -body_bar_material corotated -body_bar_young 5e4 "              \
  "-body_bar_poisson 0.4 "                                                                       \
  "-body_bar_density 1000 -body_bar_angular_velocity 0,2,0 -sets end,tip,skin -set_end_at "      \
  "plane:1,0,0,0 "                                                                               \
  "-set_tip_at plane:1,0,0,0.4 -set_skin_at body:bar -snes_type ksponly -ksp_rtol 1e-4 -solver " \
  "cg_icc "                                                                                      \
  "-output_fields none -output_history false -progress false "
#define PART_TIME \
  "-time euler_implicit -ts_dt 0.0166666666666666667 -ts_max_time 0.13333333333333333 "
/* A block at the end of the bar. */
#define PART_BLOCK                                                                      \
  "-bodies bar,block -body_block_mesh box:0.1,0.1,0.1:1 -body_block_translate 0.4,0,0 " \
  "-body_block_material corotated -body_block_young 5e4 -body_block_poisson 0.4 "       \
  "-body_block_density 1000 -set_skin_at body:block "
/* A hollow box beside the bar. */
#define PART_HOLLOW                                                                   \
  "-bodies bar,box -body_box_mesh tests/data/hollow.msh -body_box_translate 0,0.2,0 " \
  "-body_box_material corotated -body_box_young 5e4 -body_box_poisson 0.4 "           \
  "-body_box_density 1000 -sets end,tip,skin,hole -set_hole_at "                      \
  "box:0.03,0.23,0.03,0.07,0.27,0.07 "
/* A plane below the end of the bar, which it hits. */
#define PART_FLOOR                                                                               \
  "-effects floor -effect_floor_type contact -effect_floor_response projected -effect_floor_on " \
  "skin "                                                                                        \
  "-effect_floor_obstacle plane:0,0,1,-1e-4 "
/* Incomplete Cholesky breaks down with DG. */
#define PART_ELEMENT "-solver cg_two_level "

typedef struct {
  const char *family, *name;
  const char *options; /* options that name the part; "": the scene does */
  const char *scene;   /* further options that it needs, also in the run without it; NULL: none */
  const char
    *events; /* log events that it begins, comma-separated; NULL: one of its family and name */
  PetscBool
    apart; /* it can be restricted to one of two bodies, and works with explicit integrators */
} Part;

static const Part parts[] = {
  {"effect", "gravity", "-effects gravity", NULL, NULL, PETSC_FALSE}, /* acts on all bodies */
  {"effect", "body_force",
   "-effects push -effect_push_type body_force -effect_push_on skin -effect_push_density 0;0;-9810",
   NULL, NULL, PETSC_TRUE},
  {"effect", "traction",
   "-effects pull -effect_pull_type traction -effect_pull_on tip -effect_pull_vector 0;0;100", NULL,
   NULL, PETSC_TRUE},
  {"effect", "pressure",
   "-effects air -effect_air_type pressure -effect_air_on skin -effect_air_value 100", NULL, NULL,
   PETSC_TRUE},
  {"effect", "cavity",
   "-effects air -effect_air_type cavity -effect_air_on hole -effect_air_added 1e-6*t "
   "-effect_air_modulus 101325",
   PART_HOLLOW, NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "foundation",
   "-effects bed -effect_bed_type foundation -effect_bed_on tip -effect_bed_stiffness 1e4", NULL,
   NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "frame", "-effects ride -effect_ride_type frame -effect_ride_acceleration 1;0;0", NULL,
   NULL, PETSC_FALSE}, /* acts on all bodies */
  {"effect", "water",
   "-effects sea -effect_sea_type water -effect_sea_on skin -effect_sea_level 0.05 "
   "-effect_sea_gravity 0,0,-9.81",
   NULL, NULL, PETSC_TRUE},
  {"effect", "mass", "-effects load -effect_load_type mass -effect_load_on tip -effect_load_mass 1",
   NULL, NULL, PETSC_TRUE},
  {"effect", "membrane",
   "-effects coat -effect_coat_type membrane -effect_coat_on skin -effect_coat_tension 1", NULL,
   NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "tie", "-effects glue -effect_glue_type tie -effect_glue_on tip -effect_glue_to skin",
   PART_BLOCK, NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "periodic", "-effects cell -effect_cell_type periodic -effect_cell_on skin", NULL,
   NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "joint",
   "-effects hip -effect_hip_type joint -effect_hip_on bar -effect_hip_radius 0.1 -effect_hip_at "
   "0.4,0.05,0.05 -effect_hip_kind ball",
   NULL, NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "spring",
   "-effects line -effect_line_type spring -effect_line_points "
   "0.4,0.05,0.05;ground:0.4,0.05,0.5 -effect_line_stiffness 100",
   NULL, NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "cable",
   "-effects line -effect_line_type cable -effect_line_points "
   "0.1,0.05,0.05;0.3,0.05,0.05;ground:0.4,0.05,0.5 -effect_line_tension 1",
   NULL, NULL, PETSC_FALSE}, /* implicit only */
  {"effect", "point_force",
   "-effects pull -effect_pull_type point_force -effect_pull_on tip -effect_pull_vector 0;0;1",
   NULL, NULL, PETSC_TRUE},
  {"effect", "torque", "-effects twist -effect_twist_type torque -effect_twist_vector 0.01;0;0",
   NULL, NULL, PETSC_FALSE},
  {"effect", "fixed", "-effects clamp -effect_clamp_type fixed -effect_clamp_on end", NULL, NULL,
   PETSC_TRUE},
  {"effect", "prescribed_displacement",
   "-effects turn -effect_turn_type prescribed_displacement -effect_turn_on end -effect_turn_angle "
   "100*t "
   "-effect_turn_axis 1,0,0 -effect_turn_axis_point 0,0.05,0.05",
   NULL, NULL, PETSC_TRUE},
  {"effect", "damping",
   "-effects thick -effect_thick_type damping -effect_thick_on bar -effect_thick_alpha 1 "
   "-effect_thick_beta 0.001",
   NULL, NULL, PETSC_TRUE},
  {"effect", "contact", PART_FLOOR, NULL, NULL, PETSC_FALSE}, /* implicit only */
  {"element", "p1", "", NULL, NULL, PETSC_FALSE},
  {"element", "p2", "-body_bar_element p2", PART_ELEMENT, NULL, PETSC_TRUE},
  {"element", "cr", "-body_bar_element cr", PART_ELEMENT, NULL, PETSC_TRUE},
  {"element", "dg", "-body_bar_element dg", PART_ELEMENT, NULL, PETSC_TRUE},
  {"material", "linear", "-body_bar_material linear", NULL, NULL, PETSC_TRUE},
  {"material", "corotated", "", NULL, NULL, PETSC_FALSE},
  {"material", "stvk", "-body_bar_material stvk", NULL, NULL, PETSC_TRUE},
  {"material", "neohookean", "-body_bar_material neohookean", NULL, NULL, PETSC_TRUE},
  {"material", "isochoric_neohookean", "-body_bar_material isochoric_neohookean", NULL, NULL,
   PETSC_TRUE},
  {"material", "stable_neohookean", "-body_bar_material stable_neohookean", NULL, NULL, PETSC_TRUE},
  {"material", "holmes_mow", "-body_bar_material holmes_mow -body_bar_beta 0.5", NULL, NULL,
   PETSC_TRUE},
  {"material", "mooney_rivlin",
   "-body_bar_material mooney_rivlin -body_bar_c10 7e3 -body_bar_c01 2e3", NULL, NULL, PETSC_TRUE},
  {"material", "yeoh", "-body_bar_material yeoh -body_bar_c1 9e3 -body_bar_c2 -200 -body_bar_c3 10",
   NULL, NULL, PETSC_TRUE},
  {"material", "ogden",
   "-body_bar_material ogden -body_bar_mu 2.6e4,50,-400 -body_bar_alpha 1.3,5,-2", NULL, NULL,
   PETSC_TRUE},
  {"material", "gent", "-body_bar_material gent -body_bar_mu 1.8e4 -body_bar_jm 60", NULL, NULL,
   PETSC_TRUE},
  {"material", "arruda_boyce",
   "-body_bar_material arruda_boyce -body_bar_mu 1.7e4 -body_bar_lambda_m 3", NULL, NULL,
   PETSC_TRUE},
  {"material", "transversely_isotropic",
   "-body_bar_material transversely_isotropic -body_bar_mu 1.5e4 -body_bar_mu_fibre 2e4 "
   "-body_bar_young_fibre 1e5",
   NULL, NULL, PETSC_TRUE},
  {"material", "holzapfel_gasser_ogden",
   "-body_bar_material holzapfel_gasser_ogden -body_bar_mu 1.8e4 -body_bar_k1 1e4 -body_bar_k2 2 "
   "-body_bar_angles 30,-30 -body_bar_sheet 0,1,0",
   NULL, NULL, PETSC_TRUE},
  {"material", "guccione",
   "-body_bar_material guccione -body_bar_c 1e4 -body_bar_bf 8 -body_bar_bt 2 -body_bar_bfs 4",
   NULL, NULL, PETSC_TRUE},
  {"material", "holzapfel_ogden",
   "-body_bar_material holzapfel_ogden -body_bar_a 1.8e4 -body_bar_b 2 -body_bar_a_f 2e4 "
   "-body_bar_b_f 3",
   NULL, NULL, PETSC_TRUE},
  {"time", "euler_implicit", "", NULL, "", PETSC_FALSE},
  {"time", "newmark", "-time newmark", NULL, "", PETSC_FALSE},
  {"time", "genalpha", "-time genalpha", NULL, "", PETSC_FALSE},
  {"time", "euler_symplectic", "-time euler_symplectic -ts_dt 1e-4 -ts_max_time 8e-4", NULL, "",
   PETSC_FALSE},
  {"time", "euler_explicit", "-time euler_explicit -ts_dt 1e-4 -ts_max_time 8e-4", NULL, "",
   PETSC_FALSE},
  {"time", "alpha2", "-time alpha2", NULL, "", PETSC_FALSE},
  {"time", "static", "-time static -static_steps " PART_STEPS,
   "-effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on end ", "", PETSC_FALSE},
  {"output", "fields", "-output_fields position,displacement,velocity,von_mises", NULL,
   "SbOut_fields,SbField_position,SbField_displacement,SbField_velocity,SbField_von_mises,SbField_"
   "body",
   PETSC_FALSE},
  {"output", "contacts", "-output_contacts true", PART_FLOOR "-output_fields displacement ", NULL,
   PETSC_FALSE},
  {"output", "history", "-output_history true", NULL, NULL, PETSC_FALSE},
  {"output", "probes", "-probes tip -probe_tip_at 0.4,0.05,0.05", "-output_history true ", NULL,
   PETSC_FALSE},
  {"output", "checkpoint", "-checkpoint_every_steps 1", NULL, NULL, PETSC_FALSE},
  {"output", "progress", "-progress true", NULL, NULL, PETSC_FALSE},
  {"estimator", "ledger", "-ledger true", NULL, NULL, PETSC_FALSE},
  {"remesh", "remesh", "-remesh_quality 1e-6", NULL, NULL,
   PETSC_FALSE}, /* enabled, but never necessary */
};

/* Output options that belong to a part above: the one that each names, or modifies. */
static const struct {
  const char *key, *part;
} part_options[] = {
  {"output_fields", "fields"},
  {"output_every", "fields"},
  {"output_every_steps", "fields"},
  {"output_precision", "fields"},
  {"output_discontinuous", "fields"},
  {"output_quadratic", "fields"},
  {"output_contacts", "contacts"},
  {"output_history", "history"},
  {"output_history_every", "history"},
  {"output_history_bodies", "history"},
  {"probes", "probes"},
  {"checkpoint_every_time", "checkpoint"},
  {"checkpoint_every_steps", "checkpoint"},
  {"checkpoint_keep", "checkpoint"},
  {"restart", "checkpoint"},
  {"progress", "progress"},
  {"quiet", "progress"},
  {"output_dir", ""},
  {"output_overwrite", ""},
  {"show", ""},
};

/* Families, and prefixes of their log events; NULL: none. */
static const struct {
  const char *name, *kind;
} part_families[] = {
  {"effect", "Eff"},  {"element", "Elem"}, {"material", "Mat"},  {"time", NULL},
  {"field", "Field"}, {"output", "Out"},   {"estimator", "Est"}, {"remesh", "Mesh"},
};
#define PART_NAMES 64 /* largest number of names in a family */

/* Rows of the output in the option table: the n rows registered with output_dir. */
static inline const SbOptionRow *part_output_rows(PetscInt *n)
{
  const SbOptionRow *first = SbTheOptions.row;

  while (first->row != SbOutputRows)
    first++;
  for (*n = 0; SbOutputRows[*n].key;)
    (*n)++;
  return first;
}

/*
  part_names - all names of a family, from the registry of the program; those of "output" from the
  rows above. Not collective; after SbRegisterAll().
*/
static inline PetscErrorCode part_names(const char *family, PetscInt *n,
                                        char names[PART_NAMES][SB_NAME_MAX])
{
  PetscFunctionBeginUser;
  *n = 0;
  if (!strcmp(family, "effect")) {
    const char *types[SB_EFFECT_TYPES];

    *n = SbEffectTypes(types);
    for (PetscInt i = 0; i < *n; i++)
      PetscCall(PetscStrncpy(names[i], types[i], SB_NAME_MAX));
  } else if (!strcmp(family, "element")) {
    const char *types[SB_ELEMENT_TYPES];

    *n = SbElementTypes(types);
    for (PetscInt i = 0; i < *n; i++)
      PetscCall(PetscStrncpy(names[i], types[i], SB_NAME_MAX));
  } else if (!strcmp(family, "material")) {
    const char *types[SB_MATERIAL_TYPES];

    *n = SbMaterialTypes(types);
    for (PetscInt i = 0; i < *n; i++)
      PetscCall(PetscStrncpy(names[i], types[i], SB_NAME_MAX));
  } else if (!strcmp(family, "time")) {
    char **words;
    int count;

    PetscCall(PetscStrToArray(SbIntegrators, '|', &count, &words));
    for (int i = 0; i < count; i++)
      PetscCall(PetscStrncpy(names[(*n)++], words[i], SB_NAME_MAX));
    PetscCall(PetscStrToArrayDestroy(count, words));
  } else if (!strcmp(family, "field")) {
    PetscInt count;
    const SbField *field = SbFieldGetAll(&count);

    for (PetscInt i = 0; i < count; i++)
      PetscCall(PetscStrncpy(names[(*n)++], field[i].name, SB_NAME_MAX));
  } else {
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(parts); i++)
      if (!strcmp(parts[i].family, family))
        PetscCall(PetscStrncpy(names[(*n)++], parts[i].name, SB_NAME_MAX));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Row of a name; fields need none. `part` has borrowed pointers that are valid until the next call.
   Not collective. */
static inline PetscErrorCode part_find(const char *family, const char *name, Part *part,
                                       PetscBool *found)
{
  static char options[2 * SB_NAME_MAX], events[4 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  *found = PETSC_FALSE;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(parts) && !*found; i++) {
    if (strcmp(parts[i].family, family) || strcmp(parts[i].name, name))
      continue;
    *part = parts[i];
    *found = PETSC_TRUE;
  }
  if (!strcmp(family, "field")) {
    PetscCall(PetscSNPrintf(options, sizeof(options), "-output_fields %s%s", name,
                            strcmp(name, "space_error") ? "" : " -ledger true"));
    PetscCall(PetscSNPrintf(events, sizeof(events), "SbOut_fields,SbField_body,SbField_%s%s", name,
                            strcmp(name, "space_error") ? "" : ",SbEst_ledger"));
    *part = (Part){family, name, options, NULL, events, PETSC_FALSE};
    *found = PETSC_TRUE;
  } else if (*found && !part->events) {
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(part_families); k++)
      if (part_families[k].kind && !strcmp(part_families[k].name, family))
        PetscCall(PetscSNPrintf(events, sizeof(events), "Sb%s_%s", part_families[k].kind, name));
    part->events = events;
  }
  if (*found && !part->scene)
    part->scene = "";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scenario: the scene with the options that a part needs, and those that name it ("": without the
   part). Not collective. */
static inline PetscErrorCode part_text(const char *mesh, const char *scene, const char *options,
                                       char text[PART_TEXT])
{
  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, PART_TEXT, PART_SCENE, mesh));
  if (!strstr(options, "-time static"))
    PetscCall(PetscStrlcat(text, PART_TIME, PART_TEXT));
  PetscCall(PetscStrlcat(text, scene, PART_TEXT));
  PetscCall(PetscStrlcat(text, " ", PART_TEXT));
  PetscCall(PetscStrlcat(text, options, PART_TEXT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of calls of an event in all stages, and its time, s; 0 if it does not exist. Not
   collective. */
static inline PetscErrorCode part_event(const char *name, PetscInt *count, PetscLogDouble *seconds)
{
  const PetscLogStage stages[] = {0, SbLogStageSetup, SbLogStageSolve, SbLogStageOutput};
  PetscLogEvent event;

  PetscFunctionBeginUser;
  *count = 0;
  *seconds = 0.;
  PetscCall(PetscLogEventGetId(name, &event));
  for (size_t s = 0; s < PETSC_STATIC_ARRAY_LENGTH(stages) && event >= 0; s++) {
    PetscEventPerfInfo info;

    PetscCall(PetscLogEventGetPerfInfo(stages[s], event, &info));
    *count += info.count;
    *seconds += info.time;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ what is allocated */

/* Allocations of PETSc since part_watch(); separately those in files of supple, and in the folders
   of optional features. */
static struct {
  PetscInt n, n_ours;          /* numbers of allocations */
  double bytes, bytes_ours;    /* total bytes, including freed ones */
  PetscInt n_effect, n_output; /* allocations in files of effects and contact, of output */
} part_allocated;

static PetscErrorCode (*part_malloc)(size_t, PetscBool, int, const char[], const char[], void **);

static inline PetscErrorCode part_count(size_t size, PetscBool clear, int line,
                                        const char function[], const char file[], void **memory)
{
  static const char *const folders[] = {"base", "contact", "effect", "element", "fem", "material",
                                        "mesh", "model",   "output", "scene",   "time"};

  part_allocated.n++;
  part_allocated.bytes += (double)size;
  for (size_t i = 0; file && !strncmp(file, "src/", 4) && i < PETSC_STATIC_ARRAY_LENGTH(folders);
       i++) {
    const size_t length = strlen(folders[i]);

    if (strncmp(file + 4, folders[i], length) || file[4 + length] != '/')
      continue;
    part_allocated.n_ours++;
    part_allocated.bytes_ours += (double)size;
    part_allocated.n_effect += !strcmp(folders[i], "effect") || !strcmp(folders[i], "contact");
    part_allocated.n_output += !strcmp(folders[i], "output");
  }
  return (*part_malloc)(size, clear, line, function, file, memory);
}

/* Starts counting allocations; after PetscInitialize(). Reallocations of PETSc are not counted. */
static inline void part_watch(void)
{
  part_malloc = PetscTrMalloc;
  PetscTrMalloc = part_count;
}

/* Restores PETSc's own routine, which PetscFinalize() needs. */
static inline void part_unwatch(void)
{
  PetscTrMalloc = part_malloc;
}
