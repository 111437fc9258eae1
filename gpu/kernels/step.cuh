// Stage step (method.md §3): position-based dynamics with shape matching, one DeviceView of bodies.
//
// A substep is K times two kernels: match_shapes (a few clusters per block: sums, rotations, centres) and
// update_positions (a thread per particle: the mean over its clusters, contacts). The last update of a substep also
// makes the velocity and begins the next substep, so nothing else is launched but the grips' kernel.
//
// Everything is a displacement from rest: with d = x - X,  t_c - T_c = Σ w d / M,  and the goal of particle i in
// cluster c lies at X_i + (t_c - T_c) + (R_c - I)(X_i - T_c). A body at rest or moved as a whole is then reproduced
// exactly: d is the same everywhere, all sums of differences are zero, and R_c is I to the last bit.
#pragma once
#include "gpu/kernels/contacts.cuh"
#include "gpu/kernels/float3.h"
#include "gpu/kernels/rotation.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/plan.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

namespace step_detail {

// Whether body b takes part in this iteration. A body with fewer substeps or iterations than others waits.
CUTPROOF_DEVICE inline bool takes_part(const DeviceView& w, int b, int substep, int iteration) {
  return running(w, b) && substep < w.body[b].substeps && iteration < w.body[b].iterations;
}

CUTPROOF_DEVICE inline int body_index(const DeviceView& w, int p) { return w.bodies == 1 ? 0 : w.body_of[p]; }

CUTPROOF_DEVICE inline Float3 grid_node(const BodyConstants& body, int node) {
  const Coordinates c = coordinates(body, node);
  return {static_cast<float>(c.i), static_cast<float>(c.j), static_cast<float>(c.k)};
}

// (X_p - T_s) / h. The difference of grid coordinates is exact.
CUTPROOF_DEVICE inline Float3 nodes_from_rest_center(const DeviceView& w, Coordinates c, int s) {
  const Float3 o = w.rest_offset[s];
  return {static_cast<float>(c.i - w.rest_base[3 * s]) - o.x, static_cast<float>(c.j - w.rest_base[3 * s + 1]) - o.y,
          static_cast<float>(c.k - w.rest_base[3 * s + 2]) - o.z};
}

// e^(-x) for x >= 0, within 2 units in the last place, by operations that give the same bits on every machine (the
// libraries' expf do not).
CUTPROOF_DEVICE inline float decay_by(float x) {
  if (x > 87.0f) return 0.0f;  // e^(-87) is the last above the least normal number
  const float n = rintf(x * -1.44269504f);
  // ln 2 in two parts, the first short enough for n times it to be exact.
  const float r = fmaf(n, -1.42860677e-6f, fmaf(n, -0.693145752f, -x));
  float sum = 1.0f / 5040.0f;
  sum = fmaf(sum, r, 1.0f / 720.0f);
  sum = fmaf(sum, r, 1.0f / 120.0f);
  sum = fmaf(sum, r, 1.0f / 24.0f);
  sum = fmaf(sum, r, 1.0f / 6.0f);
  sum = fmaf(sum, r, 0.5f);
  sum = fmaf(sum, r, 1.0f);
  sum = fmaf(sum, r, 1.0f);
  return ldexpf(sum, static_cast<int>(n));
}

// ---- match shapes

// Sums over the members of a cluster, with e = d - (d of the first member) and r = (X - T) / h:
//   [0..2] Σ w e   [3..5] Σ w r   [6] Σ w   [7..15] Σ w (r + e / h) rᵀ
// The products r_i r_j are formed first, so that at rest the last is symmetric to the bit and R is I.
inline constexpr int kSums = 16;
// Members are dealt out to kParts · 32 lanes, whatever the block looks like and however many clusters it has: the
// order of a sum, and so its bits, depends on the cluster alone. Blocks have kParts warps on the device; with one
// cluster for a block each warp takes a part, otherwise each warp takes all parts of its own clusters in turn.
inline constexpr int kParts = 4;
inline constexpr int kMatchThreads = 32 * kParts;
// Clusters that a block holds at once; their rotations are computed side by side by the lanes of one warp.
inline constexpr int kBatch = 32;
// Blocks that are worth starting: enough to fill any device, few enough that large bodies have full batches.
inline constexpr int kMatchBlocks = 2048;
inline constexpr std::size_t kMatchShared = (kBatch * kSums + (kParts - 1) * 32 * kSums) * sizeof(float);

template <int N>
struct Floats {
  float v[N];
};

CUTPROOF_DEVICE inline Floats<kSums> sum_part(const DeviceView& w, const BodyConstants& body, int s, int part,
                                              int lane) {
  Floats<kSums> sums = {};
  const int begin = w.slot_begin[s], end = begin + w.slot_size[s];
  const Float3 base = xyz(w.displacement[w.members[begin]]);
  const float per_h = 1.0f / body.h;
  const Float3 offset = w.rest_offset[s];
  const int base_i = w.rest_base[3 * s], base_j = w.rest_base[3 * s + 1], base_k = w.rest_base[3 * s + 2];
  for (int q = begin + 32 * part + lane; q < end; q += 32 * kParts) {
    const int p = w.members[q];
    const Float4 now = w.displacement[p];
    const Coordinates c = coordinates(body, w.node[p]);
    const float weight = now.w / static_cast<float>(w.membership_count[p]);
    const Float3 e = xyz(now) - base;
    const Float3 r = {static_cast<float>(c.i - base_i) - offset.x, static_cast<float>(c.j - base_j) - offset.y,
                      static_cast<float>(c.k - base_k) - offset.z};
    const Float3 y = r + per_h * e;
    sums.v[0] += weight * e.x;
    sums.v[1] += weight * e.y;
    sums.v[2] += weight * e.z;
    sums.v[3] += weight * r.x;
    sums.v[4] += weight * r.y;
    sums.v[5] += weight * r.z;
    sums.v[6] += weight;
    sums.v[7] += weight * (y.x * r.x);
    sums.v[8] += weight * (y.x * r.y);
    sums.v[9] += weight * (y.x * r.z);
    sums.v[10] += weight * (y.y * r.x);
    sums.v[11] += weight * (y.y * r.y);
    sums.v[12] += weight * (y.y * r.z);
    sums.v[13] += weight * (y.z * r.x);
    sums.v[14] += weight * (y.z * r.y);
    sums.v[15] += weight * (y.z * r.z);
  }
  return sums;
}

// Centre and rotation of a cluster from its sums.
template <int Method>
CUTPROOF_DEVICE inline void place_cluster(const DeviceView& w, int s, const float* sums) {
  const BodyConstants& body = w.body[w.slot_body[s]];
  const Float3 moved = {sums[0], sums[1], sums[2]}, rest = {sums[3], sums[4], sums[5]};
  const float mass = sums[6];
  // A = Σ w (x - t)(X - T)ᵀ / h². The rest moment is zero but for the rounding of T.
  const Float3 shift = (1.0f / (mass * body.h)) * moved;
  Matrix3 a;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) a(row, k) = sums[7 + 3 * row + k] - shift[row] * rest[k];
  }
  // One particle has no extent: what is left of A is rounding, and rotate() would make a rotation of it.
  Rotation best{w.rotation[s], true};
  if (w.slot_size[s] > 1) best = rotate<Method>(a, w.rotation[s]);
  w.rotation[s] = best.r;
  w.degenerate[s] = best.degenerate;
  // Such that Σ w (goal) = Σ w x to the rounding of these two sums (docs/design/decisions.md, Momentum and the rounding
  // of sums): the rounded T must not push the cluster.
  const Float3 turned = best.r * rest - rest;
  const Float3 base = xyz(w.displacement[w.members[w.slot_begin[s]]]);
  w.center[s] = base + (1.0f / mass) * (moved - body.h * turned);
}

}  // namespace step_detail

