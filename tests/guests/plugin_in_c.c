/* A plugin in C99 that labels components and makes clusters, right or wrong as its parameters say. What a build of it
 * is otherwise (a version, a size) is said by macros. */
#include <cutproof/plugin.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifndef PLUGIN_ABI
#define PLUGIN_ABI CUTPROOF_ABI
#endif
#ifndef PLUGIN_SIZE
#define PLUGIN_SIZE sizeof(cutproof_plugin)
#endif
#ifndef PLUGIN_DEVICE
#define PLUGIN_DEVICE CUTPROOF_HOST
#endif

static char mode[64] = "right";

/* Volatile, so that no compiler knows. */
static volatile int zero = 0;
static volatile int* volatile nowhere = NULL;

static int is(const char* what) { return strcmp(mode, what) == 0; }

static void* create(const cutproof_host* host, const char* parameters) {
  if (parameters != NULL && parameters[0] != 0) {
    /* What stands behind a comma is for others. */
    const size_t length = strcspn(parameters, ",");
    if (length < sizeof mode) {
      memcpy(mode, parameters, length);
      mode[length] = 0;
    }
  }
  if (is("cannot")) return NULL;
  if (is("log")) host->log(host, "created");
  return mode;
}

/* Wrong in one question of twenty or so, in one way after the other: by what is asked, so that a process that is
 * started anew does not begin at the same way again. */
static void take_turns(const cutproof_array* input) {
  static const char* const ways[] = {"crash", "behind", "label", "rows", "refuse", "abort", "before"};
  static int turns = 0;
  const int64_t sum = 37 * input->rows + ((int64_t*)input->data)[input->rows - 1];
  if (strcmp(mode, "turns") == 0) turns = 1;
  if (turns) strcpy(mode, sum % 20 == 3 ? ways[sum / 20 % 7] : "right");
}

/* What has nothing to do with the operation. */
static int misbehave(cutproof_array* output, const cutproof_array* input) {
  const int64_t bytes = output->rows * output->columns * (output->type == CUTPROOF_I64 ? 8 : 4);
  if (is("crash")) *nowhere = 1;
  if (is("abort")) abort();
  if (is("exit")) exit(0);
  if (is("divide")) return (int)bytes / zero;
  for (volatile int64_t k = 0; is("hang") && k < INT64_MAX; ++k) {
  }
  if (is("before")) ((volatile char*)output->data)[-1] = 1;
  if (is("behind")) ((volatile char*)output->data)[bytes] = 1;
  if (is("behind_by_100")) ((volatile char*)output->data)[bytes + 99] = 1;
  if (is("behind_with_ones")) ((volatile char*)output->data)[bytes] = (char)0xff;
  if (is("far_behind")) ((volatile char*)output->data)[bytes + 100000] = 1;
  if (is("read_behind")) mode[63] = ((volatile char*)input->data)[input->rows * 8];
  if (is("input")) ((volatile char*)input->data)[0] = 77;
  if (is("rows")) output->rows += 3;
  if (is("data")) output->data = mode;
  if (is("behind_and_refuse")) ((volatile char*)output->data)[bytes] = 1;
  if (is("behind_and_refuse")) return 5;
  if (is("type")) output->type = CUTPROOF_F64;
  return is("refuse") ? 5 : 0;
}

static int32_t root(int32_t* to, int32_t i) {
  while (to[i] != i) i = to[i] = to[to[i]];
  return i;
}

/* A launch that ends too early. */
static int64_t launched(int64_t n) { return is("first_16384") && n > 16384 ? 16384 : n; }

static int components(const cutproof_host* host, void* self, const cutproof_tissue* tissue, const cutproof_array* alive,
                      cutproof_array* label) {
  const int64_t* const offsets = tissue->edge_offsets->data;
  const int32_t* const ends = tissue->edge_ends->data;
  const uint8_t* const living = alive->data;
  int32_t* const to = label->data;
  (void)self;
  take_turns(tissue->edge_offsets);
  static int asked = 0;
  if (is("lazy") && asked++ > 0) return 0;
  const int64_t n = launched(alive->rows);
  for (int64_t i = 0; i < n; ++i) to[i] = (int32_t)i;
  for (int64_t i = 0; i < n; ++i) {
    for (int64_t k = offsets[i]; living[i] && k < offsets[i + 1]; ++k) {
      if (ends[k] >= i || !living[ends[k]]) continue;
      const int32_t a = root(to, (int32_t)i), b = root(to, ends[k]);
      to[a > b ? a : b] = a > b ? b : a;
    }
  }
  for (int64_t i = 0; i < n; ++i) to[i] = root(to, (int32_t)i);
  for (int64_t i = 0; i < n && is("labels16"); ++i) to[i] = (uint16_t)to[i];
  static int calls = 0;
  if (is("race") && n > 4096 && ++calls % 2 == 0) to[n - 1] = -2;
  if (is("unwritten") && alive->rows > 3) to[3] = -1;
  if (is("label") && alive->rows > 1 && living[1]) to[1] = to[0] + 1000;
  if (is("join") && alive->rows > 1) memset(to, 0, (size_t)alive->rows * sizeof *to);
  if (is("grow")) return host->grow(host, label, 7);
  return misbehave(label, tissue->edge_offsets);
}

/* A cluster for each particle: itself and its neighbours. */
static int clusters(const cutproof_host* host, void* self, const cutproof_tissue* tissue, cutproof_array* offsets,
                    cutproof_array* members) {
  const int64_t* const of = tissue->edge_offsets->data;
  const int32_t* const ends = tissue->edge_ends->data;
  const int64_t n = launched(tissue->edge_offsets->rows - 1);
  (void)self;
  if (is("grow_huge")) return host->grow(host, members, INT64_C(1000000000000));
  if (is("grow_negative")) return host->grow(host, members, -1);
  if (is("grow_another")) return host->grow(host, (cutproof_array*)tissue->edge_ends, 3);
  if (host->grow(host, offsets, n + 1) || host->grow(host, members, 1)) return 1;
  /* One after the other, so that what is there has to be kept. */
  int64_t used = 0;
  ((int64_t*)offsets->data)[0] = 0;
  for (int64_t i = 0; i < n; ++i) {
    const int64_t most = used + 1 + of[i + 1] - of[i];
    if (most > members->rows && host->grow(host, members, 2 * most)) return 1;
    int32_t* const to = members->data;
    to[used++] = (int32_t)i;
    for (int64_t k = of[i]; k < of[i + 1]; ++k) {
      if (is("uncovered") && i + ends[k] == 3) continue;
      int64_t at = used++;
      for (; at > 0 && at > ((int64_t*)offsets->data)[i] && to[at - 1] > ends[k]; --at) to[at] = to[at - 1];
      to[at] = ends[k];
    }
    ((int64_t*)offsets->data)[i + 1] = used;
  }
  if (host->grow(host, members, used)) return 1;
  for (int64_t k = 0; k < used && is("members16"); ++k) ((int32_t*)members->data)[k] &= 0xffff;
  if (is("last_member") && used > 0) ((int32_t*)members->data)[used - 1] = (int32_t)n;
  return misbehave(members, tissue->edge_offsets);
}

static const cutproof_plugin plugin = {
    .size = PLUGIN_SIZE,
    .abi = PLUGIN_ABI,
    .name = "in C",
    .version = "1",
#ifdef PLUGIN_PROMISES
    .promises = PLUGIN_PROMISES,
#endif
    .device = PLUGIN_DEVICE,
    .create = create,
    .components = components,
    .clusters = clusters,
};
CUTPROOF_PLUGIN(plugin)
