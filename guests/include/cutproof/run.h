/* cutproof/run.h: writes what a simulator did as a run that cutproof judges. SPDX-License-Identifier: MIT.
 * Copy this file into your project. C99, C++ and CUDA; POSIX; little endian; allocates nothing.
 *
 *   cutproof_run run;
 *   cutproof_run_open(&run, "run");                      a folder; a run that is in it is removed
 *   cutproof_run_f64(&run, "rest", x0, n, 3);            what is given once, with the first frame
 *   cutproof_run_number(&run, "spacing", h);
 *   cutproof_run_promise(&run, "free");
 *   for (each frame, the start included) {
 *     cutproof_run_f64(&run, "positions", x, n, 3);      f32 for float
 *     cutproof_run_number(&run, "time", t);
 *     if (groups have changed) {
 *       cutproof_run_i32(&run, "groups_offsets", offsets, groups + 1, 1);
 *       cutproof_run_i32(&run, "groups_members", members, offsets[groups], 1);
 *     }
 *     cutproof_run_frame(&run);                          ends the frame
 *   }
 *   if (cutproof_run_close(&run) != 0) puts(run.error);
 *
 * Then `cutproof check run` judges it. Each frame is a file, run/000000.npz and so on, which gets its name when it lies
 * on the disk: a killed program loses only the frame in progress. numpy.load reads the files.
 *
 * All functions return 0, or -1 once anything has failed. `error` says what failed first; after that nothing is
 * written, so the last return value is enough to look at. An array is rows × columns values, row by row, on the host.
 * It is written at once, and may change afterwards. The table below names all arrays. docs/reference/run.md says what
 * they mean and which of them each property needs; lengths are in m, times in s, masses in kg. */