template <int Method, class Block>
CUTPROOF_DEVICE void match_shapes_kernel(Block& block, const DeviceView& w, int substep, int iteration) {
  using namespace step_detail;
  float* sums = block.template shared<float>(kBatch * kSums);
  float* parts = block.template shared<float>((kParts - 1) * 32 * kSums);
  const int warps = block.size() / 32, warp = block.thread() / 32, lane = block.lane();
  const int slots = w.counters->slots_used;
  int batch = (slots + block.count() - 1) / block.count();
  batch = batch < 1 ? 1 : batch > kBatch ? kBatch : batch;
  const bool together = batch == 1 && warps == kParts;
  const auto wanted = [&](int s) { return w.slot_size[s] > 0 && takes_part(w, w.slot_body[s], substep, iteration); };

  for (int64_t begin = static_cast<int64_t>(block.index()) * batch; begin < slots;
       begin += static_cast<int64_t>(block.count()) * batch) {
    const int first = static_cast<int>(begin);
    const int count = slots - first < batch ? slots - first : batch;
    if (together) {
      const bool work = wanted(first);
      Floats<kSums> mine;
      if (work) mine = sum_part(w, w.body[w.slot_body[first]], first, warp, lane);
      if (work && warp > 0) {
        for (int k = 0; k < kSums; ++k) parts[((warp - 1) * kSums + k) * 32 + lane] = mine.v[k];
      }
      block.sync();
      if (work && warp == 0) {
        for (int part = 1; part < kParts; ++part) {
          for (int k = 0; k < kSums; ++k) mine.v[k] += parts[((part - 1) * kSums + k) * 32 + lane];
        }
        const float total = block.warp_sums(mine.v);
        if (lane % 2 == 0) sums[lane / 2] = total;
      }
    } else {
      for (int k = warp; k < count; k += warps) {
        const int s = first + k;
        if (!wanted(s)) continue;
        const BodyConstants& body = w.body[w.slot_body[s]];
        Floats<kSums> mine = sum_part(w, body, s, 0, lane);
        for (int part = 1; part < kParts && 32 * part < w.slot_size[s]; ++part) {
          const Floats<kSums> more = sum_part(w, body, s, part, lane);
          for (int j = 0; j < kSums; ++j) mine.v[j] += more.v[j];
        }
        const float total = block.warp_sums(mine.v);
        if (lane % 2 == 0) sums[k * kSums + lane / 2] = total;
      }
    }
    block.sync();
    for (int k = block.thread(); k < count; k += block.size()) {
      if (wanted(first + k)) place_cluster<Method>(w, first + k, sums + k * kSums);
    }
    block.sync();
  }
}

