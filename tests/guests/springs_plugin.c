/* A whole simulator in C99: springs along the edges of the tissue, broken by what a blade sweeps. What is wrong with it
 * is said by its parameters. */
#include <cutproof/plugin.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static char mode[64] = "right";
static int is(const char* what) { return strcmp(mode, what) == 0; }

static void* create(const cutproof_host* host, const char* parameters) {
  if (parameters != NULL && strcmp(parameters, "stiff") == 0) {
    host->refuse_parameters(host, "there is no parameter 'stiff'");
    return NULL;
  }
  if (parameters != NULL && parameters[0] != 0) strncpy(mode, parameters, sizeof mode - 1);
  return mode;
}

static const double* doubles(const cutproof_array* array) { return (const double*)array->data; }

static void cross(const double* a, const double* b, double* c) {
  for (int k = 0; k < 3; ++k) c[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}
static double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static void minus(const double* a, const double* b, double* c) {
  for (int k = 0; k < 3; ++k) c[k] = a[k] - b[k];
}

/* Whether the segment from p to q crosses the triangle. */
static int crosses(const double* p, const double* q, const double* a, const double* b, const double* c) {
  double ab[3], ac[3], n[3], ap[3], aq[3], x[3];
  minus(b, a, ab), minus(c, a, ac), cross(ab, ac, n), minus(p, a, ap), minus(q, a, aq);
  const double from = dot(ap, n), to = dot(aq, n);
  if ((from < 0) == (to < 0)) return 0;
  for (int k = 0; k < 3; ++k) x[k] = p[k] + from / (from - to) * (q[k] - p[k]);
  const double* const corners[4] = {a, b, c, a};
  for (int side = 0; side < 3; ++side) {
    double way[3], to_x[3], out[3];
    minus(corners[side + 1], corners[side], way), minus(x, corners[side], to_x), cross(way, to_x, out);
    if (!(dot(out, n) >= 0)) return 0;
  }
  return 1;
}
static int is_cut(const double* p, const double* q, const double* quad) {
  return quad[0] == quad[0] && (crosses(p, q, quad, quad + 3, quad + 6) || crosses(p, q, quad, quad + 6, quad + 9));
}

typedef struct spring {
  int32_t i, j;
  double length;
  int broken;
} spring;

/* Makes an output longer by `rows`, and says where they begin. */
static int more(const cutproof_host* host, cutproof_array* output, int64_t rows, int64_t* begin) {
  *begin = output->rows;
  return host->grow(host, output, output->rows + rows);
}

static int write_frame(const cutproof_host* host, cutproof_frames* run, int64_t n, const double* x, const double* v,
                       const spring* springs, int64_t count) {
  int64_t begin, whole = 0, member = 0;
  if (more(host, run->position, n, &begin)) return 1;
  memcpy((double*)run->position->data + 3 * begin, x, (size_t)n * 3 * sizeof *x);
  if (more(host, run->velocity, n, &begin)) return 1;
  memcpy((double*)run->velocity->data + 3 * begin, v, (size_t)n * 3 * sizeof *v);
  for (int64_t s = 0; s < count; ++s) whole += springs[s].broken == 0;
  if (is("right")) { /* no two runs take as long */
    static double clock = 0;
    if (more(host, run->seconds, 1, &begin)) return 1;
    ((double*)run->seconds->data)[begin] = clock += 1;
  }
  if (more(host, run->group_count, 1, &begin)) return 1;
  ((int32_t*)run->group_count->data)[begin] = (int32_t)whole;
  if (run->offsets->rows == 0) {
    if (host->grow(host, run->offsets, 1)) return 1;
    ((int64_t*)run->offsets->data)[0] = 0;
  }
  if (more(host, run->members, 2 * whole, &member) || more(host, run->offsets, whole, &begin)) return 1;
  for (int64_t s = 0; s < count; ++s) {
    if (springs[s].broken) continue;
    ((int32_t*)run->members->data)[member++] = springs[s].i;
    ((int32_t*)run->members->data)[member++] = springs[s].j;
    ((int64_t*)run->offsets->data)[begin++] = member;
  }
  return 0;
}

static int simulate(const cutproof_host* host, const cutproof_scene* scene, cutproof_frames* run, double* x, double* v,
                    double* force, spring* springs) {
  const int64_t n = scene->tissue->rest->rows;
  const int64_t* const offsets = (const int64_t*)scene->tissue->edge_offsets->data;
  const int32_t* const ends = (const int32_t*)scene->tissue->edge_ends->data;
  const uint8_t* const held = (const uint8_t*)scene->held->data;
  const double *const mass = doubles(scene->tissue->mass), *const blade = doubles(scene->blade);
  const int64_t steps = 1 + (int64_t)(1000 * scene->frame_time);
  const double dt = scene->frame_time / (double)steps, h = scene->tissue->spacing;
  int64_t count = 0;
  memcpy(x, scene->tissue->rest->data, (size_t)n * 3 * sizeof *x);
  memcpy(v, scene->velocity->data, (size_t)n * 3 * sizeof *v);
  for (int32_t i = 0; i < n; ++i) {
    for (int64_t k = offsets[i]; k < offsets[i + 1]; ++k) {
      if (ends[k] < i) continue;
      double way[3];
      minus(x + 3 * ends[k], x + 3 * i, way);
      springs[count++] = (spring){i, ends[k], sqrt(dot(way, way)), 0};
    }
  }
  if (host->grow(host, run->steps, 1)) return 1;
  ((int64_t*)run->steps->data)[0] = steps;
  double fastest = 0;
  for (int32_t frame = 0; frame < scene->frames; ++frame) {
    for (int64_t k = 0; k < 3 * n && frame == scene->kick_frame && !is("unkicked"); ++k) {
      v[k] += doubles(scene->kick)[k];
      fastest = fmax(fastest, fabs(doubles(scene->kick)[k]));
    }
    /* As a solver that stops earlier where the whole scene moves faster. */
    for (int64_t k = 0; k < 3 * n && is("global"); ++k) v[k] *= 1 + 1e-9 * fastest;
    for (int64_t step = 0; frame > 0 && step < steps; ++step) {
      memset(force, 0, (size_t)n * 3 * sizeof *force);
      for (int64_t s = 0; s < count; ++s) {
        if (springs[s].broken) continue;
        double way[3], apart[3];
        const int32_t i = springs[s].i, j = springs[s].j;
        minus(x + 3 * j, x + 3 * i, way), minus(v + 3 * j, v + 3 * i, apart);
        const double length = sqrt(dot(way, way));
        const double stiffness = 2e7 * h * h * h * (is("handed") && way[0] > 0 ? 1 + 1e-6 : 1);
        const double damping = 0.2 * sqrt(stiffness * mass[i]) * dot(apart, way) / length;
        const double pull = (stiffness * (length - springs[s].length) + damping) / length;
        for (int k = 0; k < 3; ++k) {
          force[3 * i + k] += pull * way[k];
          force[3 * j + k] -= is("momentum") ? 0.99 * pull * way[k] : pull * way[k];
        }
      }
      for (int64_t i = 0; i < n; ++i) {
        for (int k = 0; k < 3; ++k) {
          if (held[i] && !is("drops")) {
            v[3 * i + k] = 0;
            continue;
          }
          v[3 * i + k] += dt * (force[3 * i + k] / mass[i] + (is("weightless") ? 0 : scene->gravity[k]));
          x[3 * i + k] += dt * v[3 * i + k];
        }
      }
    }
    for (int64_t s = 0; s < count; ++s) {
      int hit = 0;
      for (int32_t b = 0; b < scene->blades; ++b) {
        hit |= is_cut(x + 3 * springs[s].i, x + 3 * springs[s].j, blade + 12 * (frame * scene->blades + b));
      }
      if (is("uncut")) hit = 0;
      if (is("heals")) springs[s].broken = 0;
      springs[s].broken |= hit;
    }
    if (is("elsewhere") && frame == 3) springs[0].broken = 1;
    if (is("nothing_left") && frame == 3) {
      for (int64_t s = 0; s < count; ++s) springs[s].broken = 1;
    }
    if (write_frame(host, run, n, x, v, springs, count)) return 1;
  }
  if (is("short")) return host->grow(host, run->position, run->position->rows - 1);
  if (is("offsets")) ((int64_t*)run->offsets->data)[run->offsets->rows - 1] = 1;
  if (is("index") && run->members->rows > 0) ((int32_t*)run->members->data)[0] = (int32_t)n;
  if (is("beside")) ((double*)run->position->data)[0] += 1e-6;
  static int calls = 0;
  double* const last = (double*)run->position->data + 3 * run->position->rows - 1;
  if (is("last_bit") && ++calls % 2 == 0) *last = nextafter(*last, 1);
  return 0;
}

static int dissect(const cutproof_host* host, void* self, const cutproof_scene* scene, cutproof_frames* run) {
  (void)self;
  const int64_t n = scene->tissue->rest->rows;
  /* All but one scene in a hundred. */
  if (is("refuse") || (is("refuse_most") && n % 100 != 12)) return 3;
  double* const x = malloc((size_t)n * 9 * sizeof *x);
  spring* const springs = malloc(((size_t)scene->tissue->edge_ends->rows + 1) * sizeof *springs);
  const int failed = simulate(host, scene, run, x, x + 3 * n, x + 6 * n, springs);
  free(x);
  free(springs);
  return failed;
}

#ifndef PLUGIN_LIMITS
#define PLUGIN_LIMITS 0
#endif
static const cutproof_plugin plugin = {.size = sizeof plugin,
                                       .abi = CUTPROOF_ABI,
                                       .name = "springs",
                                       .version = "1",
                                       .promises = "free angular_momentum deterministic no_ghost_force mirror",
                                       .real = CUTPROOF_F64,
                                       .create = create,
                                       .limits = PLUGIN_LIMITS,
                                       .dissect = dissect};
CUTPROOF_PLUGIN(plugin)
