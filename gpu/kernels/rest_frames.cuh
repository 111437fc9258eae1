// Rest frames of clusters whose members, or whose members' shares, have changed (method.md §5).
#pragma once
#include "gpu/launch/launcher.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

// Threads that compute one rest frame: as many as a host block has, so that host and device add in the same order.
inline constexpr int kRestThreads = 32;

// T_s and M_s of one cluster, by all threads of the block, with the weights w = m / n of its present members:
// T_s = h · (rest_base + rest_offset), the base being its first member. Sums are relative to the base, and what they
// are off by is summed once more and taken out, so that one rounding of the offset is left.
template <class Block>
CUTPROOF_DEVICE void recompute_rest_frame(Block& block, const DeviceView& w, int s) {
  const BodyConstants& body = w.body[w.slot_body[s]];
  const int begin = w.slot_begin[s], size = w.slot_size[s];
  const Coordinates base = coordinates(body, w.node[w.members[begin]]);
  const auto weighted = [&](auto add) {
    for (int k = block.thread(); k < size; k += block.size()) {
      const int p = w.members[begin + k];
      const Coordinates c = coordinates(body, w.node[p]);
      const Float3 from_base = {static_cast<float>(c.i - base.i), static_cast<float>(c.j - base.j),
                                static_cast<float>(c.k - base.k)};
      add(w.displacement[p].w / static_cast<float>(w.membership_count[p]), from_base);
    }
  };
  struct Sums {
    Float3 moment;
    float mass = 0;
    CUTPROOF_DEVICE Sums operator+(const Sums& other) const { return {moment + other.moment, mass + other.mass}; }
  };
  Sums sums;
  weighted([&](float weight, Float3 x) {
    sums.mass += weight;
    sums.moment = sums.moment + weight * x;
  });
  sums = block.sum(sums);
  const float mass = sums.mass;
  const Float3 moment = sums.moment;
  const Float3 first = {moment.x / mass, moment.y / mass, moment.z / mass};
  Float3 residual;
  weighted([&](float weight, Float3 x) { residual = residual + weight * (x - first); });
  residual = block.sum(residual);
  if (block.thread() == 0) {
    w.mass[s] = mass;
    w.rest_base[3 * s] = base.i;
    w.rest_base[3 * s + 1] = base.j;
    w.rest_base[3 * s + 2] = base.k;
    w.rest_offset[s] = {first.x + residual.x / mass, first.y + residual.y / mass, first.z + residual.z / mass};
    w.rest_dirty[s] = 0;
  }
}

// slots[0 .. *count): a block for each.
template <class Block>
CUTPROOF_DEVICE void recompute_rest_frames_kernel(Block& block, DeviceView w, const int* slots, const int* count) {
  for (int job = block.index(); job < *count; job += block.count()) {
    const int s = slots[job];
    if (w.slot_size[s] > 0) {
      recompute_rest_frame(block, w, s);
    } else if (block.thread() == 0) {
      w.rest_dirty[s] = 0;
    }
  }
}
CUTPROOF_KERNEL(recompute_rest_frames_kernel);

// Every slot whose rest_dirty is set; clears the flags. Flags of slots that are not given out must be 0. Uses
// slot_scratch from 3 · slot_capacity on and Counters::scratch[7].
template <class Launcher>
CUTPROOF_ENQUEUE void enqueue_rest_frames(Launcher& launcher, const DeviceView& w) {
  int* const slots = w.slot_scratch + int64_t{3} * w.slot_capacity;
  int* const count = &w.counters->scratch[7];
  launcher.select(w.rest_dirty, w.slot_capacity, slots, count);
  launcher.blocks(recompute_rest_frames_kernel_object{}, w.slot_capacity, kRestThreads, 0, w,
                  static_cast<const int*>(slots), static_cast<const int*>(count));
}

}  // namespace cutproof::gpu