template <int Method>
struct match_shapes_kernel_object {
  static constexpr const char* kName = "match_shapes_kernel";
  static constexpr int kMaxThreads = step_detail::kMatchThreads;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep, int iteration) const {
    match_shapes_kernel<Method>(block, w, substep, iteration);
  }
};

// ---- particles

namespace step_detail {

// Predicts particle p, which is at d with velocity v, and puts it where contacts let it be. Grips come after this.
template <bool kContacts>
CUTPROOF_DEVICE inline void begin_substep(const DeviceView& w, const BodyConstants& body, int p, int frame, int substep,
                                          float dt, Float3 d, Float3 v, float mass) {
  const Float3 predicted = d + (dt * v + (dt * dt) * body.gravity);
  w.start[p] = with_w(d, 0.0f);
  if constexpr (kContacts) {
    const Contacts contacts = contacts_of(w, body, frame, substep);
    const RestPoint rest = {body.h, grid_node(body, w.node[p])};
    const float side = blade_side(contacts, rest, d);
    bool in_turn = false;  // of no interest: there is no earlier point to compare with
    const Float3 x = project(contacts, rest, predicted, side, d, in_turn);
    w.predicted[p] = with_w(predicted, side);
    w.displacement[p] = with_w(x, mass);
    w.pushed[p] = with_w(x - predicted, 0.0f);
  } else {
    w.predicted[p] = with_w(predicted, 1.0f);
    w.displacement[p] = with_w(predicted, mass);
  }
}

// Chebyshev semi-iteration (docs/design/method.md §11), order >= 1: x + pull (g - x) + carry (x - earlier), with g
// where the plain iteration goes from x. The recurrence of the weights in closed form: omega_j = (1 + q) (1 + q^(j-1))
// / (1 + q^j) for j >= 2, with q = ((1 - r) / (1 + r))², r² = 1 - b.
struct Combination {
  float pull, carry;
  CUTPROOF_DEVICE Float3 operator()(Float3 plain, Float3 now, Float3 earlier) const {
    return now + (pull * (plain - now) + carry * (now - earlier));
  }
};

// 1 - b: the eigenvalues that the weights are made for are those of [0, b], b = min(s, 0.95).
inline constexpr float kLeastGap = 0.05f;

CUTPROOF_DEVICE inline Combination chebyshev(float kdt2, int order) {
  const float gap = 1.0f / (1.0f + kdt2);
  const float r2 = gap > kLeastGap ? gap : kLeastGap;
  const float r = sqrtf(r2);
  const float root = (1.0f - r) / (1.0f + r);
  const float q = root * root;
  float omega = 1;
  if (order > 1) {
    float power = 1, square = q;  // power: q^(order - 1)
    for (int n = order - 1; n > 0; n /= 2) {
      if (n % 2 != 0) power *= square;
      square *= square;
    }
    omega = (1.0f + q) * (1.0f + power) / (1.0f + q * power);
  }
  return {omega * (2.0f / (1.0f + r2)), omega - 1.0f};
}

CUTPROOF_DEVICE inline float substep_length(const DeviceView& w, const BodyConstants& body, int frame) {
  return w.substep_length[body.frame_begin + frame];
}

}  // namespace step_detail

