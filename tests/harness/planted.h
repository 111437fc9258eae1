// A backend in which a deviation is planted, beside the reference: for the tests of lockstep and of free runs.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fixtures/build.h"
#include "harness/against.h"
#include "model/io/scene_io.h"
#include "reference_cpu/reference.h"

namespace cutproof::harness {

using oracles::Measure;

using Fault = std::function<void(const cutproof::Setup&, State&)>;

// A backend that is right but for what is planted: the state is changed after one stage of one frame (fault) or before
// it (bias), and the backend goes on from there; or the stage is left out.
class Planted final : public Backend {
 public:
  Planted(std::unique_ptr<Backend> inner, Stage stage, int64_t frame, Fault fault, Fault bias = {}, bool skip = false)
      : inner_(std::move(inner)), stage_(stage), frame_(frame), fault_(fault), bias_(bias), skip_(skip) {}

  std::string name() const override { return "planted"; }
  Precision precision() const override { return inner_->precision(); }
  bool can_run(Span span) const override { return span.first == span.last; }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    const bool here = span.first == stage_ && inner_->snapshot().front().frame == frame_;
    if (here && bias_) change(bias_);
    if (here && skip_) {
      report_ = {};
      return;
    }
    inner_->run(span);
    report_ = inner_->report();
    if (here && fault_) change(fault_);
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return report_; }

 private:
  void change(const Fault& fault) {
    std::vector<State> states = inner_->snapshot();
    fault(setups_.front(), states.front());
    inner_->load(setups_, std::move(states));
  }
  std::unique_ptr<Backend> inner_;
  Stage stage_;
  int64_t frame_;
  Fault fault_, bias_;
  bool skip_;
  std::vector<Setup> setups_;
  SpanReport report_;
};

inline fixtures::Built build(const std::string& name, std::optional<int64_t> particles = {}) {
  const std::string file = CUTPROOF_SOURCE "/fixtures/scenes/" + name + ".json";
  fixtures::BuildOptions options;
  options.particles = particles;
  return fixtures::build(io::read_scene(file), file, options);
}

// Runs at most `frames` frames. `precision`: of the state that is loaded, so that the comparison allows for at least
// that.
inline Against compare(Backend& backend, fixtures::Built& built, int64_t frames, AgainstMode mode = AgainstMode::both,
                       Precision precision = Precision::binary64) {
  built.state.precision = precision;
  backend.load({built.setup}, {built.state});
  Against against(built.setup, built.state, backend.snapshot().front(), backend.name(), mode);
  for (int64_t frame = 0; frame < std::min(frames, built.setup.frame_count()); ++frame) {
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      against.see(stage, backend.snapshot().front(), backend.report().ran[static_cast<std::size_t>(stage)]);
    }
  }
  return against;
}

inline Verdict verdict_named(const Against& against, const std::string& name) {
  for (const Verdict& verdict : against.verdicts()) {
    if (verdict.property == name) return verdict;
  }
  ADD_FAILURE() << "no verdict named " << name;
  return {};
}

inline std::string failures(const Against& against) {
  std::string text;
  for (const Verdict& verdict : against.verdicts()) {
    if (!verdict.holds) text += verdict.property + ": " + verdict.witness.text + "\n";
  }
  return text;
}

inline constexpr int64_t kFrame = 6;  // of three_cuts, in which particles are removed and clusters merged
inline constexpr int32_t kParticle = 40;

// The scene in which it is planted.
inline fixtures::Built& scene() {
  static fixtures::Built built = build("three_cuts");
  return built;
}

inline Against plant(Stage stage, Fault fault, Fault bias = {}, bool skip = false) {
  Planted backend(reference::make_backend(), stage, kFrame, std::move(fault), std::move(bias), skip);
  return compare(backend, scene(), kFrame + 3);
}

inline void expect_found(const Against& against, const std::string& property, Stage stage, int64_t frame = kFrame) {
  EXPECT_FALSE(against.holds());
  const Verdict verdict = verdict_named(against, property);
  EXPECT_FALSE(verdict.holds) << failures(against);
  EXPECT_EQ(verdict.stage, stage) << failures(against);
  EXPECT_EQ(verdict.frame, frame) << failures(against);
  EXPECT_FALSE(verdict.witness.text.empty());
}

// In lockstep a deviation shows in its own frame only: everything but this property must hold.
// But for what a step that is off violates besides: it is not admissible.
inline void expect_nothing_else(const Against& against, const std::string& property) {
  const bool of_step = verdict_named(against, property).stage == Stage::step;
  for (const Verdict& verdict : against.verdicts()) {
    EXPECT_TRUE(verdict.holds || verdict.property == property ||
                (of_step && verdict.property == "lockstep: admissible step") ||
                verdict.property.starts_with("free-running"))
        << verdict.property << ": " << verdict.witness.text;
  }
}

}  // namespace cutproof::harness
