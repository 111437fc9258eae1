/* springs.py in C, in double or (-DSINGLE) single precision. SPDX-License-Identifier: MIT.
 *   cc -std=c99 -O2 -I ../../include springs.c -lm -o springs
 *   ./springs RUN [right | heals | glued_by_one_node | spin_lost | momentum_from_nothing] [FRAMES] */
#include <cutproof/run.h>
#include <math.h>
#include <stdlib.h>

#ifdef SINGLE
typedef float real;
#define PUT cutproof_run_f32
#else
typedef double real;
#define PUT cutproof_run_f64
#endif
enum { X = 7, Y = 4, Z = 3, N = X * Y * Z, STEPS = 10, FIRST = 4, LAST = 10 };
static const real h = 0.01f, frame_time = 0.01f, gravity[3] = {0, 0, -9.81f}, omega[3] = {0.3f, 1, 0.5f};
static real rest[N][3], x[N][3], v[N][3], force[N][3], mass[N], length[13 * N], blade[4][3];
static int32_t ends[13 * N][2], whole[13 * N][2], offsets[13 * N + 1];
static int springs = 0, broken[13 * N];

static real dot(const real* a, const real* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void substep(int loses_spin, int loses_momentum) {
  const real dt = frame_time / STEPS, stiffness = 2000 * h, damping = (real)0.2 * (real)sqrt(stiffness * mass[0]);
  for (int i = 0; i < N; ++i)
    for (int k = 0; k < 3; ++k) force[i][k] = mass[i] * gravity[k];
  for (int s = 0; s < springs; ++s) {
    const int i = ends[s][0], j = ends[s][1];
    real way[3], apart[3];
    if (broken[s]) continue;
    for (int k = 0; k < 3; ++k) way[k] = x[j][k] - x[i][k], apart[k] = v[j][k] - v[i][k];
    const real now = (real)sqrt(dot(way, way)), closing = dot(apart, way) / now;
    for (int k = 0; k < 3; ++k) {
      const real damped = loses_spin ? apart[k] : closing * way[k] / now; /* else also across the spring */
      const real pull = stiffness * (now - length[s]) * way[k] / now + damping * damped;
      force[i][k] += pull;
      if (!loses_momentum || s % 50 != 0) force[j][k] -= pull;
    }
  }
  for (int i = 0; i < N; ++i)
    for (int k = 0; k < 3; ++k) v[i][k] += dt * force[i][k] / mass[i], x[i][k] += dt * v[i][k];
}

/* Down through the block, 0.4 h beside its middle nodes; it falls along. Breaks the springs that it crosses. */
static void cut(int frame, int heals, int glues) {
  const real at = (real)3.4 * h, t = frame * frame_time, per_frame = (Z + 1) * h / (LAST - FIRST + 1);
  const real high = Z * h + gravity[2] * t * t / 2 - per_frame * (frame - FIRST - (real)0.2);
  const real low = high - per_frame * (real)1.2;
  int glued = -1;
  for (int k = 0; k < 4; ++k) blade[k][0] = at, blade[k][1] = k % 3 == 0 ? Y * h : -h, blade[k][2] = k < 2 ? high : low;
  for (int s = 0; s < springs; ++s) {
    const real *a = x[ends[s][0]], *b = x[ends[s][1]], z = a[2] + (at - a[0]) / (b[0] - a[0]) * (b[2] - a[2]);
    const int hit = frame >= FIRST && frame <= LAST && (a[0] < at) != (b[0] < at) && z >= low && z <= high;
    if (heals) broken[s] = 0;
    if (hit && glued < 0) glued = ends[s][0];
    if (hit && !(glues && (ends[s][0] == glued || ends[s][1] == glued))) broken[s] = 1;
  }
}

int main(int argc, char** argv) {
  const char* const fault = argc > 2 ? argv[2] : "right";
  const int frames = argc > 3 ? atoi(argv[3]) : 24;
  cutproof_run run;
  for (int i = 0; i < N; ++i) {
    const real node[3] = {(real)(i % X), (real)(i / X % Y), (real)(i / X / Y)};
    const real way[3] = {h * (node[0] - (X - 1) / (real)2), h * (node[1] - (Y - 1) / (real)2),
                         h * (node[2] - (Z - 1) / (real)2)};
    mass[i] = 1000 * h * h * h;
    for (int k = 0; k < 3; ++k) {
      x[i][k] = rest[i][k] = h * node[k];
      v[i][k] = omega[(k + 1) % 3] * way[(k + 2) % 3] - omega[(k + 2) % 3] * way[(k + 1) % 3];
    }
    v[i][0] += 2 * way[0]; /* it is being pulled apart along x */
    for (int j = 0; j < i; ++j) {
      const int dx = abs(i % X - j % X), dy = abs(i / X % Y - j / X % Y), dz = i / X / Y - j / X / Y;
      if (dx > 1 || dy > 1 || dz > 1) continue;
      ends[springs][0] = j, ends[springs][1] = i;
      length[springs++] = h * (real)sqrt((real)(dx + dy + dz));
    }
  }
  cutproof_run_open(&run, argc > 1 ? argv[1] : "run");
  PUT(&run, "rest", rest[0], N, 3);
  PUT(&run, "mass", mass, N, 1);
  PUT(&run, "gravity", gravity, 1, 3);
  cutproof_run_i32(&run, "edges", ends[0], (size_t)springs, 2);
  cutproof_run_number(&run, "steps", STEPS);
  cutproof_run_promise(&run, "free angular_momentum deterministic");
  for (int frame = 0; frame < frames && run.error[0] == '\0'; ++frame) {
    int groups = 0;
    for (int step = 0; frame > 0 && step < STEPS; ++step)
      substep(strcmp(fault, "spin_lost") == 0, strcmp(fault, "momentum_from_nothing") == 0);
    cut(frame, strcmp(fault, "heals") == 0, strcmp(fault, "glued_by_one_node") == 0);
    for (int s = 0; s < springs; ++s)
      if (!broken[s]) whole[groups][0] = ends[s][0], whole[groups++][1] = ends[s][1], offsets[groups] = 2 * groups;
    PUT(&run, "positions", x[0], N, 3);
    PUT(&run, "velocities", v[0], N, 3);
    cutproof_run_number(&run, "time", frame * frame_time);
    if (frame >= FIRST && frame <= LAST) PUT(&run, "blade", blade[0], 1, 12);
    cutproof_run_i32(&run, "groups_offsets", offsets, (size_t)groups + 1, 1);
    cutproof_run_i32(&run, "groups_members", whole[0], 2 * (size_t)groups, 1);
    cutproof_run_frame(&run);
  }
  if (cutproof_run_close(&run) != 0) fprintf(stderr, "%s\n", run.error);
  return run.error[0] != '\0';
}