// Clears what a frame counts and begins the first substep.
template <bool kContacts, class Block>
CUTPROOF_DEVICE void begin_frame_kernel(Block& block, const DeviceView& w) {
  using namespace step_detail;
  if (block.first() == 0) {
    w.counters->removed = 0;
    w.counters->debris = 0;
    w.counters->affected = 0;
  }
  for (int64_t b = block.first(); b < w.bodies; b += block.stride()) {
    if (running(w, static_cast<int>(b))) w.cut[b] = -1;
  }
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    const int b = body_index(w, p);
    if (!running(w, b)) continue;
    const BodyConstants& body = w.body[b];
    const int frame = w.frame[b];
    // Every frame counts its own impulse and removals.
    w.impulse[p] = Float4{};
    const int death = w.death[p];
    if (death >= 0) {
      if (death >= 2 * frame && death != kDeadBefore) w.death[p] = kDeadBefore;
      continue;
    }
    begin_substep<kContacts>(w, body, p, frame, 0, substep_length(w, body, frame), xyz(w.displacement[p]),
                             xyz(w.velocity[p]), w.displacement[p].w);
  }
}

// Puts the particles that are held in this substep where their grip moves them.
template <class Block>
CUTPROOF_DEVICE void hold_particles_kernel(Block& block, const DeviceView& w, int substep) {
  for (int b = 0; b < w.bodies; ++b) {
    const BodyConstants& body = w.body[b];
    if (!running(w, b) || substep >= body.substeps) continue;
    for (int g = body.grip_begin; g < body.grip_end; ++g) {
      const GripF grip = w.grips[g];
      const int64_t entry = grip.table + static_cast<int64_t>(w.frame[b]) * body.substeps + substep;
      if (!w.grip_active[entry]) continue;
      const Float3 moved = w.grip_displacement[entry];
      for (int64_t k = grip.particle_begin + block.first(); k < grip.particle_end; k += block.stride()) {
        const int p = w.grip_particles[k];
        if (!alive(w, p)) continue;
        const Float3 x = xyz(w.start[p]) + moved;
        const Float3 predicted = xyz(w.predicted[p]);
        w.predicted[p] = with_w(predicted, 0.0f);
        w.displacement[p] = with_w(x, w.displacement[p].w);
        w.pushed[p] = with_w(x - predicted, 0.0f);
      }
    }
  }
}
CUTPROOF_KERNEL(hold_particles_kernel);

