#include "cli/kick_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "cli/report_page.h"
#include "harness/run_states.h"
#include "model/at.h"
#include "model/bare_graph.h"
#include "model/io/atomic_file.h"

namespace cutproof::cli {

namespace {

// One of the runs as states of a body.
class KickStates {
 public:
  KickStates(const oracles::KickedRuns& runs, const std::vector<double>& positions)
      : runs_(runs), positions_(positions), first_(at(runs.particles), runs.frames) {
    for (int64_t frame = runs.frames - 1; frame >= 0; --frame) {
      for (int32_t i = 0; i < runs.particles; ++i) {
        const Vec3 x = place(frame, i);
        if (!std::isnan(x.x) || !std::isnan(x.y) || !std::isnan(x.z)) first_[at(i)] = frame;
      }
    }
  }

  Setup setup() const {
    Setup setup;
    Body& body = setup.body;
    for (int32_t i = 0; i < runs_.particles; ++i) body.rest.push_back(place(0, i));
    body.mass.assign(at(runs_.particles), 1);
    set_edges(body, {});
    body.grid.spacing = runs_.spacing > 0 ? runs_.spacing : harness::plausible_spacing(body);
    return setup;
  }
  State after(int64_t frame) const {
    State state;
    state.frame = frame + 1;
    for (int32_t i = 0; i < runs_.particles; ++i) {
      state.x.push_back(place(frame, i));
      state.alive.push_back(runs_.alive.empty() ? frame >= first_[at(i)]
                                                : runs_.alive[at(frame * runs_.particles + i)] != 0);
    }
    return state;
  }
  // By the order of their names.
  std::vector<int32_t> pieces(int64_t frame) const {
    std::map<int32_t, int32_t> number;
    for (const int32_t name : runs_.piece) number.emplace(name, static_cast<int32_t>(number.size()));
    const State state = after(frame);
    std::vector<int32_t> piece;
    for (std::size_t i = 0; i < runs_.piece.size(); ++i)
      piece.push_back(state.alive[i] != 0 ? number.at(runs_.piece[i]) : -1);
    return piece;
  }

 private:
  Vec3 place(int64_t frame, int32_t i) const {
    const std::size_t k = 3 * at(frame * runs_.particles + i);
    return {positions_[k], positions_[k + 1], positions_[k + 2]};
  }

  const oracles::KickedRuns& runs_;
  const std::vector<double>& positions_;
  std::vector<int64_t> first_;  // [n] the frame from which on a particle exists
};

report::Source source_of(const KickStates& states, const Setup& setup, const harness::RecordedKick& kick) {
  return {setup, kick.runs.frames,
          [&states](int64_t frame) {
            return io::Snapshot{Stage::skin, states.after(frame)};
          },
          [&states, &kick](int64_t frame) {
            return report::FrameOfRun{
                states.pieces(frame), {}, kick.time.empty() ? std::nullopt : std::optional(kick.time[at(frame)])};
          }};
}

}  // namespace

void write_kick_page(const std::string& path, const harness::RecordedKick& kick, const oracles::KickReport& report,
                     nlohmann::json document, const std::string& again) {
  const oracles::KickedRuns& runs = kick.runs;
  std::size_t shown = 0;
  const auto fails = [](const oracles::KickAnswer& answer) {
    return std::any_of(answer.verdicts.begin(), answer.verdicts.end(), [](const Verdict& v) { return !v.holds; });
  };
  if (const auto first = std::find_if(report.kicks.begin(), report.kicks.end(), fails); first != report.kicks.end())
    shown = at(first - report.kicks.begin());
  const KickStates without(runs, runs.positions);
  const KickStates kicked(runs, runs.kicks.empty() ? runs.positions : runs.kicks[shown].positions);
  const Setup setup = without.setup();
  const report::Beside beside = {source_of(without, setup, kick), false, "the run without a kick",
                                 fmt::format("kick {}", shown),
                                 "the same particle of the run without a kick, in the same frame"};
  if (runs.kicks.size() > 1) {
    document["notes"].push_back(
        fmt::format("The 3D view shows kick {} of kicks 0 to {}; marks of the others are drawn in it, too.", shown,
                    runs.kicks.size() - 1));
  }
  io::write_text(path, report::page(source_of(kicked, setup, kick), report::results_of(document, path), again,
                                    made_by(again), &beside));
}

}  // namespace cutproof::cli
