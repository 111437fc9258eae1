#include <array>
#include <chrono>
#include <utility>

#include "gpu/backends.h"
#include "gpu/launch/frame.h"
#include "gpu/state/staging.h"

namespace cutproof::gpu {

namespace {

using Clock = std::chrono::steady_clock;

class HostBackend final : public Backend {
 public:
  HostBackend(std::string name, HostLauncher launcher, KernelOptions options)
      : name_(std::move(name)), launcher_(std::move(launcher)), options_(options) {}

  std::string name() const override { return name_; }
  Precision precision() const override { return Precision::binary32; }
  bool can_run(Span) const override { return true; }

  void load(std::vector<Setup> setups, std::vector<State> states) override {
    load_with(Capacity{options_.room}, std::move(setups), std::move(states));
  }

  void run(Span span) override {
    if (wants_capacity(view_, staging_.counters.front())) {
      std::vector<State> states = snapshot();
      load_with(Capacity{2 * capacity_.factor}, std::move(setups_), std::move(states));
    }
    report_ = {};
    if (span.contains(Stage::skin)) skins_.assign(setups_.size(), std::nullopt);
    // Work is done when it is handed over, so the time between two marks is that of the stage between them.
    const auto begin = Clock::now();
    auto since = begin;
    int stage = -1;
    const auto close = [&](Clock::time_point now) {
      if (stage >= 0) report_.seconds[static_cast<std::size_t>(stage)] += seconds(now - since);
      since = now;
    };
    enqueue_span(launcher_, view_, plan_, span, [&](Stage next) {
      close(Clock::now());
      stage = static_cast<int>(next);
    });
    const auto end = Clock::now();
    close(end);
    report_.total_seconds = seconds(end - begin);
    const Counters& counters = staging_.counters.front();
    for (std::size_t s = 0; s < 6; ++s) report_.ran[s] = counters.stage_ran[s] != 0;
    require_no_fault(counters);
  }

  std::vector<State> snapshot() const override { return snapshot_of(std::vector<bool>(setups_.size(), true)); }
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const override {
    return extract_states(staging_, setups_, wanted, skins_);
  }
  SpanReport report() const override { return report_; }

 private:
  void load_with(Capacity room, std::vector<Setup> setups, std::vector<State> states) {
    StagingBuffers staging = make_staging_buffers(setups, states, options_.rotation_method, room);
    plan_ = make_plan(setups, states, options_.rotation_method, options_.split);
    staging_ = std::move(staging);
    setups_ = std::move(setups);
    view_ = staging_.view();
    skins_.assign(setups_.size(), std::nullopt);
    report_ = {};
    capacity_ = room;
  }
  static double seconds(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

  std::string name_;
  HostLauncher launcher_;
  KernelOptions options_;
  Capacity capacity_;
  std::vector<Setup> setups_;
  StagingBuffers staging_;
  DeviceView view_;
  Plan plan_;
  SpanReport report_;
  mutable KnownSkins skins_;  // of the last skin stage, as far as snapshots have asked for them
};

}  // namespace

std::unique_ptr<Backend> make_host_backend(int threads, KernelOptions options) {
  return std::make_unique<HostBackend>("host", HostLauncher(HostLauncher::Threads{threads}), options);
}

std::unique_ptr<Backend> make_simulated_backend(HostLauncher::Simulated simulation, KernelOptions options) {
  return std::make_unique<HostBackend>("host simulated", HostLauncher(std::move(simulation)), options);
}

}  // namespace cutproof::gpu