template <bool kContacts, bool kAccelerated, class Block>
CUTPROOF_DEVICE void update_positions_kernel(Block& block, const DeviceView& w, int substep, int iteration) {
  using namespace step_detail;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    const int b = body_index(w, p);
    const BodyConstants& body = w.body[b];
    // A body without iterations still has one update, which moves nothing and ends the substep.
    const int updates = body.iterations > 0 ? body.iterations : 1;
    if (!running(w, b) || substep >= body.substeps || iteration >= updates || !alive(w, p)) continue;
    const int frame = w.frame[b];
    const float dt = substep_length(w, body, frame);
    const Float4 now = w.displacement[p];
    const Float3 x = xyz(now);
    Float3 next = x;
    Float4 pushed;

    if (body.iterations > 0) {
      const bool implicit = body.solver == Solver::implicit;
      const float kdt2 = body.stiffness * dt * dt;
      const float s = implicit ? kdt2 / (1.0f + kdt2) : body.relaxation;
      const Float4 predicted = w.predicted[p];
      const Float3 from = implicit ? xyz(predicted) : x;
      // Mean of the goals, less `from`: small numbers, so that summing them costs no digits of d.
      const int clusters = w.membership_count[p];
      Float3 pull = x - from;  // a particle in no cluster stays where it is
      if (clusters > 0) {
        const Coordinates c = coordinates(body, w.node[p]);
        Float3 sum;
        const int end = w.membership_begin[p + 1];
        for (int k = w.membership_begin[p]; k < end; ++k) {
          const int slot = w.memberships[k];
          if (slot < 0) continue;
          const Float3 r = body.h * nodes_from_rest_center(w, c, slot);
          Matrix3 turn = w.rotation[slot];
          turn(0, 0) -= 1.0f;
          turn(1, 1) -= 1.0f;
          turn(2, 2) -= 1.0f;
          sum = sum + ((w.center[slot] - from) + turn * r);
        }
        pull = (1.0f / static_cast<float>(clusters)) * sum;
      }
      const Float3 plain = from + s * pull;
      Float3 free = plain;
      // The first iteration is plain, and the last has no next one to keep anything for.
      [[maybe_unused]] const bool combined = body.acceleration == Acceleration::chebyshev && iteration > 0;
      [[maybe_unused]] const bool kept = body.acceleration == Acceleration::chebyshev && iteration + 1 < updates;
      [[maybe_unused]] Combination combination;
      if constexpr (kAccelerated) {
        if (combined) {
          combination = chebyshev(kdt2, iteration);
          free = combination(plain, x, xyz(w.earlier[p]));
        }
        if (kept) w.earlier[p] = now;
      }
      next = free;
      if constexpr (kContacts) {
        pushed = w.pushed[p];
        if (predicted.w == 0) {
          next = x;  // a held particle stays where its grip has put it
        } else {
          const Contacts contacts = contacts_of(w, body, frame, substep);
          const RestPoint rest = {body.h, grid_node(body, w.node[p])};
          const Float3 start = xyz(w.start[p]);
          next = next_position(contacts, rest, free, predicted.w, start, x);
          if constexpr (kAccelerated) {
            // Where several answers are right, the way there decides: touched particles go the plain way.
            if (combined && path_matters(contacts)) {
              const bool touched = contacts_detail::touches(contacts, rest, free, predicted.w) ||
                                   contacts_detail::touches(contacts, rest, plain, predicted.w);
              if (touched) next = next_position(contacts, rest, plain, predicted.w, start, x);
            }
          }
        }
        const Float3 before = xyz(pushed);
        Float3 carried = (implicit ? s : 1.0f) * before;
        if constexpr (kAccelerated) {
          if (combined) carried = combination(carried, before, xyz(w.pushed_earlier[p]));
          if (kept) w.pushed_earlier[p] = pushed;
        }
        pushed = with_w(carried + (next - free), 0.0f);
      }
    } else if constexpr (kContacts) {
      pushed = w.pushed[p];
    }

    if (iteration + 1 < updates) {
      w.displacement[p] = with_w(next, now.w);
      if constexpr (kContacts) w.pushed[p] = pushed;
      continue;
    }
    const float decay = decay_by(body.damping * dt);
    const Float3 v = (decay / dt) * (next - xyz(w.start[p]));
    if constexpr (kContacts) {
      w.impulse[p] = with_w(decay * (xyz(w.impulse[p]) + (1.0f / dt) * xyz(pushed)), 0.0f);
    }
    if (substep + 1 < body.substeps) {
      begin_substep<kContacts>(w, body, p, frame, substep + 1, dt, next, v, now.w);
    } else {
      w.displacement[p] = with_w(next, now.w);
      w.velocity[p] = with_w(v, 0.0f);
    }
  }
}

