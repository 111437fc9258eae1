/* cutproof/plugin.h: have your own kernels judged. SPDX-License-Identifier: MIT. Copy this file into your project.
 *
 * A plugin is a shared library with one exported function (CUTPROOF_PLUGIN at the end) that names operations. All of
 * them may be null. `cutproof judge ./libyours.so` asks each one that is there, in a process of its own.
 *
 * An operation returns 0, or anything else where it refuses what it was given; that counts as refused, not as passed.
 * Arrays are dense, row by row; "real" is f32 or f64, whichever the plugin asks for. Inputs must not be written to. Of
 * outputs whose length is known the rows are set; all others are made longer with host->grow. With device
 * CUTPROOF_CUDA all data are device pointers, and work may be left in host->stream when an operation returns.
 *
 * Structs begin with their size as whoever made them knows it. Members are only ever appended: one that lies beyond the
 * size is not there (CUTPROOF_HAS). C99, C++ and CUDA. */
#ifndef CUTPROOF_PLUGIN_H
#define CUTPROOF_PLUGIN_H
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif

enum { CUTPROOF_ABI = 1 };
enum { CUTPROOF_I32 = 1, CUTPROOF_I64, CUTPROOF_U8, CUTPROOF_F32, CUTPROOF_F64 };
enum { CUTPROOF_HOST, CUTPROOF_CUDA };
enum { CUTPROOF_STEP, CUTPROOF_DETECT, CUTPROOF_SPLIT, CUTPROOF_MERGE, CUTPROOF_EXPAND, CUTPROOF_SKIN };
#define CUTPROOF_HAS(s, member) ((s)->size >= offsetof(__typeof__(*(s)), member) + sizeof((s)->member))

typedef struct cutproof_array {
  uint32_t size;
  int32_t type, device, device_number; /* CUTPROOF_I32 .., CUTPROOF_HOST .. */
  int64_t rows, columns;
  void* data;
} cutproof_array;

typedef struct cutproof_tissue { /* at rest; n particles, of which some may be dead */
  uint32_t size;
  const cutproof_array* edge_offsets; /* i64 [n + 1] the neighbours of particle i are edge_ends[offsets[i] ..] */
  const cutproof_array* edge_ends;    /* i32 each edge at both of its ends */
  const cutproof_array* rest;         /* real [n x 3] m */
  const cutproof_array* mass;         /* real [n] kg */
  const cutproof_array* node;         /* i32 [n x 3] node x, y, z of the grid; null where there is no grid */
  double spacing;                     /* h: the grid's, else the longest edge; m */
  int32_t nodes[3];                   /* of the grid by axis, with an empty ring around the tissue */
} cutproof_tissue;

typedef struct cutproof_state { /* docs/reference/recording.md; n particles, m clusters, k vertices, t triangles */
  uint32_t size;
  cutproof_array *frame, *tau, *cap, *edge_covered;           /* i64, i32, i32, u8 [1] */
  cutproof_array* impulse;                                    /* real [1 x 3] kg m/s, given by contacts in this frame */
  cutproof_array *position, *velocity, *alive;                /* real [n x 3] m, real [n x 3] m/s, u8 [n] */
  cutproof_array *removed, *debris;                           /* i32, ascending: gone in this frame */
  cutproof_array *offsets, *members, *number;                 /* i64 [m + 1], i32 (ascend in a cluster), i32 [m] */
  cutproof_array *rest_center, *mass, *rotation, *degenerate; /* real [m x 3] m, [m] kg, [m x 9], u8 [m] */
  cutproof_array *owner, *direction, *skin_position;          /* skin: i32 [k], u8 [k], real [k x 3] m */
  cutproof_array* triangles;                                  /* i32 [t x 3] */
  cutproof_array* reach;                                      /* skin: real [k] h, from the owner at rest, in (0, 1) */
} cutproof_state;

typedef struct cutproof_scene { /* a body at rest, and what becomes of it; n particles */
  uint32_t size;
  int32_t frames, blades;        /* the first frame is the start */
  double frame_time, gravity[3]; /* s, m/s^2 */
  const cutproof_tissue* tissue;
  const cutproof_array *velocity, *held;        /* at the start: real [n x 3] m/s; u8 [n], 1: it stays where it is */
  const cutproof_array *tetrahedra, *hexahedra; /* of the grid: i32 [.. x 4]; [.. x 8] in VTK's order */
  /* real [frames * blades x 12] m, frame by frame: the corners of what a blade sweeps on the way to a frame, where
   * that lies at its end; NaN: nothing. */
  const cutproof_array* blade;
  /* real [n x 3] m/s, added to velocities as the way to kick_frame begins; kick_frame is -1 where nothing is. */
  const cutproof_array* kick;
  int32_t kick_frame;
} cutproof_scene;