#ifndef CUTPROOF_RUN_H
#define CUTPROOF_RUN_H
#include <dirent.h>
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef __cplusplus
extern "C" {
#endif
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "cutproof/run.h writes numbers as they lie in memory, and files of runs are little endian."
#endif
#ifndef __cplusplus
int fileno(FILE*), fsync(int); /* of POSIX, which strict C99 hides */
#endif

/* `when`: once, by frame, or by segment: until it is given anew. `holds`: real numbers, whole numbers, flags 0 or 1.
 * `rows`: n particles, 1, or any. A row has `columns` values, or `or_columns`. */
typedef struct cutproof_run_array {
  const char* name;
  char when, holds, rows;
  int columns, or_columns;
} cutproof_run_array;
static const cutproof_run_array cutproof_run_arrays[] = {
    {"positions", 'f', 'r', 'n', 3, 0},       /* [m] required; NaN: the particle does not exist */
    {"rest", 'o', 'r', 'n', 3, 0},            /* [m] where particles are at rest */
    {"gravity", 'o', 'r', '1', 3, 0},         /* [m/s²] */
    {"spacing", 'o', 'r', '1', 1, 0},         /* [m] between neighbours at rest */
    {"steps", 'o', 'w', '1', 1, 0},           /* substeps in a frame */
    {"damping", 'o', 'r', '1', 1, 0},         /* c [1/s]: velocities decay as exp(-c t) */
    {"edges", 'o', 'w', '*', 2, 0},           /* pairs of particles that are tissue */
    {"nodes", 'o', 'w', 'n', 3, 0},           /* rest = spacing * nodes */
    {"permutation", 'o', 'w', 'n', 1, 0},     /* which particle of a related run each one is */
    {"cut_resolution", 'o', 'r', '1', 1, 0},  /* [m] how far a cut may lie beside the blade's sweep */
    {"unit_roundoff", 'o', 'r', '1', 1, 0},   /* of your arithmetic, if not that of the type of positions */
    {"time", 'f', 'r', '1', 1, 0},            /* [s] at the end of the frame */
    {"velocities", 'f', 'r', 'n', 3, 0},      /* [m/s] */
    {"alive", 'f', 'f', 'n', 1, 0},           /* 1: exists */
    {"removed", 'f', 'f', 'n', 1, 0},         /* 1: a cut has taken it out */
    {"held", 'f', 'f', 'n', 1, 0},            /* 1: its motion was prescribed */
    {"contact_impulse", 'f', 'r', '1', 3, 0}, /* [kg m/s] that contacts and grips added in this frame */
    {"spin", 'f', 'r', 'n', 3, 0},            /* [kg m²/s] that particles carry themselves */
    {"energy", 'f', 'r', '1', 1, 0},          /* [J] */
    {"blade", 'f', 'r', '*', 12, 9},          /* [m] quads or triangles that the blade swept in this frame */
    {"groups_offsets", 's', 'w', '*', 1, 0},  /* groups + 1: where each begins in groups_members */
    {"groups_members", 's', 'w', '*', 1, 0},  /* particles that feel each other, group by group */
    {"groups_weights", 's', 'r', '*', 1, 0},  /* of each member; the greatest of a group is 1 */
    {"cells", 's', 'w', '*', 4, 8},           /* corners of tetrahedra, or of hexahedra as VTK orders them */
    {"mass", 's', 'r', 'n', 1, 0},            /* [kg] */
    {"parent", 's', 'w', 'n', 1, 0},          /* which particle a new one was split from; -1: none */
    {"piece", 's', 'w', 'n', 1, 0},           /* your own word on which piece a particle is of */
    {"vertices", 'f', 'r', '*', 3, 0},        /* [m] of the skin */
    {"triangles", 's', 'w', '*', 3, 0},       /* of the skin */
    {"promises", 'o', 't', '1', 1, 0},        /* text: cutproof_run_promise() */
};
enum { CUTPROOF_RUN_ARRAYS = (int)(sizeof cutproof_run_arrays / sizeof *cutproof_run_arrays) };

typedef struct cutproof_run {
  char error[256];                           /* "" while all is well; what follows is the writer's own */
  char folder[1024], path[1056], part[1064]; /* of this frame, and while it is written */
  long frames;                               /* written */
  size_t particles, particles_before;        /* of this frame, 0 while it has none; of the one before */
  FILE* file;                                /* of this frame, or null */
  uint64_t written;                          /* bytes of it */
  struct {
    uint32_t sum, bytes, at; /* 0 bytes: not in this frame */
  } entries[CUTPROOF_RUN_ARRAYS];
  uint32_t sums[256];
} cutproof_run;

/* The first failure is kept, and the file in progress goes. */
static inline int cutproof_run_fail(cutproof_run* run, const char* format, ...) {
  va_list values;
  if (run->error[0] == '\0') {
    va_start(values, format);
    vsnprintf(run->error, sizeof run->error, format, values);
    va_end(values);
  }
  if (run->file != NULL) {
    fclose(run->file);
    remove(run->part);
  }
  run->file = NULL;
  return -1;
}
static inline int cutproof_run_refused(cutproof_run* run, const char* path) { /* by the system */
  return cutproof_run_fail(run, "%.150s: %s.", path, strerror(errno));
}

static inline int cutproof_run_open(cutproof_run* run, const char* folder) {
  char path[1400];
  DIR* all;
  struct dirent* each;
  memset(run, 0, sizeof *run);
  for (uint32_t k = 0; k < 256; ++k) {
    run->sums[k] = k;
    for (int bit = 0; bit < 8; ++bit) run->sums[k] = (run->sums[k] >> 1) ^ (run->sums[k] & 1 ? 0xEDB88320u : 0);
  }
  if (strlen(folder) >= sizeof run->folder) return cutproof_run_fail(run, "The name of the folder is too long.");
  strcpy(run->folder, folder);
  if (mkdir(folder, 0777) != 0 && errno != EEXIST) return cutproof_run_refused(run, folder);
  all = opendir(folder);
  if (all == NULL) return cutproof_run_refused(run, folder);
  while ((each = readdir(all)) != NULL) { /* an older, longer run must not go on behind this one */
    const char* const name = each->d_name;
    if (strspn(name, "0123456789") != 6 || (strcmp(name + 6, ".npz") != 0 && strcmp(name + 6, ".npz.part") != 0))
      continue;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (remove(path) != 0) cutproof_run_refused(run, path);
  }
  closedir(all);
  return run->error[0] == '\0' ? 0 : -1;
}

static inline int cutproof_run_write(cutproof_run* run, const void* bytes, size_t count) {
  run->written += count;
  return count == 0 || fwrite(bytes, 1, count, run->file) == count ? 0 : cutproof_run_refused(run, run->path);
}
static inline char* cutproof_run_little(char* to, uint64_t value, int bytes) {
  for (; bytes > 0; --bytes, value >>= 8) *to++ = (char)(value & 255);
  return to;
}
static inline uint32_t cutproof_run_sum(const cutproof_run* run, uint32_t sum, const void* bytes, size_t count) {
  const unsigned char* at = (const unsigned char*)bytes;
  for (sum = ~sum; count > 0; --count) sum = (sum >> 8) ^ run->sums[(sum ^ *at++) & 255];
  return ~sum;
}
/* What stands before an entry of a ZIP archive, and, with more of it, in the directory. */
static inline int cutproof_run_entry(cutproof_run* run, int k, int in_directory) {
  char line[96], *to = cutproof_run_little(line, in_directory ? 0x02014B50 : 0x04034B50, 4);
  if (in_directory) to = cutproof_run_little(to, 20, 2);
  to = cutproof_run_little(to, 20, 2);          /* version */
  to = cutproof_run_little(to, 0, 4);           /* no flags, no compression */
  to = cutproof_run_little(to, 0x21u << 16, 4); /* the first date that there is */
  to = cutproof_run_little(to, run->entries[k].sum, 4);
  to = cutproof_run_little(to, run->entries[k].bytes, 4);
  to = cutproof_run_little(to, run->entries[k].bytes, 4);
  to = cutproof_run_little(to, strlen(cutproof_run_arrays[k].name) + 4, 4);
  if (in_directory)
    to = cutproof_run_little(cutproof_run_little(cutproof_run_little(to, 0, 8), 0, 2), run->entries[k].at, 4);
  to += sprintf(to, "%s.npy", cutproof_run_arrays[k].name);
  return cutproof_run_write(run, line, (size_t)(to - line));
}

/* `type`: as numpy writes it; `each`: its bytes. */
static inline int cutproof_run_put(cutproof_run* run, const char* name, const char* type, size_t each,
                                   const void* values, size_t rows, size_t columns) {
  enum { kNpy = 128 };               /* bytes of a .npy file before its values */
  const uint64_t most = 0xFFFF0000u; /* beyond 4 GiB an archive has another format */
  const cutproof_run_array* array = cutproof_run_arrays;
  char npy[kNpy], shape[40] = "", *to = shape;
  size_t wanted;
  int k = 0;
  if (run->error[0] != '\0') return -1;
  while (k < CUTPROOF_RUN_ARRAYS && strcmp(array->name, name) != 0) ++k, ++array;
  if (k == CUTPROOF_RUN_ARRAYS) return cutproof_run_fail(run, "%.60s: There is no array of this name.", name);
  if (array->when == 'o' && run->frames > 0)
    return cutproof_run_fail(run, "%s: It is given once, with the first frame.", name);
  if (run->entries[k].bytes != 0) return cutproof_run_fail(run, "%s: It is given twice in a frame.", name);
  if (array->holds != (type[1] == 'f' ? 'r' : type[1] == 'S' ? 't' : array->holds == 'f' ? 'f' : 'w'))
    return cutproof_run_fail(run, "%s: Its type is %.3s; wanted are %s.", name, type + 1,
                             array->holds == 'r'   ? "f32 or f64"
                             : array->holds == 't' ? "words"
                                                   : "integers");
  if (columns != (size_t)array->columns && (array->or_columns == 0 || columns != (size_t)array->or_columns))
    return cutproof_run_fail(run, "%s: It has %zu columns; wanted are %d.", name, columns, array->columns);
  if (array->rows == 'n' && run->particles == 0) run->particles = rows;
  wanted = array->rows == '*' ? rows : array->rows == '1' ? 1 : run->particles;
  if (rows != wanted) return cutproof_run_fail(run, "%s: It has %zu rows; wanted are %zu.", name, rows, wanted);
  if (run->written > most || rows > (most - run->written) / (columns * each))
    return cutproof_run_fail(run, "%s: With it frame %ld has 4 GiB or more.", name, run->frames);

  if (run->file == NULL) {
    snprintf(run->path, sizeof run->path, "%s/%06ld.npz", run->folder, run->frames);
    snprintf(run->part, sizeof run->part, "%s.part", run->path);
    run->file = fopen(run->part, "wb");
    if (run->file == NULL) return cutproof_run_refused(run, run->path);
  }
  if (array->when == 'f') to += sprintf(to, "1, "); /* a segment of one frame */
  if (array->rows != '1') to += sprintf(to, "%zu, ", rows);
  if (columns > 8) /* a blade */
    to += sprintf(to, "%zu, 3, ", columns / 3);
  else if (columns > 1)
    to += sprintf(to, "%zu, ", columns);
  memset(npy, ' ', kNpy);
  memcpy(npy, "\x93NUMPY\1", 8);
  cutproof_run_little(npy + 8, kNpy - 10, 2);
  npy[10 + snprintf(npy + 10, kNpy - 10, "{'descr': '%s', 'fortran_order': False, 'shape': (%s)}", type, shape)] = ' ';
  npy[kNpy - 1] = '\n';
  run->entries[k].at = (uint32_t)run->written;
  run->entries[k].bytes = (uint32_t)(kNpy + rows * columns * each);
  run->entries[k].sum = cutproof_run_sum(run, cutproof_run_sum(run, 0, npy, kNpy), values, rows * columns * each);
  if (cutproof_run_entry(run, k, 0) != 0 || cutproof_run_write(run, npy, kNpy) != 0) return -1;
  return cutproof_run_write(run, values, rows * columns * each);
}
#define CUTPROOF_RUN_OF(kind, type, numpy)                                                               \
  static inline int cutproof_run_##kind(cutproof_run* run, const char* name, const type* x, size_t rows, \
                                        size_t columns) {                                                \
    return cutproof_run_put(run, name, numpy, sizeof *x, x, rows, columns);                              \
  }