template <bool kContacts>
struct begin_frame_kernel_object {
  static constexpr const char* kName = "begin_frame_kernel";
  static constexpr int kMaxThreads = 256;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    begin_frame_kernel<kContacts>(block, w);
  }
};
template <bool kContacts, bool kAccelerated>
struct update_positions_kernel_object {
  static constexpr const char* kName = "update_positions_kernel";
  static constexpr int kMaxThreads = 256;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep, int iteration) const {
    update_positions_kernel<kContacts, kAccelerated>(block, w, substep, iteration);
  }
};

namespace step_detail {

template <int Method, bool kContacts, bool kAccelerated, class Launcher>
void enqueue(Launcher& launcher, const DeviceView& w, const Plan& plan) {
  const int64_t particles = w.particles > w.bodies ? w.particles : w.bodies;
  const int64_t jobs = w.slot_capacity < kMatchBlocks ? w.slot_capacity : kMatchBlocks;
  launcher.items(begin_frame_kernel_object<kContacts>{}, particles, w);
  for (int substep = 0; substep < plan.substeps; ++substep) {
    if (plan.grips) launcher.items(hold_particles_kernel_object{}, particles, w, substep);
    for (int iteration = 0; iteration < plan.iterations || iteration == 0; ++iteration) {
      if (iteration < plan.iterations) {
        launcher.blocks(match_shapes_kernel_object<Method>{}, jobs, kMatchThreads, kMatchShared, w, substep, iteration);
      }
      launcher.items(update_positions_kernel_object<kContacts, kAccelerated>{}, particles, w, substep, iteration);
    }
  }
}

template <int Method, class Launcher>
void enqueue(Launcher& launcher, const DeviceView& w, const Plan& plan) {
  if (plan.contacts && plan.accelerated) {
    enqueue<Method, true, true>(launcher, w, plan);
  } else if (plan.contacts) {
    enqueue<Method, true, false>(launcher, w, plan);
  } else if (plan.accelerated) {
    enqueue<Method, false, true>(launcher, w, plan);
  } else {
    enqueue<Method, false, false>(launcher, w, plan);
  }
}

}  // namespace step_detail

// All substeps of the frame of every running body.
template <class Launcher>
void enqueue_step(Launcher& launcher, const DeviceView& w, const Plan& plan) {
  switch (w.rotation_method) {
    case kMueller2016:
      return step_detail::enqueue<kMueller2016>(launcher, w, plan);
    case kApd:
      return step_detail::enqueue<kApd>(launcher, w, plan);
    case kSvd:
      return step_detail::enqueue<kSvd>(launcher, w, plan);
    case kQuest:
      return step_detail::enqueue<kQuest>(launcher, w, plan);
    case kNewton:
      return step_detail::enqueue<kNewton>(launcher, w, plan);
    default:
      return step_detail::enqueue<kJacobi4>(launcher, w, plan);
  }
}

}  // namespace cutproof::gpu
