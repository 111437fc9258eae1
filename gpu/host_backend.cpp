#include <chrono>
#include <utility>

#include "gpu/backends.h"
#include "gpu/frame.h"

namespace cutproof::gpu {

namespace {

using Clock = std::chrono::steady_clock;

class HostBackend final : public KernelBackend {
 public:
  HostBackend(std::string name, HostLauncher launcher, KernelOptions options)
      : name_(std::move(name)), launcher_(std::move(launcher)), options_(options) {}

  std::string name() const override { return name_; }
  Precision precision() const override { return Precision::binary32; }
  bool shows_iterates() const override { return true; }
  bool can_run(Span) const override { return true; }

  void load(std::vector<Setup> setups, std::vector<State> states) override {
    take(Load(std::move(setups), states, options_, options_.capacity));
  }

  void run(Span span) override {
    if (wants_capacity(view_, load_.staging.counters.front())) take(load_.enlarged(snapshot(), options_));
    report_ = {};
    if (span.contains(Stage::skin)) load_.forget_skins();
    // Work is synchronous, so the time between two marks is that of the stage between them.
    const auto begin = Clock::now();
    auto since = begin;
    int stage = -1;
    const auto close = [&](Clock::time_point now) {
      if (stage >= 0) report_.seconds[static_cast<std::size_t>(stage)] += seconds(now - since);
      since = now;
    };
    if (load_.needs_groups(span)) enqueue_groups_if_stale(launcher_, view_);
    enqueue_span(launcher_, view_, load_.plan, span, [&](Stage next) {
      close(Clock::now());
      stage = static_cast<int>(next);
    });
    const auto end = Clock::now();
    close(end);
    report_.total_seconds = seconds(end - begin);
    const Counters& counters = load_.staging.counters.front();
    for (std::size_t s = 0; s < 6; ++s) report_.ran[s] = counters.stage_ran[s] != 0;
    require_no_fault(counters);
  }

  std::vector<State> snapshot() const override { return snapshot_of(std::vector<bool>(load_.setups.size(), true)); }
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const override { return load_.states_of(wanted); }
  SpanReport report() const override { return report_; }
  StepWork step_work() const override {
    return step_work_of(load_.staging.counters.front(), view_.group_head,
                        load_.plan.contacts ? view_.group_resolved : nullptr, view_.loose_places);
  }

 private:
  void take(Load load) {
    load_ = std::move(load);
    load_.staging.allocate(true);
    view_ = load_.staging.view();
    report_ = {};
  }
  static double seconds(Clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

  std::string name_;
  HostLauncher launcher_;
  KernelOptions options_;
  mutable Load load_;  // snapshots add to its skins
  DeviceView view_;
  SpanReport report_;
};

}  // namespace

std::unique_ptr<Backend> make_host_backend(int threads, KernelOptions options, int of_block) {
  const HostLauncher::Threads mode = {.count = threads, .of_block = of_block};
  return std::make_unique<HostBackend>(of_block == 1 ? "host" : "host-blocks", HostLauncher(mode), options);
}

std::unique_ptr<Backend> make_simulated_backend(HostLauncher::Simulated simulation, KernelOptions options) {
  return std::make_unique<HostBackend>("host simulated", HostLauncher(std::move(simulation)), options);
}

}  // namespace cutproof::gpu
