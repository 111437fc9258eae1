#include <chrono>
#include <stdexcept>

#include "model/bare_graph.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference {

namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(std::string("reference backend, load: ") + what);
}

void require_fit(const Setup& setup, const State& state) {
  const auto n = static_cast<std::size_t>(setup.body.particle_count());
  const auto substeps = static_cast<std::size_t>(setup.frame_count() * setup.step.substeps);
  require(setup.body.mass.size() == n, "one mass per particle is needed");
  require(state.x.size() == n && state.v.size() == n && state.alive.size() == n,
          "x, v and alive need one entry per particle");
  if (!setup.body.on_grid()) {
    const std::string problem = problem_of_edges(setup.body);
    require(problem.empty(), problem.c_str());
    require(!setup.skin.wanted, "a bare graph has no skin");
  }
  require(!setup.has_blade || setup.blade_moves.size() == substeps, "one blade move per substep is needed");
  for (const Grip& grip : setup.grips) {
    require(grip.active.size() == substeps && grip.displacement.size() == substeps,
            "one grip displacement per substep is needed");
  }
  const Clusters& clusters = state.clusters;
  const std::size_t m = static_cast<std::size_t>(clusters.count());
  require(clusters.number.size() == m && clusters.rotation.size() == m && clusters.rest_center.size() == m &&
              clusters.mass.size() == m && clusters.degenerate.size() == m,
          "every array of clusters needs one entry per cluster");
  require(clusters.offsets.front() == 0 && clusters.offsets.back() == static_cast<int64_t>(clusters.members.size()),
          "cluster offsets must run from 0 to the number of members");
  for (std::size_t c = 0; c < m; ++c) {
    require(clusters.offsets[c] < clusters.offsets[c + 1], "no cluster may be empty");
  }
  for (const int32_t i : clusters.members) {
    require(i >= 0 && static_cast<std::size_t>(i) < n, "cluster members must be particles of the body");
  }
}

class ReferenceBackend final : public Backend {
 public:
  std::string name() const override { return "reference"; }
  bool can_run(Span) const override { return true; }
  bool shows_iterates() const override { return true; }

  void load(std::vector<Setup> setups, std::vector<State> states) override {
    require(setups.size() == states.size(), "as many states as setups are needed");
    for (std::size_t b = 0; b < setups.size(); ++b) require_fit(setups[b], states[b]);
    setups_ = std::move(setups);
    states_ = std::move(states);
    report_ = {};
  }

  void run(Span span) override {
    report_ = {};
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t b = 0; b < setups_.size(); ++b) run_body(span, setups_[b], states_[b]);
    report_.total_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  std::vector<State> snapshot() const override { return states_; }
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const override {
    std::vector<State> states(states_.size());
    for (std::size_t b = 0; b < states.size(); ++b) {
      if (wanted.at(b)) states[b] = states_[b];
    }
    return states;
  }
  SpanReport report() const override { return report_; }

 private:
  void run_body(Span span, const Setup& setup, State& state) {
    if (state.frame >= setup.frame_count()) return;
    const auto stage = [&](Stage which, bool needed, void (*function)(const Setup&, State&)) {
      if (!span.contains(which) || !needed) return;
      const auto begin = std::chrono::steady_clock::now();
      function(setup, state);
      const auto index = static_cast<std::size_t>(which);
      report_.ran[index] = true;
      report_.seconds[index] += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    stage(Stage::step, true, step);
    stage(Stage::detect, needs_detection(setup), detect);
    const bool cut = !state.removed.empty();
    stage(Stage::split, cut, split);
    stage(Stage::merge, cut && setup.merge.rule != MergeRule::none, merge);
    const bool uncovered = setup.expand.rule == ExpandRule::edge_cover && !state.edge_covered;
    stage(Stage::expand, cut && (uncovered || setup.expand.rule == ExpandRule::published), expand);
    stage(Stage::skin, setup.skin.wanted, skin);
    if (span.contains(Stage::skin)) end_frame(state);
  }

  static void end_frame(State& state) {
    for (int32_t c = 0; c < state.clusters.count(); ++c) state.clusters.number[static_cast<std::size_t>(c)] = c;
    ++state.frame;
  }

  std::vector<Setup> setups_;
  std::vector<State> states_;
  SpanReport report_;
};

}  // namespace

std::unique_ptr<Backend> make_backend() { return std::make_unique<ReferenceBackend>(); }

}  // namespace cutproof::reference