typedef struct cutproof_frames { /* docs/reference/run.md; p: particles of all frames, one frame after the other */
  uint32_t size;
  /* Without rows: not given. All but position may be. */
  cutproof_array *steps, *damping;                     /* i64 [1] substeps in a frame; real [1] 1/s */
  cutproof_array* particles;                           /* i32 [frames] how many; not given: always n */
  cutproof_array *position, *velocity, *spin;          /* real [p x 3] m, m/s, kg m^2/s */
  cutproof_array *mass, *alive, *parent;               /* real [p] kg; u8 [p]; i32 [p] */
  cutproof_array *contact_impulse, *energy;            /* real [frames x 3] kg m/s, real [frames] J */
  cutproof_array* group_count;                         /* i32 [frames] coupling groups; -1: as in the frame before */
  cutproof_array *offsets, *members, *weights;         /* of all that are given: i64 [groups + 1], i32, real */
  cutproof_array *cell_count, *tetrahedra, *hexahedra; /* i32 [frames], -1 likewise; i32 [.. x 4] or [.. x 8] */
  cutproof_array* seconds;                             /* real [frames] what the way to each frame took to compute */
} cutproof_frames;

typedef struct cutproof_host {
  uint32_t size;
  uint32_t abi;
  void* context; /* the host's */
  void* stream;  /* a cudaStream_t; null for plugins on the host */
  /* Gives an output so many rows and keeps those that it has: rows and data change. Not 0: it cannot be had. */
  int (*grow)(const struct cutproof_host* host, cutproof_array* output, int64_t rows);
  void (*log)(const struct cutproof_host* host, const char* text);
  /* In load and run: a field of the setup by its name in docs/reference/recording.md, such as "step/iterations" or
   * "blade_moves/down", with the type it has there; in host memory. Null: there is none. */
  const cutproof_array* (*setup)(const struct cutproof_host* host, const char* name);
  /* In create, before it returns null: its parameters are wrong. The text says which, and what to give. */
  void (*refuse_parameters)(const struct cutproof_host* host, const char* text);
} cutproof_host;

typedef struct cutproof_plugin {
  uint32_t size; /* sizeof(cutproof_plugin) */
  uint32_t abi;  /* CUTPROOF_ABI */
  const char *name, *version;
  const char* promises; /* words of docs/reference/plugins.md; null: default promises */
  int32_t device;       /* where data is wanted */
  int32_t real;         /* CUTPROOF_F32 or CUTPROOF_F64; 0: f32 */
  /* An instance; `self` of all others. Null: it cannot run here, which is no failure. Without it, self is null. */
  void* (*create)(const cutproof_host* host, const char* parameters);
  void (*destroy)(void* self);

  /* r[i] [9]: the rotation with the greatest tr(r' a[i]), of those the one nearest to previous[i]. */
  int (*rotations)(const cutproof_host* host, void* self, const cutproof_array* a, const cutproof_array* previous,
                   cutproof_array* r);
  /* label [n] i32: equal for two living particles exactly if edges between living ones join them. */
  int (*components)(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_array* alive,
                    cutproof_array* label);
  /* vertices real [.. x 3], triangles i32 [.. x 3]: closed, counter-clockwise seen from outside, around the living. */
  int (*surface)(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_array* alive,
                 cutproof_array* vertices, cutproof_array* triangles);
  /* offsets i64 [m + 1], members i32: overlapping clusters for shape matching; members ascend within a cluster. */
  int (*clusters)(const cutproof_host* host, void* self, const cutproof_tissue* tissue, cutproof_array* offsets,
                  cutproof_array* members);

  /* Stages of a frame (docs/design/method.md). One instance holds one body. `run` gets the present state and leaves the
   * one after the stages first .. last. The reference does what can_run denies; null: any span of stages can be run. */
  int (*can_run)(int first, int last);
  int (*load)(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_state* state);
  int (*run)(const cutproof_host* host, void* self, int first, int last, cutproof_state* state);

  /* A whole simulator. `limits`: words of docs/reference/plugins.md that say what it takes; null: all that is asked. */
  const char* limits;
  int (*dissect)(const cutproof_host* host, void* self, const cutproof_scene* scene, cutproof_frames* run);
} cutproof_plugin;

#if defined(__GNUC__)
#define CUTPROOF_EXPORT __attribute__((visibility("default")))
#else
#define CUTPROOF_EXPORT
#endif
CUTPROOF_EXPORT const cutproof_plugin* cutproof_plugin_entry(uint32_t host_abi);
#define CUTPROOF_PLUGIN(plugin) \
  const cutproof_plugin* cutproof_plugin_entry(uint32_t host_abi) { return (void)host_abi, &(plugin); }
#ifdef __cplusplus
}
#endif
#endif