CUTPROOF_RUN_OF(f64, double, "<f8")
CUTPROOF_RUN_OF(f32, float, "<f4")
CUTPROOF_RUN_OF(i64, int64_t, "<i8")
CUTPROOF_RUN_OF(i32, int32_t, "<i4")
CUTPROOF_RUN_OF(u8, uint8_t, "|u1")
static inline int cutproof_run_number(cutproof_run* run, const char* name, double x) {
  const int64_t whole = x >= 1 && x < 1e15 ? (int64_t)x : 0;
  return strcmp(name, "steps") == 0 && (double)whole == x ? cutproof_run_i64(run, name, &whole, 1, 1)
                                                          : cutproof_run_f64(run, name, &x, 1, 1);
}
/* Words with spaces between them: free angular_momentum energy skin deterministic. */
static inline int cutproof_run_promise(cutproof_run* run, const char* words) {
  char type[16];
  const size_t length = strlen(words);
  if (length == 0 || length > 1000) return cutproof_run_fail(run, "promises: wanted are a few words.");
  snprintf(type, sizeof type, "|S%zu", length);
  return cutproof_run_put(run, "promises", type, length, words, 1, 1);
}

/* What was given since the last frame is the next one. */
static inline int cutproof_run_frame(cutproof_run* run) {
  const uint64_t directory = run->written;
  char end[22], *to;
  uint64_t count = 0;
  if (run->error[0] != '\0') return -1;
  if (run->particles == 0 || run->entries[0].bytes == 0)
    return cutproof_run_fail(run, "positions: Frame %ld has none.", run->frames);
  if (run->particles < run->particles_before)
    return cutproof_run_fail(run, "positions: Frame %ld has %zu particles, and the one before has %zu.", run->frames,
                             run->particles, run->particles_before);
  if (run->frames > 999999) return cutproof_run_fail(run, "There are more than 1,000,000 frames.");
  for (int k = 0; k < CUTPROOF_RUN_ARRAYS; ++k) {
    count += run->entries[k].bytes != 0;
    if (run->entries[k].bytes != 0 && cutproof_run_entry(run, k, 1) != 0) return -1;
  }
  to = cutproof_run_little(cutproof_run_little(end, 0x06054B50, 4), 0, 4);
  to = cutproof_run_little(cutproof_run_little(to, count, 2), count, 2);
  to = cutproof_run_little(cutproof_run_little(to, run->written - directory, 4), directory, 4);
  cutproof_run_little(to, 0, 2);
  if (cutproof_run_write(run, end, sizeof end) != 0) return -1;
  if (fflush(run->file) != 0 || fsync(fileno(run->file)) != 0 || rename(run->part, run->path) != 0)
    return cutproof_run_refused(run, run->path);
  fclose(run->file);
  run->file = NULL;
  run->written = 0;
  memset(run->entries, 0, sizeof run->entries);
  run->particles_before = run->particles;
  run->particles = 0;
  ++run->frames;
  return 0;
}
static inline int cutproof_run_close(cutproof_run* run) {
  if (run->error[0] != '\0') return -1;
  if (run->file != NULL) return cutproof_run_fail(run, "Arrays were given behind the last frame.");
  return run->frames > 0 ? 0 : cutproof_run_fail(run, "The run has no frames.");
}
#ifdef __cplusplus
}
#endif
#endif /* CUTPROOF_RUN_H */
