#include "model/io/state_segments.h"

#include <algorithm>
#include <utility>

#include "model/at.h"
#include "model/precision.h"

namespace cutproof::io {
namespace {

Array vectors(std::string name, const std::vector<Vec3>& all, std::vector<int64_t> shape) {
  std::vector<double> numbers;
  for (const Vec3 x : all) numbers.insert(numbers.end(), {x.x, x.y, x.z});
  return make_array(std::move(name), std::move(shape), numbers);
}
Array number(std::string name, double value) { return make_array<double>(std::move(name), {}, {value}); }

// Arrays that are given once: the body and the parameters of its simulation.
void add_once(const Setup& setup, Precision precision, Arrays& arrays) {
  const Body& body = setup.body;
  const int64_t n = body.particle_count();
  std::vector<Vec3> rest;
  std::vector<int32_t> edges;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    rest.push_back(body.rest_position(i));
    for (const int32_t other : body.neighbours(i)) {
      if (other > i) edges.insert(edges.end(), {i, other});
    }
  }
  arrays.push_back(vectors("rest", rest, {n, 3}));
  arrays.push_back(make_array("mass", {n}, body.mass));
  arrays.push_back(make_array("edges", {std::ssize(edges) / 2, 2}, edges));
  arrays.push_back(vectors("gravity", {setup.step.gravity}, {3}));
  arrays.push_back(number("spacing", body.grid.spacing));
  arrays.push_back(number("damping", setup.step.damping));
  arrays.push_back(number("unit_roundoff", unit_roundoff(precision)));
  arrays.push_back(make_array<int64_t>("steps", {}, {setup.step.substeps}));
}

// Whom a grip holds in some substep of the frame.
std::vector<uint8_t> held_in(const Setup& setup, int64_t frame) {
  std::vector<uint8_t> held(at(setup.body.particle_count()), 0);
  const int64_t substeps = setup.step.substeps;
  for (const Grip& grip : setup.grips) {
    for (int64_t s = frame * substeps; s < (frame + 1) * substeps && s < std::ssize(grip.active); ++s) {
      if (grip.active[at(s)] == 0) continue;
      for (const int32_t particle : grip.particles) held[at(particle)] = 1;
      break;
    }
  }
  return held;
}

}  // namespace

ArrayFile StateSegments::next(const State& state) {
  const bool is_first = !std::exchange(has_begun_, true);
  const int64_t frame = state.frame - 1, n = setup_.body.particle_count();
  ArrayFile made;
  Arrays& arrays = made.arrays;
  if (is_first) add_once(setup_, precision_, arrays);
  arrays.push_back(vectors("positions", state.x, {n, 3}));
  arrays.push_back(vectors("velocities", state.v, {n, 3}));
  arrays.push_back(make_array("alive", {n}, state.alive));
  if (!is_first && frame >= 0 && frame < setup_.frame_count()) {
    time_ += setup_.substep_length[at(frame)] * setup_.step.substeps;
    arrays.push_back(make_array("held", {n}, held_in(setup_, frame)));
    arrays.push_back(vectors("contact_impulse", {state.impulse}, {3}));
  }
  arrays.push_back(number("time", time_));
  const Clusters& clusters = state.clusters;
  if (is_first || clusters.offsets != offsets_ || clusters.members != members_) {
    arrays.push_back(make_array("groups_offsets", {std::ssize(clusters.offsets)}, clusters.offsets));
    arrays.push_back(make_array("groups_members", {std::ssize(clusters.members)}, clusters.members));
    offsets_ = clusters.offsets;
    members_ = clusters.members;
  }
  if (with_skin_ == WithSkin::yes && !state.skin.triangles.empty()) {
    std::vector<int32_t> corners;
    for (const auto& triangle : state.skin.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
    arrays.push_back(vectors("vertices", state.skin.position, {std::ssize(state.skin.position), 3}));
    arrays.push_back(make_array("triangles", {std::ssize(corners) / 3, 3}, corners));
  }
  return made;
}

}  // namespace cutproof::io
