// A simulator in single precision, for what is wrong in it: the reference's stages, whose results are rounded to what
// kernels keep.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/backend.h"
#include "reference_cpu/reference.h"

namespace cutproof::tests {

inline double in_single(double value) { return static_cast<double>(static_cast<float>(value)); }
inline Vec3 in_single(Vec3 v) { return {in_single(v.x), in_single(v.y), in_single(v.z)}; }

// What kernels keep: displacements, offsets within the grid, and all else as it is. Rounding twice changes nothing.
inline void round_motion(const Setup& setup, State& state) {
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const Vec3 rest = setup.body.rest_position(static_cast<int32_t>(i));
    state.x[i] = rest + in_single(state.x[i] - rest);
    state.v[i] = in_single(state.v[i]);
  }
}

inline void round_clusters(const Setup& setup, Clusters& clusters) {
  const double h = setup.body.grid.spacing;
  for (Mat3& rotation : clusters.rotation) {
    for (double& entry : rotation.m) entry = in_single(entry);
  }
  for (Vec3& center : clusters.rest_center) {
    for (int axis = 0; axis < 3; ++axis) {
      const double base = std::floor(center[axis] / h);
      center[axis] = h * (base + in_single(center[axis] / h - base));
    }
  }
  for (double& mass : clusters.mass) mass = in_single(mass);
}

inline void round_skin(const Setup& setup, Skin& skin) {
  for (std::size_t v = 0; v < skin.position.size(); ++v) {
    const Vec3 rest = setup.body.rest_position(skin.owner[v]);
    skin.position[v] = rest + in_single(skin.position[v] - rest);
  }
}

// What is wrong with a simulator.
struct Fault {
  std::string name;
  Precision precision = Precision::binary32;                      // in double precision nothing is rounded
  std::function<void(Setup&)> setup = {};                         // what it takes the scene for
  std::function<void(const Setup&, State&)> before_step = {};     // by hand, before the reference's step
  std::function<void(const Setup&, State&)> after_step = {};      // and after it
  std::function<void(const Setup&, Clusters&)> rest_frames = {};  // wherever they are made
  std::function<void(const Setup&, Skin&)> skin = {};             // wherever it is made
};

inline void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

class Simulator final : public Backend {
 public:
  explicit Simulator(Fault fault) : fault_(std::move(fault)) {}

  std::string name() const override { return fault_.name; }
  Precision precision() const override { return fault_.precision; }
  bool can_run(Span) const override { return true; }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = std::move(setups);
    for (std::size_t b = 0; b < states.size(); ++b) {
      State& state = states[b];
      make_rest_frames(setups_[b], state.clusters);
      if (is_double()) continue;
      state.precision = Precision::binary32;
      round_motion(setups_[b], state);
      round_skin(setups_[b], state.skin);
    }
    hand_in(std::move(states));
  }
  void run(Span span) override {
    report_ = {};
    for (const Stage stage : kStages) {
      if (span.contains(stage)) run_stage(stage);
    }
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return report_; }

 private:
  bool is_double() const { return fault_.precision == Precision::binary64; }
  void hand_in(std::vector<State> states) {
    std::vector<Setup> taken_for = setups_;
    if (fault_.setup) std::for_each(taken_for.begin(), taken_for.end(), fault_.setup);
    inner_->load(std::move(taken_for), std::move(states));
  }
  void make_rest_frames(const Setup& setup, Clusters& clusters) const {
    if (fault_.rest_frames) {
      reference::update_rest_frames(setup.body, clusters);
      fault_.rest_frames(setup, clusters);
    }
    if (!is_double()) round_clusters(setup, clusters);
  }
  void change(const std::function<void(const Setup&, State&)>& how) {
    if (!how) return;
    std::vector<State> states = inner_->snapshot();
    for (std::size_t b = 0; b < states.size(); ++b) {
      if (states[b].frame < setups_[b].frame_count()) how(setups_[b], states[b]);
    }
    hand_in(std::move(states));
  }
  void run_stage(Stage stage) {
    if (stage == Stage::step) change(fault_.before_step);
    inner_->run({stage, stage});
    const bool ran = inner_->report().ran[at(stage)];
    report_.ran[at(stage)] = report_.ran[at(stage)] || ran;
    if (!ran && stage != Stage::skin) return;
    if (stage == Stage::step) change(fault_.after_step);
    change([&](const Setup& setup, State& state) {
      if (stage == Stage::step && !is_double()) {
        round_motion(setup, state);
        round_clusters(setup, state.clusters);
      } else if (stage == Stage::skin) {
        if (ran && fault_.skin) fault_.skin(setup, state.skin);
        if (!is_double()) round_skin(setup, state.skin);
      } else if (stage > Stage::detect) {
        make_rest_frames(setup, state.clusters);
      }
    });
  }

  Fault fault_;
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  std::vector<Setup> setups_;
  SpanReport report_;
};

}  // namespace cutproof::tests
